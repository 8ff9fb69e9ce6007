# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which nominal numbers a corrected model keeps as the file has them: spike and slab.

A refit moves every number a little, and on another motion each of these moves costs. A number is
either as in the file (the spike) or anywhere about it (the slab: the file's own spread), the one
as likely beforehand as the other. The Bayes factor of the two is the Savage-Dickey ratio: the
posterior density at the file's values over the prior density there (Dickey, Annals of Mathematical
Statistics 42 (1971) 204). A file that was refitted around what was missing has its numbers far
from what they are beside it, and none is kept.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.nominal import SHAPE_NUMBERS
from engb_core.diagnose.uncertainty import correlation, vector_deviations

__all__ = ['kept_numbers', 'with_kept_numbers']

Array = NDArray[np.float64]

# Steps downhill for the others, once some numbers are as in the file.
ROUNDS = 3
# From this many times the file's spread on a deviation leaves what the file says, to rounding.
UNTOLD = float(np.finfo(float).eps ** -0.5)


def with_kept_numbers(fitter: Fitter, fit: Fit) -> Fit:
    """Return a finished fit with those numbers as in the file that it need not change."""
    kept = kept_numbers(fitter, fit)
    if not kept:
        return fit
    free = tuple(number for place, number in enumerate(fit.hypothesis.numbers)
                 if place not in kept)
    return fitter.finish(fitter.refit(fit, free, ROUNDS))


def kept_numbers(fitter: Fitter, fit: Fit) -> list[int]:
    """Return the places of the numbers of a finished fit that are rather as in the file.

    One after another, the likeliest first, as long as all of them together become likelier.
    """
    numbers = fit.hypothesis.numbers
    own = slice(len(numbers))
    # In units of what the file is believed to: the slab's density at the file is that of 0.
    spread = np.array([number.spread for number in numbers])
    moved = (fit.vector[own] - fit.hypothesis.start_of_numbers()) / spread
    deviations = np.minimum(vector_deviations(fit, fitter)[own] / spread, UNTOLD)
    among = correlation(fit, fitter)[own, own] * np.outer(deviations, deviations)
    # What the file says of a number counts beside what the recordings do.
    among = among @ np.linalg.inv(among + np.eye(len(numbers)))
    candidates = [place for place, number in enumerate(numbers)
                  if number.name not in SHAPE_NUMBERS]
    kept: list[int] = []
    factor = 0.0
    while candidates:
        tried = [_log_bayes_factor(moved, among, [*kept, place]) for place in candidates]
        best = int(np.argmax(tried))
        if not tried[best] > factor:
            break
        factor = tried[best]
        kept.append(candidates.pop(best))
    return sorted(kept)


def _log_bayes_factor(moved: Array, among: Array, kept: list[int]) -> float:
    """Return the logarithm of how much likelier the kept numbers are as in the file than free;
    `moved` (k,) and their covariance `among` (k, k) in units of the file's spread."""
    own = among[np.ix_(kept, kept)]
    sign, size = np.linalg.slogdet(own)
    if sign <= 0.0 or not np.isfinite(size):
        return -np.inf
    return float(-0.5 * size - 0.5 * moved[kept] @ np.linalg.solve(own, moved[kept]))
