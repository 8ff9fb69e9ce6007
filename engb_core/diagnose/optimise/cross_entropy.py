# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The middle of a basin that has many minima (cross-entropy method).

Of many narrow minima the deepest is an accident of the noise: another recording of the same brake
has its deepest elsewhere, and a fit that sits there predicts it badly. So points are drawn around
the best, the next ones are drawn as the best of these lie, and at last their median is taken: the
mean of an entry that stands at its bound would not stand there.
Reference: Rubinstein, Methodology and Computing in Applied Probability 1 (1999) 127.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.optimise.multistart import moved_places, Settling
from engb_core.diagnose.parallel_map import parallel_map

__all__ = ['middle_of_basin']

ROUNDS, DRAWN, BEST = 6, 80, 16
# Part of a random move's standard deviation that the first round is drawn with.
FIRST_SPREAD = 0.6
# How much of the last round's spread stays.
KEPT_SPREAD = 0.3
# The middle may cost so many times what the best point does.
DEARER = 1.1


def middle_of_basin(fitter: Fitter, fit: Fit) -> Fit:
    """Return the fit in the middle of the good points around `fit` (always the same ones), or
    `fit` where that is no good point itself."""
    hypothesis = fit.hypothesis
    moved, scale = moved_places(fit)
    low, high = (bound[moved] for bound in hypothesis.bounds)
    generator = np.random.default_rng(0)
    spread = np.diag((FIRST_SPREAD * scale) ** 2)
    middle = fit
    for _ in range(ROUNDS):
        settled = partial(Settling(fitter, middle), hypothesis)
        steps = generator.multivariate_normal(np.zeros(len(moved)), spread, DRAWN)
        drawn = np.repeat(middle.vector[None], DRAWN, axis=0)
        drawn[:, moved] = np.clip(drawn[:, moved] + steps, low, high)
        costs = [cost for cost, _ in parallel_map(settled, drawn, fitter.threads)]
        best = drawn[np.argsort(costs)[:BEST]][:, moved]
        spread = KEPT_SPREAD * spread + (1.0 - KEPT_SPREAD) * np.atleast_2d(np.cov(best.T))
        place = middle.vector.copy()
        place[moved] = np.median(best, axis=0)
        middle = fitter.evaluate(hypothesis, settled(place)[1])
    return middle if middle.cost < DEARER * fit.cost else fit
