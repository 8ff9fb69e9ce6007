# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Recordings with no more samples than the comparison needs: a search predicts them all many
thousand times.

A Gaussian low-pass needs few samples of what varies within its window. Only friction, which turns
with the velocity, varies faster: what fewer samples make of that for the model file is added to
what was measured, so that the file is off by no more and no less than before. A hypothesis is off
by as much of it as it changes friction. Where that is more for the refitted numbers than anything
can be told apart by, all samples are kept.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from engb_core.diagnose.formula import little_apart
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.parallel_map import OwnSamples
from engb_core.diagnose.problem import Problem, Run
from engb_core.physics.plant import Physics, physics_of
from engb_core.signals.filtering import Comparison

__all__ = ['decimated']

# Samples between two values that are compared: the Gaussian's standard deviation is then still
# more than one interval, and what aliases is below a millionth.
SAMPLES_OF_VALUE = 4


def decimated(problem: Problem, threads: int = 1) -> Problem:
    """Return the problem with as many samples of its fitted motions as the comparison needs; as it
    is where fewer will not do."""
    physics = physics_of(problem.model)
    runs = tuple(_decimated(run, physics) for run in problem.runs)
    if all(fewer is run for fewer, run in zip(runs, problem.runs, strict=True)):
        return problem
    base = Fitter(problem, threads).base()
    moved = []
    for index, (fewer, run) in enumerate(zip(runs, problem.runs, strict=True)):
        refitted = base.hypothesis.physics(base.vector, index)
        moved.append((fewer.predicted(refitted) - run.predicted(refitted)
                      - (fewer.measured - run.measured)) / run.sigma)
    if float(np.mean(np.concatenate(moved) ** 2)) > little_apart():
        return problem
    return replace(problem, runs=runs)


def _decimated(run: Run, physics: Physics) -> Run:
    """Return the run with fewer samples, their error for `physics` added to what was measured; the
    run itself where a value would be left without a sample."""
    factor = _factor(run.comparison)
    if factor == 1:
        return run
    comparison = run.comparison.decimated(factor)
    if not np.isfinite(comparison.scale).all():
        return run
    motion = run.motion.decimated(factor)
    fewer = replace(run, motion=motion, own=OwnSamples(motion.samples()), comparison=comparison)
    return replace(fewer, measured=run.measured + fewer.predicted(physics)
                   - run.predicted(physics))


def _factor(comparison: Comparison) -> int:
    between = int(np.gcd.reduce(comparison.grid))
    return max((factor for factor in range(1, between + 1)
                if between % factor == 0 and between >= SAMPLES_OF_VALUE * factor), default=1)
