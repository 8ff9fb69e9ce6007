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
from engb_core.diagnose.cross_validation import steps_without
from engb_core.diagnose.fit import Fit, Fitter

__all__ = ['better_on_others', 'costs_left_out']

Array = NDArray[np.float64]

# Fewer recordings than this say nothing of how they scatter.
LEAST_RECORDINGS = 4


def costs_left_out(fitter: Fitter, fit: Fit) -> Array:
    """Return the weighted sum of squares on each recording, (runs,), of the fit to all others."""
    finished = fitter.finished(fit)
    assert finished.jacobian is not None
    runs = fitter.problem.runs
    place = np.repeat(np.arange(len(runs)), [run.measured.size for run in runs])
    costs = np.zeros(len(runs))
    for rows, step in steps_without(fitter, finished, place):
        left = (fit.residual - finished.jacobian @ step)[rows] * fitter.weight[rows]
        costs[place[rows][0]] = left @ left
    return costs


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
