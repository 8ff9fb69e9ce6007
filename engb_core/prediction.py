"""What a model says of a recording that it was not fitted to.

Where on the disc the runout's high spot stood at the first sample is not recorded. It is one
number a recording, found by least squares; everything else comes from the model file.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from engb_core.effects.catalogue import get_effect
from engb_core.filtering import comparison_of, judgeable, slowest_speed
from engb_core.inverse_dynamics import effort_of_motion
from engb_core.model import EffectSetting, Model
from engb_core.motion import Motion, motion_of
from engb_core.plant import physics_of
from engb_core.recording import Recording

__all__ = ['find_phases', 'predict_effort']

Array = NDArray[np.float64]

# So long before the first count and after the last one the shaft may have moved [s].
BESIDE_A_STOP = 0.02
BANDWIDTH = 20.0
# Phases tried before the best is refined: harmonics up to the second make no narrower basin.
_TRIED = 16


def predict_effort(recording: Recording, model: Model) -> Array:
    """Return the effort (n,) [N·m] that the model says the recorded motion needs.

    Phases that no recording carries over to the next (the disc's, for runout) are first found
    in this recording.
    """
    motion = motion_of(recording)
    model = find_phases(motion, model)
    effort = effort_of_motion(motion.samples(), motion.step, physics_of(model))
    speed = float(np.quantile(np.abs(motion.velocity), 0.995))
    slowest = slowest_speed([motion], model.friction.saturation_velocity, speed)
    effort = _beside_stops(effort, judgeable(motion, slowest), motion.step)
    return np.interp(recording.time, motion.time, effort)


def _beside_stops(effort: Array, judgeable: NDArray[np.bool_], step: float) -> Array:
    """Return the effort with the moments beside a stop taken from the motion next to them.

    An encoder tells of a start only with the first count, and derivatives are smoothed over it;
    friction is there at once.
    """
    moving = np.flatnonzero(judgeable)
    if moving.size == 0:
        return effort
    place = np.arange(effort.size)
    after = np.clip(np.searchsorted(moving, place), 0, moving.size - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(np.abs(moving[after] - place) <= np.abs(moving[before] - place),
                       moving[after], moving[before])
    beside = np.abs(nearest - place) * step <= BESIDE_A_STOP
    return np.where(beside, effort[nearest], effort)


def find_phases(motion: Motion, model: Model) -> Model:
    """Return the model with every per-recording phase fitted to this motion."""
    for index, setting in enumerate(model.effects):
        effect = get_effect(setting.effect)
        for parameter in effect.parameters:
            if parameter.per_recording and parameter.name == 'phase':
                model = _with_phase(motion, model, index, setting)
    return model


def _with_phase(motion: Motion, model: Model, index: int, setting: EffectSetting) -> Model:
    slowest = 0.003 * float(np.quantile(np.abs(motion.velocity), 0.995))
    comparison = comparison_of(motion, BANDWIDTH, slowest)
    if comparison.grid.size < 10:
        return model
    samples, measured = motion.samples(), comparison(motion.effort)

    def at(phase: float) -> Model:
        changed = EffectSetting(setting.effect, {**setting.parameters, 'phase': phase})
        effects = (*model.effects[:index], changed, *model.effects[index + 1:])
        return replace(model, effects=effects)

    def mismatch(phase: float) -> float:
        effort = effort_of_motion(samples, motion.step, physics_of(at(phase)))
        return float(np.mean((measured - comparison(effort)) ** 2))

    step = 2.0 * np.pi / _TRIED
    tried = step * np.arange(_TRIED)
    best = float(tried[np.argmin([mismatch(phase) for phase in tried])])
    refined = minimize_scalar(mismatch, bounds=(best - step, best + step), method='bounded',
                              options={'xatol': 1e-3})
    return at(float(refined.x))
