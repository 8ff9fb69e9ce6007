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
# Fewer samples than this hold no line.
LEAST_SAMPLES = 50
# Part of the samples from which on an order counts as shown by all.
NEARLY_ALL = 0.9
# Lines of an octave that are compared with those of the others.
MOST_LINES = 5
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


def leading_orders(angle: Array, residual: Array, weight: Array, reach: Array, lowest: float,
                   highest: float, count: int = 3) -> list[float]:
    """Return the orders [cycles per 2π of angle] of the strongest lines in a residual.

    An order is looked for where the shaft is slow enough to show it: in faster samples it is not
    heard, but others are that the sampling folds onto it. So the orders are taken an octave at a
    time, each from the samples that reach its upper end.

    Args:
        angle: (n,) rad, the shaft's or the disc's; [m] of a slider.
        residual: (n,) what is looked at.
        weight: (n,) ≥ 0; for a torque ripple residual·torque and torque² are handed in, so that
            the line's size is relative to torque.
        reach: (n,) the highest order that passes each sample within the band.
        lowest, highest: orders between which they are looked for; the lowest has one cycle in the
            stroke at least.
        count: how many to return at most.
    """
    good = weight > 0
    if good.sum() < LEAST_SAMPLES or highest <= 0.0:
        return []
    # What nearly all of the motion shows is looked for in all of it.
    upper = min(max(float(np.quantile(reach[good], 1.0 - NEARLY_ALL)), lowest), highest)
    found: list[tuple[float, float]] = []
    shown = good
    while True:
        found += _lines(angle[shown], residual[shown], weight[shown], lowest, upper)
        if upper >= highest:
            break
        lowest, upper = upper, min(2.0 * upper, highest)
        shown = good & (reach >= upper)
        if shown.sum() < LEAST_SAMPLES:
            break
    found.sort(key=lambda line: -line[1])
    return [order for order, _ in found[:count]]


def _lines(angle: Array, residual: Array, weight: Array, lowest: float, highest: float,
           ) -> list[tuple[float, float]]:
    """Return the lines between two orders, (order, what of the sum of squares over the angle it
    takes away), the strongest first."""
    low, widest = angle.min(), np.ptp(angle)
    if widest > WIDEST or widest <= 0.0:
        return []
    width = max(2.0 * np.pi / highest / BINS_OF_CYCLE, widest / LARGEST_SPECTRUM)
    place = ((angle - low) / width).astype(np.int64)
    total = np.bincount(place, residual)
    mass = np.bincount(place, weight)
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
    # Of bins of the same width each holds as much of the way: what the wave takes away of it.
    power, orders = power[heard] * width / mean.size, orders[heard]
    peaks = [index for index in range(1, orders.size - 1)
             if power[index] >= power[index - 1] and power[index] >= power[index + 1]]
    peaks.sort(key=lambda index: -power[index])
    return [(float(orders[index]), float(power[index])) for index in peaks[:MOST_LINES]]


def _trend(angle: Array, values: Array) -> Array:
    scaled = (angle - angle.mean()) / (np.ptp(angle) + 1e-12)
    trend: Array = np.polynomial.Polynomial.fit(scaled, values, 3)(scaled)
    return trend
