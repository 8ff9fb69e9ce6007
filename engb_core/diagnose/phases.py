"""Phases that no recording carries over to the next, found in the recording itself.

Where on the disc the runout's high spot stood at the first sample is not recorded. It is one
number a recording, found by least squares; everything else comes from the model file.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from engb_core.effects.catalogue import get_effect
from engb_core.filtering import comparison_of
from engb_core.inverse_dynamics import effort_of_motion
from engb_core.model import EffectSetting, Model
from engb_core.motion import Motion
from engb_core.plant import physics_of

__all__ = ['find_phases']

BANDWIDTH = 20.0


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
    samples = motion.samples()

    def at(phase: float) -> Model:
        changed = EffectSetting(setting.effect, {**setting.parameters, 'phase': phase})
        effects = (*model.effects[:index], changed, *model.effects[index + 1:])
        return replace(model, effects=effects)

    def predicted(phase: float) -> np.ndarray:
        return comparison(effort_of_motion(samples, motion.step, physics_of(at(phase))))

    # a·sin(x + φ): the part without it is the mean of two opposite phases.
    sine, opposite, cosine = predicted(0.0), predicted(np.pi), predicted(0.5 * np.pi)
    middle = 0.5 * (sine + opposite)
    design = np.stack([sine - middle, cosine - middle], axis=1)
    parts, *_ = np.linalg.lstsq(design, comparison(motion.effort) - middle, rcond=None)
    return at(float(np.arctan2(parts[1], parts[0])))
