# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What turns with the shaft above the comparison's band: order analysis of a recorded motion.

A torque that repeats with the shaft's angle passes at a frequency that goes with the speed: over
time it is smeared, over the angle it is a line (order tracking; Brandt, Noise and Vibration
Analysis, 2011, chapter 12). Two things follow. Such a line is physics that a band below it does
not hold; and between the lines lies the noise of the effort, also where the shaft never stands
and its waves fill the frequencies in which noise is looked for else.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft
from scipy.ndimage import median_filter

from engb_core.signals.gaussian import gaussian_kernel
from engb_core.signals.motion import Motion

__all__ = ['OrderPeriodogram', 'line_amplitude', 'order_periodogram']

Array = NDArray[np.float64]

# Bins of angle in a cycle of the highest order: what the bins take off it is 5 % of the power.
BINS_OF_CYCLE = 8
LARGEST_SPECTRUM = 2 ** 20
# Frequencies at which the filters' response is tabled.
FREQUENCIES = 300
# An order that passes within the band for a tenth of the motion that the best one does is told.
LEAST_PASSING = 0.1
# Orders from which a median is known to a quarter, 1/(ln 2·sqrt(n)).
LEAST_ORDERS = 33
# Neighbouring orders from which the level beside a line is taken.
BESIDE = 101


@dataclass(frozen=True)
class OrderPeriodogram:
    """Power over the order.

    Attributes:
        orders: (k,) cycles per 2π of the position, rising.
        power: (k,) variance [effort²] of the white noise in the recorded samples that would hold
            as much at an order, on average.
        passes: (k,) how much of the motion passes the order within the band (samples).
    """

    orders: Array
    power: Array
    passes: Array

    def noise(self) -> float | None:
        """Return the standard deviation of the white part of the recorded effort's noise, from
        the median over the orders; None where there are too few of them.

        The periodogram of noise has an exponential distribution, whose median is ln 2 of its mean;
        lines are few among the orders.
        """
        if self.orders.size < LEAST_ORDERS:
            return None
        return float(np.sqrt(np.median(self.power) / np.log(2.0)))

    def strongest_line(self, level: float) -> float | None:
        """Return the order that holds the most power of those that stand out, None if none does.

        Args:
            level: probability that noise alone has such a line at any of the orders.
        """
        if self.orders.size < LEAST_ORDERS:
            return None
        beside = median_filter(self.power, min(BESIDE, self.orders.size)) / np.log(2.0)
        stands_out = self.power > beside * np.log(self.orders.size / level)
        if not stands_out.any():
            return None
        held = np.where(stands_out, self.power * self.passes, 0.0)
        return float(self.orders[np.argmax(held)])


def order_periodogram(motion: Motion, moving: NDArray[np.bool_], corner: float, above: Array,
                      ) -> OrderPeriodogram:
    """Return the power over the order of what a signal holds above a corner.

    Args:
        motion: the run.
        moving: (n,) where the shaft moves and the signal is known.
        corner: of the Gaussian low-pass that was taken off [Hz].
        above: (n,) what that left of effort on the motion's grid, smoothed as that is [N·m].
    """
    below = gaussian_kernel(corner, motion.step)
    speed, angle = np.abs(motion.velocity[moving]), motion.position[moving]
    usual = float(np.median(speed)) if speed.size else 0.0
    none = np.zeros(0)
    if usual <= 0.0 or np.ptp(angle) <= 0.0:
        return OrderPeriodogram(none, none, none)
    # A taper over time keeps a strong line from hiding what lies beside it.
    taper = np.hanning(motion.time.size + 2)[1:-1][moving]
    values = taper * above[moving]
    lowest = 2.0 * np.pi * corner / float(np.quantile(speed, 0.9))
    highest = 2.0 * np.pi * motion.bandwidth / usual
    width = 2.0 * np.pi / highest / BINS_OF_CYCLE
    span = next_fast_len(int(min(2.0 * np.ptp(angle) / width + 2.0, LARGEST_SPECTRUM)), real=True)
    # A sum over angles that differ by the whole span is the same at each of its orders.
    bins = np.floor((angle - angle.min()) / width).astype(np.int64) % span
    power = np.abs(rfft(np.bincount(bins, values, span))) ** 2
    orders = 2.0 * np.pi * np.arange(power.size) / (span * width)
    kept = (orders > lowest) & (orders < highest)
    passes = _passes(motion, below, speed, taper, orders[kept])
    power, orders = power[kept], orders[kept]
    told = passes > LEAST_PASSING * passes.max(initial=0.0)
    # A white noise of 1 in the samples as recorded has this density on the motion's grid.
    density = motion.recorded_step / motion.step
    return OrderPeriodogram(orders[told], power[told] / (density * passes[told]), passes[told])


def _passes(motion: Motion, below: Array, speed: Array, taper: Array, orders: Array) -> Array:
    """Return what the filters leave of white noise at each order (k,), summed over the samples."""
    frequencies = np.linspace(0.0, 0.5 / motion.step, FREQUENCIES)
    first = gaussian_kernel(motion.bandwidth, motion.recorded_step)
    left = (_response(first, motion.recorded_step, frequencies)
            * (1.0 - _response(below, motion.step, frequencies))) ** 2
    edges = np.linspace(0.0, float(speed.max()), FREQUENCIES + 1)
    mass, _ = np.histogram(speed, edges, weights=taper ** 2)
    middle = 0.5 * (edges[1:] + edges[:-1])
    found = np.zeros(orders.size)
    for weight, passing in zip(mass, middle, strict=True):
        if weight > 0.0:
            found += weight * np.interp(orders * passing / (2.0 * np.pi), frequencies, left,
                                        right=0.0)
    return found


def _response(taps: Array, step: float, frequencies: Array) -> Array:
    """Return the frequency response of symmetric taps."""
    lag = (np.arange(taps.size) - taps.size // 2) * step
    return np.cos(2.0 * np.pi * np.outer(frequencies, lag)) @ taps


def line_amplitude(motion: Motion, moving: NDArray[np.bool_], corner: float, above: Array,
                   order: float) -> tuple[float, float]:
    """Return the amplitude [N·m] of a line over the angle in what a signal holds above a corner,
    and the mean square of its angular frequency's square [(rad/s)⁴], both where it passes within
    the band.

    Args:
        motion, moving, corner, above: as for `order_periodogram`.
        order: of the line, cycles per 2π.
    """
    passing = order * np.abs(motion.velocity)
    within = moving & (passing > 2.0 * np.pi * corner) & (
        passing < 2.0 * np.pi * motion.bandwidth)
    if not within.any():
        return 0.0, 0.0
    wave = np.exp(-1j * order * motion.position[within])
    return (2.0 * float(np.abs(np.mean(above[within] * wave))),
            float(np.mean(passing[within] ** 4)))
