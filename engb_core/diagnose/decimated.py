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
from numpy.typing import NDArray

from engb_core.diagnose.parallel_map import OwnSamples
from engb_core.diagnose.problem import Problem, Run
from engb_core.physics.nominal_torque import N_SATURATION
from engb_core.physics.plant import Physics, physics_of
from engb_core.signals.filtering import Comparison
from engb_core.signals.motion import filtered

__all__ = ['decimated']

Array = NDArray[np.float64]

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
    motion = replace(motion, velocity=_with_mean_direction(
        run.motion.velocity, factor, physics.nominal[N_SATURATION]))
    coarse = replace(run, motion=motion, own=OwnSamples(motion.samples()),
                     comparison=run.comparison.decimated(factor))
    return replace(coarse, measured=run.measured + coarse.predicted(physics)
                   - run.predicted(physics))


def _with_mean_direction(velocity: Array, factor: int, saturation: float) -> Array:
    """Return the velocities (m,) [rad/s] at every so manieth sample, but where friction turns
    between two of them those at which it has its mean direction, by straight lines."""
    direction = np.clip(velocity / saturation, -1.0, 1.0)
    triangle = np.convolve(np.ones(factor), np.ones(factor)) / factor ** 2
    mean = filtered(direction, triangle)[::factor]
    every: Array = velocity[::factor].copy()
    turns = np.abs(mean) < 1.0
    every[turns] = saturation * mean[turns]
    return every


def _factor(comparison: Comparison) -> int:
    between = int(np.gcd.reduce(comparison.grid))
    return max((factor for factor in range(1, between + 1)
                if between % factor == 0 and between >= SAMPLES_OF_VALUE * factor), default=1)
