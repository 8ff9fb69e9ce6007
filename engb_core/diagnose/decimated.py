# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Recordings with no more samples than the comparison needs: a search predicts them all many
thousand times.

A Gaussian low-pass needs few samples of what varies within its window. Only friction, which turns
with the velocity, varies faster: what coarser samples make of that for the model file is added to
what was measured, so that the file is off by no more and no less than before. A hypothesis is off
by as much of it as it changes friction, which is small where the comparison is close.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from engb_core.diagnose.parallel_map import OwnSamples
from engb_core.diagnose.problem import Problem, Run
from engb_core.physics.plant import Physics, physics_of
from engb_core.signals.filtering import Comparison

__all__ = ['decimated']

# Samples between two values that are compared: the Gaussian's standard deviation is then still
# more than one interval, and what aliases is below a millionth.
SAMPLES_OF_VALUE = 4


def decimated(problem: Problem) -> Problem:
    """Return the problem with as many samples of its fitted motions as the comparison needs."""
    physics = physics_of(problem.model)
    return replace(problem, runs=tuple(_decimated(run, physics) for run in problem.runs))


def _decimated(run: Run, physics: Physics) -> Run:
    factor = _factor(run.comparison)
    if factor == 1:
        return run
    motion = run.motion.decimated(factor)
    coarse = replace(run, motion=motion, own=OwnSamples(motion.samples()),
                     comparison=run.comparison.decimated(factor))
    return replace(coarse, measured=run.measured + coarse.predicted(physics)
                   - run.predicted(physics))


def _factor(comparison: Comparison) -> int:
    between = int(np.gcd.reduce(comparison.grid))
    return max((factor for factor in range(1, between + 1)
                if between % factor == 0 and between >= SAMPLES_OF_VALUE * factor), default=1)
