# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How surely one model leaves less than another, by how both scatter over stretches of time.

The residual of a formula that is only nearly right is no noise, and its values are not
independent; stretches that are longer than any filter are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from engb_core.diagnose.optimise.fit import Fitter

__all__ = ['STRETCH', 'odds_of_less', 'stretches']

Array = NDArray[np.float64]

STRETCH = 1.5        # s; longer than any filter


def stretches(fitter: Fitter) -> NDArray[np.int64]:
    """Return the stretch of time (m,) that each value lies in, counted through all recordings."""
    parts, begin = [], 0
    for run in fitter.problem.runs:
        parts.append((run.motion.time[run.comparison.grid] / STRETCH).astype(int) + begin)
        begin = int(parts[-1].max()) + 1
    return np.concatenate(parts)


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
