# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Is what a fit leaves noise? By its size, and where its size is in doubt by its colour.

How strong the noise is has to be estimated from the recording itself, from seconds of standstill
or from what lies above the band, and what position counts add to it from a motion that stands for
the true one. So a remainder may be larger than the noise is thought to be and still be nothing
else. Physics that is missing comes again from one moment to the next: it has a colour. A remainder
that has none holds nothing that any model could predict.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import chi2

from engb_core.diagnose.constants import CHANCE, CLEAN_EXCESS, MOST_NOISE
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square

__all__ = ['colour', 'is_noise']

# Lags that are looked at, in steps of the filtered values: neighbours share a part of the filter's
# window whatever the noise, and from the second on they do not. Ten lags are four periods of the
# filter's corner; what is slower than that has its colour in the first of them.
LAGS = range(2, 12)


def is_noise(fitter: Fitter, fit: Fit) -> bool:
    """Return whether what a fit leaves is noise: within how well its level is known, or without
    colour and no more than as much again."""
    excess = reduced_chi_square(fit, fitter) - 1.0
    return excess <= CLEAN_EXCESS or (excess <= MOST_NOISE and colour(fitter, fit) > CHANCE)


def colour(fitter: Fitter, fit: Fit) -> float:
    """Return the probability that residuals without any colour look as coloured as a fit's.

    The portmanteau test of the autocorrelation (Ljung and Box, On a measure of lack of fit in time
    series models, Biometrika 65 (1978) 297), over pairs of values that follow one another without
    a gap.
    """
    runs = fitter.problem.runs
    parts = fitter.problem.split(fit.residual / fitter.sigma)
    steps = [run.time / run.motion.step for run in runs]
    strides = [float(np.diff(step).min(initial=np.inf)) for step in steps]
    count = sum(part.size for part in parts)
    whole = sum(float(part @ part) for part in parts)
    total, lags = 0.0, 0
    for lag in LAGS:
        product, pairs = 0.0, 0
        for part, step, stride in zip(parts, steps, strides, strict=True):
            together = step[lag:] - step[:-lag] < (lag + 0.5) * stride
            product += float(part[lag:][together] @ part[:-lag][together])
            pairs += int(together.sum())
        if pairs > lag:
            # Of so many pairs alone the correlation is known as well as its variance says.
            total += (product / whole) ** 2 * count ** 2 / pairs
            lags += 1
    return float(chi2.sf(total, lags)) if lags else 1.0
