# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a hypothesis leaves of stretches that it was not fitted to: cross-validation over time.

A fit without one fold lies a step of Gauss and Newton from the fit to all of them, by the fit's
own derivatives (leave-one-block-out: Cook and Weisberg, Residuals and Influence in Regression,
1982, section 3.6). What it predicts of the fold is computed there and not extrapolated, since an
effect's form need not be linear in its parameters.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from engb_core.diagnose.constants import WORTH_PART
from engb_core.diagnose.descent import delay_held, reach
from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.normal_equations import normal_equations
from engb_core.diagnose.reduced_chi_square import reduced_chi_square_of_residual

__all__ = ['HEARD', 'carries_over', 'left_out_chi_square', 'odds_of_less', 'steps_without',
           'stretches', 'time_folds', 'without_each_fold']

Array = NDArray[np.float64]

FOLDS = 5
STRETCH = 1.5        # s; longer than any filter, shorter than a stroke
# Weight with which a fold that is left out still tells the model's own numbers. One that all other
# folds tell ten times less well than this one alone is not tested by them: without the fold it
# runs away (a cubic load curve at the end of the stroke), and what it then misses would outweigh
# all that an effect explains.
HEARD = 0.1
# Part of the best told information below which a direction is not told at all: what rounding makes
# of sums of products of thousands of values.
_LEAST_TOLD = 1e-9
# Parts of a step that are tried until the others of the values are no worse with it.
_PARTS = (1.0, 0.5, 0.2, 0.05)


def stretches(fitter: Fitter) -> NDArray[np.int64]:
    """Return the stretch of time (m,) that each value lies in, counted through all recordings."""
    parts, begin = [], 0
    for run in fitter.problem.runs:
        parts.append((run.motion.time[run.comparison.grid] / STRETCH).astype(int) + begin)
        begin = int(parts[-1].max()) + 1
    return np.concatenate(parts)


def time_folds(fitter: Fitter) -> NDArray[np.int64]:
    """Return the fold (m,) of each value: stretches of time, or whole recordings where there are
    enough of them, since the next one moves in other ways than the last."""
    runs = fitter.problem.runs
    if len(runs) >= FOLDS:
        parts = [np.full(run.measured.size, index) for index, run in enumerate(runs)]
    else:
        parts = [(run.motion.time[run.comparison.grid] / STRETCH).astype(int) + 3 * index
                 for index, run in enumerate(runs)]
    return np.concatenate(parts) % FOLDS


def steps_without(fitter: Fitter, fit: Fit, folds: NDArray[np.int64], heard: float = 0.0,
                  ) -> Iterator[tuple[NDArray[np.bool_], Array]]:
    """Yield the fitted rows (m,) of each fold, and the step (size,) from a finished fit towards
    the fit to all others.

    Args:
        fitter: of the problem.
        fit: with its derivatives (`Fitter.finish`).
        folds: (m,) label of the fold that each value is in.
        heard: weight with which a fold still tells the model's own numbers (`HEARD`, or 0).
    """
    assert fit.jacobian is not None, 'folds are left out of a finished fit'
    vector, weight = fit.vector, fitter.weight
    low, high = fit.hypothesis.bounds
    centre, spread = fit.hypothesis.prior
    # What stands at a bound stays there.
    free = (vector > low) & (vector < high)
    held = delay_held(fit.hypothesis)
    if held is not None:
        free[held] = False
    numbers = free & (np.arange(vector.size) < len(fit.hypothesis.numbers))
    gram, right = normal_equations(fit.jacobian, fit.residual, weight)
    # By all values together: what the others tell of a number that one fold alone tells is a
    # difference of like sums, and may come out below nothing.
    norm = np.sqrt(np.diag(gram) + spread ** -2.0)
    norm[norm == 0.0] = 1.0
    known, pulled = np.diag(spread ** -2.0), (centre - vector) / spread ** 2
    for label in np.unique(folds[fitter.fitted]):
        rows = fitter.fitted & (folds == label)
        own, pull = normal_equations(fit.jacobian, fit.residual, np.where(rows, weight, 0.0))

        step = np.zeros(vector.size)
        for places, out in ((free, 1.0), (numbers, 1.0 - heard)):
            step[places] = 0.0
            others = (gram - out * own + known) / np.outer(norm, norm)
            towards = (right - out * pull + pulled) / norm - others @ step
            # What the others do not tell, or only together with something else, stays as it is.
            step[places] = np.linalg.lstsq(others[np.ix_(places, places)], towards[places],
                                           rcond=_LEAST_TOLD)[0]
            if not heard:
                break
        yield rows, step / norm


def without_each_fold(fitter: Fitter, fit: Fit) -> Iterator[tuple[NDArray[np.bool_], Fit]]:
    """Yield the rows (m,) of each fold, and the fit to all others; first the rows that no fit may
    look at, and the fit itself."""
    if not fitter.fitted.all():
        yield ~fitter.fitted, fit
    fit = fitter.finished(fit)
    low, high = fit.hypothesis.bounds
    centre, spread = fit.hypothesis.prior
    down, up = reach(fit.hypothesis)

    def cost(at: Fit, rows: NDArray[np.bool_]) -> float:
        scaled = (at.residual * fitter.weight)[rows]
        return float(scaled @ scaled + np.sum(((at.vector - centre) / spread) ** 2))

    for rows, step in steps_without(fitter, fit, time_folds(fitter), HEARD):
        others = fitter.fitted & ~rows
        step, best, least = np.clip(step, down, up), fit, cost(fit, others)
        for part in _PARTS:
            moved = fitter.evaluate(fit.hypothesis, np.clip(fit.vector + part * step, low, high))
            if cost(moved, others) < least:
                best = moved
                break
        yield rows, best


def left_out_chi_square(fitter: Fitter, fit: Fit) -> float:
    """Return the mean square (noise = 1) that a hypothesis leaves of values which it was not
    fitted to, over all that was recorded."""
    residual = np.empty_like(fit.residual)
    for rows, without in without_each_fold(fitter, fit):
        residual[rows] = without.residual[rows]
    return reduced_chi_square_of_residual(residual, fitter)


def carries_over(fitter: Fitter, simple: Fit, rich: Fit) -> bool:
    """Whether a richer hypothesis takes away so much more of the excess over the noise than a
    simple one, of values that they were not fitted to, that it is worth having (`WORTH_PART`)."""
    before, after = (left_out_chi_square(fitter, fit) - 1.0 for fit in (simple, rich))
    return before - after > WORTH_PART * max(before, 0.0)


def odds_of_less(first: Array, second: Array, share: Array, floor: float) -> float:
    """Return the odds, 1 at most, that the first of two models leaves less of other stretches than
    the second, where the logarithm of what they leave scatters over stretches as it does over
    these (Student's t; the deviation of the mean ratio by the linear jackknife: Efron and
    Tibshirani, An Introduction to the Bootstrap, 1993, chapter 11).

    Args:
        first, second: (stretches,) excess over the noise that each leaves, as parts of a whole.
        share: (stretches,) part of the whole that each stretch is.
        floor: excess below which models are told apart no further.
    """
    used = share > 0.0
    count = int(used.sum())
    if count < 2:
        return 1.0
    whole = [max(float(part.sum()), 0.0) for part in (first, second)]
    ratio = float(np.log((whole[0] + floor) / (whole[1] + floor)))
    pull = [(part - part.sum() * share)[used] / (total + floor)
            for part, total in zip((first, second), whole, strict=True)]
    scatter = float(np.sqrt(count / (count - 1) * np.sum((pull[0] - pull[1]) ** 2)))
    if ratio <= 0.0 or scatter == 0.0:
        return 1.0 if ratio <= 0.0 else 0.0
    less = float(student.sf(ratio / scatter, count - 1))
    return less / (1.0 - less)
