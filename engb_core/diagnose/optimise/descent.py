# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Damped least squares with few derivatives: Levenberg–Marquardt steps within bounds.

After a step the derivatives are corrected by what it really changed (`secant`) and serve once
more, since each column costs a prediction of everything that was recorded.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.fit_steps import bounded_step, largest_step, secant
from engb_core.diagnose.fitted import Fit
from engb_core.diagnose.hypothesis import Hypothesis
from engb_core.diagnose.nominal import DELAY
from engb_core.diagnose.objective import Objective
from engb_core.diagnose.optimise.normal_equations import normal_equations

__all__ = ['delay_held', 'descended']

Array = NDArray[np.float64]

# Damping to begin with, its factors after a step that helps and one that does not, its least, and
# that at which no step is small enough.
DAMPING, LESS, MORE, LEAST, STUCK = 1e-4, 0.2, 100.0, 1e-6, 1e5
# Steps that every fit is given.
FIRST_STEPS = 2


def descended(objective: Objective, begin: Fit, shared: Array, rounds: int, tolerance: float,
              hopeless: float = math.inf) -> Fit:
    """Return the best fit that so many steps downhill from `begin` come to.

    Args:
        objective: predicts.
        begin: where to start.
        shared: (m, count) derivatives by the first entries of the vector, the nominal numbers at
            least, which are not taken anew.
        rounds: steps that help, at most.
        tolerance: part of the cost; whoever gains or is promised less goes no further.
        hopeless: cost; whoever is still above it after two steps goes no further.
    """
    hypothesis = begin.hypothesis
    low, high = hypothesis.bounds
    centre, spread = hypothesis.prior
    others = range(shared.shape[1], hypothesis.size)
    weight = objective.weight
    down, up = _reach(hypothesis)
    held = delay_held(hypothesis)
    best = _within_bounds(objective, begin, held)
    damping, steps, done, failed, taken_here = DAMPING, 0, False, False, False
    design: Array | None = None
    while not done and steps < rounds and damping <= STUCK:
        if steps >= FIRST_STEPS and best.cost > hopeless:
            break
        if design is None:
            design = np.concatenate([shared, objective.columns(best, others)], axis=1)
            taken_here, failed = True, False
        gram, right = normal_equations(design, best.residual, weight)
        gram += np.diag(1.0 / spread ** 2)
        right += (centre - best.vector) / spread ** 2
        if held is not None:
            gram[held] = gram[:, held] = right[held] = 0.0
            gram[held, held] = 1.0
        step = bounded_step(gram + damping * np.diag(np.diag(gram)), right,
                            np.maximum(low - best.vector, down),
                            np.minimum(high - best.vector, up))
        if failed and float(step @ (2.0 * right - gram @ step)) < tolerance * best.cost:
            break
        trial = objective.evaluate(hypothesis, np.clip(best.vector + step, low, high))
        failed = trial.cost >= best.cost
        if failed and taken_here:
            damping *= MORE
        elif failed or not taken_here:
            design = None
        else:
            design = secant(design, trial.vector - best.vector, trial.predicted - best.predicted,
                            np.diag(gram))
            taken_here = False
        if not failed:
            done = best.cost - trial.cost < tolerance * best.cost
            best, steps = trial, steps + 1
            damping = max(damping * LESS, LEAST)
    return best


def _reach(hypothesis: Hypothesis) -> tuple[Array, Array]:
    """Return how far one step may move each entry of the vector, down and up, (size,) each."""
    count = len(hypothesis.numbers)
    reach = np.array([(-np.inf, np.inf)] * count
                     + [largest_step(hypothesis.parameter(entry))
                        for entry in range(hypothesis.size - count)]).reshape(-1, 2)
    return reach[:, 0], reach[:, 1]


def delay_held(hypothesis: Hypothesis) -> int | None:
    """Return the place of the sampling delay where a lag is looked for: one of both."""
    if not any(variant.effect.time_shift for variant in hypothesis.variants):
        return None
    return next((place for place, number in enumerate(hypothesis.numbers)
                 if number.name == DELAY), None)


def _within_bounds(objective: Objective, begin: Fit, held: int | None) -> Fit:
    vector = np.clip(begin.vector, *begin.hypothesis.bounds)
    if held is not None:
        vector[held] = 0.0
    return begin if np.array_equal(vector, begin.vector) else objective.evaluate(
        begin.hypothesis, vector)
