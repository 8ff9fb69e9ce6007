# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Estimates with confidence intervals, and the covariance of a fit whose residual is coloured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

__all__ = ['Estimate', 'coloured_covariance']

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """A number, its standard deviation and unit.

    `determined` is False where the recording could not tell: the start model's number was kept,
    and `std` is what the recording alone would have given; or, where `remark` says so, the
    number is the recording's own and known less well than it has to be.
    """

    value: float
    std: float
    unit: str
    determined: bool = True
    degrees_of_freedom: float = np.inf
    remark: str = ''

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return the two-sided confidence interval (Student's t)."""
        reach = stats.t.ppf(0.5 + 0.5 * confidence, self.degrees_of_freedom) * self.std
        return self.value - reach, self.value + reach


def coloured_covariance(jacobian: Array, residual: Array, place: NDArray[Any],
                        least: Array | None = None) -> tuple[Array, float]:
    """Return the covariance (p, p) of a least-squares fit and its degrees of freedom.

    The residual is taken as stationary, with the autocorrelation it shows itself: the sandwich
    (JᵀJ)⁻¹ JᵀΓJ (JᵀJ)⁻¹ with Γ Toeplitz, cut where the autocorrelation has died down.

    Args:
        jacobian: (m, p) derivative of the model's output by its parameters.
        residual: (m,).
        place: (m,) whole numbers, the rows' places in time, in rising order; rows whose places
            differ by k are k sampling intervals apart. Leave room between separate pieces.
        least: (l,) autocorrelation at lags 0… that even white measurement noise would have (the
            smoothing's own); the fit has taken some of it out of the residual again.
    """
    count, width = jacobian.shape
    place = np.asarray(place, int) - int(place[0])
    inverse = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    correlation = _correlation(residual, place, least)

    table = np.zeros((int(place[-1]) + 1, width))
    table[place] = jacobian
    middle = correlation[0] * table.T @ table
    for lag in range(1, correlation.size):
        cross = table[lag:].T @ table[:-lag]
        middle += correlation[lag] * (cross + cross.T)
    # What the fit took of the variance: E|r|² = σ²·(m − tr(H·R)), H the hat matrix.
    taken = float(np.trace(inverse @ middle))
    inflation = max(1.0, float(1.0 + 2.0 * correlation[1:].sum()))
    variance = float(residual @ residual) / max(count - taken, 0.1 * count)
    return variance * inverse @ middle @ inverse, max(count / inflation - width, 1.0)


def _correlation(residual: Array, place: Array, least: Array | None) -> Array:
    """Return the autocorrelation at lags 0…k, faded out beyond where it is lost in scatter."""
    size, count = int(place[-1]) + 1, residual.size
    spread, seen = np.zeros(size), np.zeros(size)
    spread[place], seen[place] = residual, 1.0
    longest = max(2, min(count // 4, 400))
    covariance = _lagged(spread, longest) / np.maximum(_lagged(seen, longest), 1.0)
    ratio = covariance / max(covariance[0], 1e-300)
    # First lag from which the correlation is lost in its own scatter, twice in a row.
    quiet = np.abs(ratio) < 2.0 / np.sqrt(count)
    lag = next((k for k in range(1, longest) if quiet[k] and quiet[k + 1]), longest)
    reach = min(2 * lag + 2, longest)
    place_in_window = np.arange(reach + 1) / (reach + 1)
    # Parzen's window: Γ stays positive.
    window = np.where(place_in_window <= 0.5, 1 - 6 * place_in_window**2 + 6 * place_in_window**3,
                      2 * (1 - place_in_window) ** 3)
    found: Array = ratio[:reach + 1] * window
    if least is not None:
        floor = np.zeros(max(found.size, least.size))
        floor[:least.size] = least
        found = np.maximum(np.pad(found, (0, floor.size - found.size)), floor)
    return found


def _lagged(values: Array, longest: int) -> Array:
    """Return Σ x_t·x_{t+k} for k = 0…longest, (longest + 1,)."""
    size = 1 << int(np.ceil(np.log2(values.size + longest + 1)))
    spectrum = np.abs(np.fft.rfft(values, size))**2
    return np.fft.irfft(spectrum, size)[:longest + 1]
