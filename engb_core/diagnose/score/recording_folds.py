# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whole recordings as folds: does an effect carry over to recordings that it was not fitted to?

Recordings of other manoeuvres, or at other gains of a loop, are the folds that a machine gives by
itself. How well a fit to all others does on each follows from the fit's own derivatives, without
fitting anew (the linear leave-one-block-out formula: Cook and Weisberg, Residuals and Influence in
Regression, 1982, section 3.6). The logarithms of the errors' ratios, one for each recording, are
then held against how they scatter among the recordings (Student's t).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from engb_core.diagnose.constants import CHANCE
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.optimise.normal_equations import normal_equations

__all__ = ['LEAST_RECORDINGS', 'better_on_others', 'costs_left_out']

Array = NDArray[np.float64]

# Fewer recordings than this say nothing of how they scatter.
LEAST_RECORDINGS = 4
# Part of the best told information below which a direction is not told at all: what rounding makes
# of sums of products of thousands of values.
_LEAST_TOLD = 1e-9


def costs_left_out(fitter: Fitter, fit: Fit) -> Array:
    """Return the weighted sum of squares on each recording, (runs,), of the fit to all others."""
    finished = fitter.finished(fit)
    jacobian, weight = finished.jacobian, fitter.weight
    assert jacobian is not None
    low, high = fit.hypothesis.bounds
    # What stands at a bound stays there.
    free = (fit.vector > low) & (fit.vector < high)
    jacobian = jacobian[:, free]
    prior = fit.hypothesis.prior[1][free] ** -2.0
    gram, _ = normal_equations(jacobian, fit.residual, weight)
    costs, begin = [], 0
    for run in fitter.problem.runs:
        rows = slice(begin, begin + run.measured.size)
        begin = rows.stop
        columns = jacobian[rows] * weight[rows, None]
        residual = fit.residual[rows] * weight[rows]
        others = gram - columns.T @ columns + np.diag(prior)
        # By all recordings together: what the others tell of a number that this one alone tells
        # is a difference of like sums, and may come out below nothing.
        norm = np.sqrt(np.diag(gram) + prior)
        norm[norm == 0.0] = 1.0
        # What the others do not tell, or only together with something else, stays as it is.
        moved = np.linalg.lstsq(others / np.outer(norm, norm), columns.T @ residual / norm,
                                rcond=_LEAST_TOLD)[0] / norm
        left_out = residual + columns @ moved
        costs.append(float(left_out @ left_out))
    return np.array(costs)


def better_on_others(fitter: Fitter, smaller: Fit, larger: Fit) -> bool:
    """Whether `larger` is better than `smaller` on recordings that were left out of the fit, by
    more than the recordings' scatter could be; False where they are too few to say."""
    if len(fitter.problem.runs) < LEAST_RECORDINGS:
        return False
    before, after = costs_left_out(fitter, smaller), costs_left_out(fitter, larger)
    judged = (before > 0.0) & (after > 0.0)
    gains = np.log(before[judged] / after[judged])
    if gains.size < LEAST_RECORDINGS:
        return False
    spread = float(np.std(gains, ddof=1)) / np.sqrt(gains.size)
    if spread == 0.0:
        return bool(gains[0] > 0.0)
    return bool(gains.mean() / spread > student.isf(CHANCE, gains.size - 1))
