# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a model says of a recording that it was not fitted to.

Where on the disc the runout's high spot stood at the first sample is not recorded. It is one
number a recording, found by least squares; everything else comes from the model file.
"""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from engb_core.effects.catalogue import get_effect
from engb_core.model import Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.nominal_torque import N_SATURATION
from engb_core.physics.plant import Physics, physics_of
from engb_core.recording import Recording
from engb_core.signals.data_faults import cleaned
from engb_core.signals.filtering import comparison_of, slowest_speed
from engb_core.signals.motion import Motion, motion_of
from engb_core.signals.motion_band import (
    COMPARED,
    outweighed_from,
    position_variance,
    told_up_to,
)
from engb_core.signals.position_error import effort_of_recording
from engb_core.signals.sampling_noise import sampling_noise
from engb_core.signals.sharp_motion import band_limited, sharp_motion_of
from engb_core.signals.stamps import evenly_timed

__all__ = ['find_phases', 'predict_effort']

Array = NDArray[np.float64]

# Behind a gap or a shaft the load follows the motor's acceleration, and would ring with what
# overshoots: there the motion is smoothed without overshoot. Whether a load falls through its gap
# or not may hang on the noise of one sample: the median of differently smoothed motions is taken.
BEHIND, BANDWIDTHS = 'inertia_fraction', (160.0, 130.0, 105.0)
# Phases are slow: found where noise is least [Hz].
_PHASE_BANDWIDTH = 20.0
# Phases tried before the best is refined: harmonics up to the second make no narrower basin.
_TRIED = 16


def predict_effort(recording: Recording, model: Model) -> Array:
    """Return the effort (n,) [N·m] that the model says the recorded motion needs.

    Where coarse counts drown the torque at low frequencies already, the motion is smoothed to what
    they tell (motion_band.py). Samples that cannot be true (a position that jumps away and back)
    tell no motion and are left out. Phases that no recording carries over to the next (the disc's,
    for runout) are first found in this recording.
    """
    recording = evenly_timed(recording)
    clean, _ = cleaned(recording, model)
    model = find_phases(motion_of(clean), model)
    told = told_up_to(clean, model.motor.inertia)
    if told < COMPARED:
        motions = [motion_of(clean, told)]
    elif any(BEHIND in setting.parameters for setting in model.effects):
        motions = [motion_of(clean, bandwidth) for bandwidth in BANDWIDTHS]
    else:
        motions = [sharp_motion_of(clean)]
    physics, tells = physics_of(model), math.inf
    if physics.stages['actuation']:
        tells = outweighed_from(clean, model.motor.inertia, position_variance(
            clean, motions[0], sampling_noise(clean)))
    return np.median([_effort(recording, motion, physics, tells) for motion in motions], axis=0)


def _effort(recording: Recording, motion: Motion, physics: Physics, told: float) -> Array:
    """Return the effort at the recording's samples, without what these cannot show: late torque
    turns within less."""
    moving = np.abs(motion.velocity) >= slowest_speed(
        [motion], float(physics.nominal[N_SATURATION]), motion.speed)
    effort = effort_of_recording(recording, motion, motion.samples(), physics, moving, told=told)
    return np.interp(recording.time, motion.time,
                     band_limited(effort, motion.step, recording.interval))


def find_phases(motion: Motion, model: Model) -> Model:
    """Return the model with every per-recording phase fitted to this motion."""
    for index, setting in enumerate(model.effects):
        effect = get_effect(setting.effect)
        for parameter in effect.parameters:
            if parameter.per_recording and parameter.kind == 'phase':
                model = _with_phase(motion, model, index, parameter.name)
    return model


def _with_phase(motion: Motion, model: Model, index: int, name: str) -> Model:
    comparison = comparison_of(motion, _PHASE_BANDWIDTH, 0.003 * motion.speed)
    if comparison.grid.size < 10:
        return model
    setting, samples = model.effects[index], motion.samples()
    measured = comparison(motion.effort)

    def at(phase: float) -> Model:
        changed = replace(setting, parameters={**setting.parameters, name: phase})
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
