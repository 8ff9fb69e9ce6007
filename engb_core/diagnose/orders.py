# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which orders a residual holds: its spectrum over an angle instead of over time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft

__all__ = ['highest_order', 'leading_orders']

Array = NDArray[np.float64]

# Bins of angle in a cycle of the highest order looked for.
BINS_OF_CYCLE = 6.5
WIDEST = 1e5        # rad; beyond, the angles of a recording are no strokes
LARGEST_SPECTRUM = 4e6
# Part of the travel that is to be slow enough for a wave to be seen.
SLOW_PART = 0.1


def highest_order(position: Array, velocity: Array, bandwidth: float) -> float:
    """Return the highest order [cycles per 2π of position] that a motion lets be seen.

    At the speed below which a tenth of the way is travelled it comes with the highest frequency
    that is heard. A joint behind a gear moves slowly, and has a motor's waves a hundred times as
    often per turn.

    Args:
        position, velocity: (n,) [rad], [rad/s].
        bandwidth: up to which torque is heard [Hz].
    """
    travel = np.abs(np.diff(position))
    speed = np.abs(0.5 * (velocity[1:] + velocity[:-1]))
    order = np.argsort(speed)
    way = np.cumsum(travel[order])
    if way.size == 0 or way[-1] <= 0.0:
        return 0.0
    slow = float(speed[order][np.searchsorted(way, SLOW_PART * way[-1])])
    return 2.0 * np.pi * bandwidth / slow if slow > 0.0 else 0.0


def leading_orders(angle: Array, residual: Array, weight: Array, lowest: float, highest: float,
                   count: int = 3) -> list[float]:
    """Return the orders [cycles per 2π of angle] of the strongest lines in a residual.

    Args:
        angle: (n,) rad, the shaft's or the disc's; [m] of a slider.
        residual: (n,) what is looked at.
        weight: (n,) ≥ 0; for a torque ripple residual·torque and torque² are handed in, so that
            the line's size is relative to torque.
        lowest, highest: orders between which they are looked for; the lowest has one cycle in the
            stroke at least.
        count: how many to return at most.
    """
    good = weight > 0
    if good.sum() < 50:
        return []
    low, widest = angle[good].min(), np.ptp(angle[good])
    if widest > WIDEST or highest <= 0.0 or widest <= 0.0:
        return []
    width = max(2.0 * np.pi / highest / BINS_OF_CYCLE, widest / LARGEST_SPECTRUM)
    place = ((angle[good] - low) / width).astype(np.int64)
    total = np.bincount(place, residual[good])
    mass = np.bincount(place, weight[good])
    used = mass > 0.05 * np.median(mass[mass > 0])
    centre = low + (np.flatnonzero(used) + 0.5) * width
    # Each angle counts alike, as often as it was passed: slow stretches shall not drown the rest.
    mean = total[used] / mass[used]
    mean = mean - _trend(centre, mean)
    span = np.ptp(centre)
    lowest = max(lowest, 2.0 * np.pi / span) if span > 0.0 else np.inf
    if lowest >= highest:
        return []
    # The angles are even with values missing; those are zero, as they are in the sum.
    finest = min(2.0 * np.pi * span / 0.4 / width, LARGEST_SPECTRUM)
    row = np.zeros(next_fast_len(int(max(finest, 2.0 * used.size)), real=True))
    row[np.flatnonzero(used)] = mean
    power = np.abs(rfft(row)) ** 2
    orders = 2.0 * np.pi * np.arange(power.size) / (row.size * width)
    heard = (orders >= lowest) & (orders < highest)
    power, orders = power[heard], orders[heard]
    peaks = [index for index in range(1, orders.size - 1)
             if power[index] >= power[index - 1] and power[index] >= power[index + 1]]
    peaks.sort(key=lambda index: -power[index])
    return [float(orders[index]) for index in peaks[:count]]


def _trend(angle: Array, values: Array) -> Array:
    scaled = (angle - angle.mean()) / (np.ptp(angle) + 1e-12)
    trend: Array = np.polynomial.Polynomial.fit(scaled, values, 3)(scaled)
    return trend
