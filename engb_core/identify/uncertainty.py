"""Estimates with confidence intervals, and the covariance of a fit whose residual is coloured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

__all__ = ['Estimate', 'coloured_covariance']

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """A number, its standard deviation and unit.

    `determined` is False where the recording could not tell and the start model's number was
    kept; `std` then is what the recording alone would have given.
    """

    value: float
    std: float
    unit: str
    determined: bool = True
    degrees_of_freedom: float = np.inf

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return the two-sided confidence interval (Student's t)."""
        reach = stats.t.ppf(0.5 + 0.5 * confidence, self.degrees_of_freedom) * self.std
        return self.value - reach, self.value + reach


def coloured_covariance(jacobian: Array, residual: Array, place: Array) -> tuple[Array, float]:
    """Return the covariance (p, p) of a least-squares fit and its degrees of freedom.

    The residual is taken as stationary, with the autocovariance it shows itself: the sandwich
    (JᵀJ)⁻¹ JᵀΓJ (JᵀJ)⁻¹ with Γ Toeplitz, cut where the autocorrelation has died down (Parzen's
    window, so that Γ stays positive).

    Args:
        jacobian: (m, p) derivative of the model's output by its parameters.
        residual: (m,).
        place: (m,) whole numbers, the rows' places in time, in rising order; rows whose places
            differ by k are k sampling intervals apart. Leave room between separate pieces.
    """
    count, width = jacobian.shape
    place = np.asarray(place, int) - int(place[0])
    inverse = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    freedom = max(count - width, 1)

    size = int(place[-1]) + 1
    spread = np.zeros(size)
    spread[place] = residual
    seen = np.zeros(size)
    seen[place] = 1.0
    longest = max(1, min(count // 4, 400))
    autocovariance = _lagged(spread, longest) / np.maximum(_lagged(seen, longest), 1.0)
    variance = max(autocovariance[0], 1e-300)

    # First lag from which the correlation is lost in its own scatter, twice in a row.
    quiet = np.abs(autocovariance / variance) < 2.0 / np.sqrt(count)
    lag = next((k for k in range(1, longest) if quiet[k] and quiet[k + 1]), longest)
    reach = min(2 * lag + 2, longest)
    ratio = np.arange(reach + 1) / (reach + 1)
    window = np.where(ratio <= 0.5, 1 - 6 * ratio**2 + 6 * ratio**3, 2 * (1 - ratio) ** 3)
    # Fitting p numbers took p/m of the variance away; correlation makes the loss larger.
    gamma = autocovariance[:reach + 1] * window * count / freedom

    table = np.zeros((size, width))
    table[place] = jacobian
    middle = gamma[0] * table.T @ table
    for k in range(1, reach + 1):
        cross = table[k:].T @ table[:-k]
        middle += gamma[k] * (cross + cross.T)
    inflation = max(1.0, 1.0 + 2.0 * float(np.sum(gamma[1:]) / gamma[0]))
    return inverse @ middle @ inverse, max(freedom / inflation, 1.0)


def _lagged(values: Array, longest: int) -> Array:
    """Return Σ x_t·x_{t+k} for k = 0…longest, (longest + 1,)."""
    size = 1 << int(np.ceil(np.log2(values.size + longest + 1)))
    spectrum = np.abs(np.fft.rfft(values, size))**2
    return np.fft.irfft(spectrum, size)[:longest + 1]
