# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The mean squared residual in units of the noise's: 1 is what noise alone leaves.

Values are weighed as in the fits, so that a few of little noise do not rule where a model misses
by far more than that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.optimise.fit import Fit, Fitter

__all__ = ['excess', 'reduced_chi_square', 'reduced_chi_square_of', 'unseen_rows']


def reduced_chi_square(fit: Fit, fitter: Fitter) -> float:
    """Return the mean squared residual over all that was recorded, in units of the noise's."""
    return _mean_square(fit.residual, fitter.sigma, fitter.spread)


def excess(fit: Fit, fitter: Fitter) -> float:
    """Return the mean squared residual above the noise's."""
    return max(reduced_chi_square(fit, fitter) - 1.0, 0.0)


def reduced_chi_square_of(fit: Fit, fitter: Fitter, rows: NDArray[np.bool_]) -> float:
    """Return the mean squared residual over some of what was recorded, `rows` (m,), in units of
    the noise's; 1 where there are none."""
    if not rows.any():
        return 1.0
    return _mean_square(fit.residual[rows], fitter.sigma[rows], fitter.spread[rows])


def unseen_rows(fitter: Fitter) -> NDArray[np.bool_]:
    """Return which values (m,) no fit may look at; all where there are none."""
    unseen: NDArray[np.bool_] = ~fitter.fitted
    return unseen if unseen.any() else fitter.fitted


def _mean_square(residual: NDArray[np.float64], sigma: NDArray[np.float64],
                 spread: NDArray[np.float64]) -> float:
    weight = 1.0 / spread ** 2
    return float(np.sum(weight * residual ** 2) / np.sum(weight * sigma ** 2))
