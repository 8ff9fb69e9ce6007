"""Self-energizing gain and pad friction from runs with the disc standing and turning (ch. 5).

P is the even disturbance with the disc turning over that with it standing, at equal motor angle
and so at equal clamp force (43). (44) is printed upside down: torques stand as
P = ((d/r) − μ)/(d/r), so μ = (d/r)·(1 − P).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.identify.even_odd import EvenOdd
from engb_core.identify.load_and_friction import LoadFit
from engb_core.identify.regression import Fit
from engb_core.identify.uncertainty import Estimate
from engb_core.statics import pad_friction

__all__ = ['compare_fits', 'compare_paper_way', 'SelfEnergizing']

Array = NDArray[np.float64]

# The mean slope dy_p/dx_p of the wedge is known to about this part of itself: tolerances of the
# gear, and its change over the stroke that one number can't follow.
WEDGE_TOLERANCE = 0.01


@dataclass(frozen=True)
class SelfEnergizing:
    """P [-] and pad friction μ [-]; μ > 0 where the disc helps, < 0 where it hinders."""

    gain: Estimate
    pad_friction: Estimate


def compare_paper_way(standing: LoadFit, turning: EvenOdd, wedge: float,
                      samples_per_pair: float = 1.0) -> SelfEnergizing:
    """Fit (43): the standing disc's cubic times P to the turning disc's even disturbance.

    Args:
        standing: the load fit with the disc at rest.
        turning: even and odd disturbance with the disc turning.
        wedge: d/r [-].
        samples_per_pair: resampled points that hold one independent value; the intervals widen
            by its square root.
    """
    shape = standing.torque(turning.position)
    gain = float(shape @ -turning.even / (shape @ shape))
    misfit = -turning.even - gain * shape
    variance = float(misfit @ misfit) / max(misfit.size - 1, 1) / float(shape @ shape)
    return _result(gain, float(np.sqrt(variance * samples_per_pair)), wedge,
                   misfit.size / samples_per_pair - 1)


def compare_fits(standing: Fit, turning: Fit, positions: Array, wedge: float) -> SelfEnergizing:
    """Return P from two joint regressions: the load torques' ratio in least squares over
    `positions` (n,) [rad], its uncertainty from both fits' covariances.

    Raises:
        KeyError: a fit without polynomial load.
    """
    one, one_slope = standing.load(positions)
    two, two_slope = turning.load(positions)
    energy = float(one @ one)
    gain = float(one @ two) / energy
    # dP = (f·dg + g·df − 2P·f·df)/f·f
    by_turning = two_slope @ one / energy
    by_standing = one_slope @ (two - 2.0 * gain * one) / energy
    variance = (by_turning @ turning.load_covariance() @ by_turning
                + by_standing @ standing.load_covariance() @ by_standing)
    freedom = min(standing.effective_samples, turning.effective_samples)
    return _result(gain, float(np.sqrt(variance)), wedge, freedom)


def _result(gain: float, deviation: float, wedge: float, freedom: float) -> SelfEnergizing:
    friction, by_gain = pad_friction(gain, wedge, deviation)
    uncertainty = float(np.hypot(by_gain, WEDGE_TOLERANCE * friction))
    return SelfEnergizing(Estimate(gain, deviation, '-', True, max(freedom, 1.0)),
                          Estimate(friction, uncertainty, '-', True, max(freedom, 1.0)))
