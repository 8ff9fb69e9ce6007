# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which orders a residual holds: its spectrum over an angle instead of over time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft

__all__ = ['leading_orders']

Array = NDArray[np.float64]

BIN = 0.02          # rad; finer than a tenth of a cycle of the highest order looked for
HIGHEST_ORDER = 48.0
WIDEST = 1e5        # rad; beyond, the angles of a recording are no strokes
LARGEST_SPECTRUM = 4e6
LOWEST_ORDER = 0.4


def leading_orders(angle: Array, residual: Array, weight: Array, count: int = 3) -> list[float]:
    """Return the orders [cycles per revolution] of the strongest lines in a residual.

    Args:
        angle: (n,) rad, the shaft's or the disc's.
        residual: (n,) what is looked at.
        weight: (n,) ≥ 0; for a torque ripple residual·torque and torque² are handed in, so that
            the line's size is relative to torque.
        count: how many to return at most.
    """
    good = weight > 0
    if good.sum() < 50:
        return []
    low = angle[good].min()
    if angle[good].max() - low > WIDEST:
        return []
    place = ((angle[good] - low) / BIN).astype(np.int64)
    total = np.bincount(place, residual[good])
    mass = np.bincount(place, weight[good])
    used = mass > 0.05 * np.median(mass[mass > 0])
    centre = low + (np.flatnonzero(used) + 0.5) * BIN
    # Each angle counts alike, as often as it was passed: slow stretches shall not drown the rest.
    mean = total[used] / mass[used]
    mean = mean - _trend(centre, mean)
    span = np.ptp(centre)
    if span < 1.0:
        return []
    # The angles are even with values missing; those are zero, as they are in the sum.
    finest = min(2.0 * np.pi * span / 0.4 / BIN, LARGEST_SPECTRUM)
    row = np.zeros(next_fast_len(int(max(finest, 2.0 * used.size)), real=True))
    row[np.flatnonzero(used)] = mean
    power = np.abs(rfft(row)) ** 2
    orders = 2.0 * np.pi * np.arange(power.size) / (row.size * BIN)
    heard = (orders >= max(LOWEST_ORDER, 2.0 * np.pi / span)) & (orders < HIGHEST_ORDER)
    power, orders = power[heard], orders[heard]
    peaks = [index for index in range(1, orders.size - 1)
             if power[index] >= power[index - 1] and power[index] >= power[index + 1]]
    peaks.sort(key=lambda index: -power[index])
    return [float(orders[index]) for index in peaks[:count]]


def _trend(angle: Array, values: Array) -> Array:
    scaled = (angle - angle.mean()) / (np.ptp(angle) + 1e-12)
    return np.polynomial.Polynomial.fit(scaled, values, 3)(scaled)
