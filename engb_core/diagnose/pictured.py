# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the pictures of the effects are drawn over: signals beside effort and motion."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.locate import coordinates
from engb_core.diagnose.problem import Run
from engb_core.effects.base import LOAD, SHIFT
from engb_core.model import Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.prediction import find_phases

__all__ = ['channels_of']

Array = NDArray[np.float64]


def channels_of(run: Run, corrected: Model, effects: Iterable[str]) -> dict[str, Array]:
    """Return signals (m,) on the run's filtered grid, by name.

    The coordinates of `locate`; `model_load` [N·m] and `model_shift` [rad], the load torque and
    the displacement of the load side with all effects of the corrected model; `in_contact` [s],
    the time since the load began; and of each effect `without:ID`, the effort that the corrected
    model needs without it.
    """
    found = {name: values for name, (values, _) in coordinates(run, corrected).items()}
    model = find_phases(run.motion, corrected)
    samples = run.motion.samples()
    effort_of_motion(samples, run.motion.step, physics_of(model))
    found['model_load'] = run.comparison(samples[:, LOAD])
    found['model_shift'] = samples[run.comparison.grid, SHIFT]
    loaded = np.abs(samples[:, LOAD]) > 0.1 * np.max(np.abs(samples[:, LOAD]), initial=0.0)
    begin = np.concatenate([[0], np.flatnonzero(loaded[1:] & ~loaded[:-1]) + 1])
    last = begin[np.maximum(np.searchsorted(begin, np.arange(loaded.size), side='right') - 1, 0)]
    found['in_contact'] = np.where(loaded, run.motion.time - run.motion.time[last],
                                   np.nan)[run.comparison.grid]
    for name in dict.fromkeys(effects):
        rest = tuple(entry for entry in model.effects if entry.effect != name)
        if len(rest) < len(model.effects):
            found[f'without:{name}'] = run.predicted(physics_of(replace(model, effects=rest)))
    return found
