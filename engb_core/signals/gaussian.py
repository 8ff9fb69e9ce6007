# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Smoothing by a Gaussian without lag, and its derivatives."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

__all__ = ['filtered', 'gaussian_kernel', 'moving_on']

Array = NDArray[np.float64]


@lru_cache(maxsize=64)
def gaussian_kernel(bandwidth: float, step: float, derivative: int = 0) -> Array:
    """Return the taps of a Gaussian low-pass (−3 dB at `bandwidth` [Hz]) or of its derivative."""
    width = np.sqrt(np.log(2.0)) / (2.0 * np.pi * bandwidth)
    reach = max(1, int(np.ceil(4.0 * width / step)))
    lag = np.arange(-reach, reach + 1) * step
    taps: Array = np.exp(-0.5 * (lag / width) ** 2)
    taps /= taps.sum()
    if derivative == 1:
        taps = -lag / width ** 2 * taps
        taps /= -(taps * lag).sum()
    elif derivative != 0:
        taps = (lag ** 2 / width ** 4 - 1.0 / width ** 2) * taps
        taps -= taps.mean()
        taps /= 0.5 * (taps * lag ** 2).sum()
    return taps


def filtered(values: Array, taps: Array) -> Array:
    """Return `values` (n,) passed through symmetric taps without lag, held beyond both ends."""
    passed: Array = convolve1d(values, taps, mode='nearest')
    return passed


def moving_on(values: Array, taps: Array) -> Array:
    """Return `values` (n,) passed through symmetric taps without lag, continued beyond both ends
    at the speed that they have there: a recording may begin or end in the midst of a motion, and a
    shaft that seemed to stop dead would need a torque that nobody measured."""
    reach = taps.size // 2
    if values.size <= reach + 1:
        return filtered(values, taps)
    return np.convolve(np.pad(values, reach, mode='reflect', reflect_type='odd'), taps, 'valid')
