# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Hum of the mains in a measured effort: a line at 50 or 60 Hz that the shaft does not follow.

A torque of that frequency would shake the shaft. Where the position shows less than half of what
the inertia needs for it, the line is in the measurement (the ground of the current sensor, its
supply), not in the torque. The mains' frequency wanders by some 0.1 %, which over a minute is more
than a period: what is taken out is a line whose amplitude and phase may change within seconds
(synchronous demodulation; Brandt, Noise and Vibration Analysis, 2011, chapter 12).
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft
from scipy.signal import oaconvolve

from engb_core.recording import Recording

__all__ = ['Hum', 'mains_hum']

Array = NDArray[np.float64]

# Frequencies of the world's mains [Hz], and how far they wander [-].
MAINS, WANDERS = (50.0, 60.0), 0.01
# Chance of taking noise for a line: it is asked of every recording of a diagnosis, of both mains.
CHANCE = 1e-4
# Part of a line that the shaft follows at most, if it is no torque: the larger part is none.
FOLLOWED = 0.5
# Multiples of the mains' frequency that are looked for: rectifiers and saturated cores make them.
MULTIPLES = 7
# Half the time [s] over which amplitude and phase of the line are taken: within it the mains
# wander by less than a twentieth of a period.
HALF_WINDOW = 1.0
# Periods of the mains that a recording must hold, or a line is no line.
LEAST_PERIODS = 200.0


@dataclass(frozen=True)
class Hum:
    """Hum of a recording's effort: frequency [Hz], amplitude of its first harmonic [N·m], and
    what of the effort is hum (n,) [N·m]."""

    frequency: float
    amplitude: float
    values: Array


def mains_hum(recording: Recording, inertia: float) -> Hum | None:
    """Return the hum in a recording's effort; None where there is none that can be told from a
    torque.

    Args:
        recording: with its samples at their times.
        inertia: that the shaft has [kg·m²].
    """
    interval = recording.interval
    count = round(float(recording.time[-1] - recording.time[0]) / interval) + 1
    seen = [mains for mains in MAINS if (1.0 + WANDERS) * mains <= 0.5 / interval
            and count * interval * mains >= LEAST_PERIODS]
    if not seen:
        return None
    grid = recording.time[0] + interval * np.arange(count)
    effort, position = (_spectrum(np.interp(grid, recording.time, values))
                        for values in (recording.effort, recording.position))
    resolution = 1.0 / (interval * next_fast_len(count, real=True))
    for mains in seen:
        line = _line(effort, mains / resolution, WANDERS * mains / resolution)
        if line is None:
            continue
        frequency = line * resolution
        shaken = float(np.max(position[line - 1:line + 2]))
        needed = inertia * (2.0 * math.pi * frequency) ** 2 * shaken
        if needed > FOLLOWED * float(effort[line]):
            continue
        values = np.zeros_like(recording.effort)
        for multiple in range(1, MULTIPLES + 1):
            at = _folded(multiple * frequency, 1.0 / interval)
            # Of a multiple the line is known to its multiple of a bin.
            if multiple == 1 or _line(effort, at / resolution, 2.0 * multiple) is not None:
                values += _demodulated(recording, recording.effort - values, at)
        return Hum(frequency, float(effort[line]), values)
    return None


def _spectrum(values: Array) -> Array:
    """Return the amplitudes (m,) of the lines of evenly timed values (n,), through Hann's
    window."""
    window = np.hanning(values.size)
    size = next_fast_len(values.size, real=True)
    amplitudes: Array = np.abs(rfft((values - values.mean()) * window, size))
    return amplitudes * (2.0 / float(window.sum()))


def _folded(frequency: float, rate: float) -> float:
    """Return at which frequency [Hz] a line shows that is sampled at `rate` [Hz]."""
    return abs(frequency - rate * round(frequency / rate))


def _line(amplitudes: Array, place: float, half: float) -> int | None:
    """Return the bin of the largest amplitude within `half` bins of a `place`, if noise as large
    as around it would hardly make that anywhere there."""
    first, last = math.floor(place - half), math.ceil(place + half) + 1
    width = max(100, 4 * (last - first))
    low, high = max(1, first - width), min(amplitudes.size, last + width)
    if first < 1 or last > amplitudes.size or first - low < 20:
        return None
    beside = np.concatenate([amplitudes[low:first], amplitudes[last:high]]) ** 2
    # The periodogram of noise has an exponential distribution, whose median is ln 2 of its mean.
    level = float(np.median(beside)) / math.log(2.0)
    best = first + int(np.argmax(amplitudes[first:last]))
    return best if amplitudes[best] ** 2 > level * math.log((last - first) / CHANCE) else None


def _demodulated(recording: Recording, effort: Array, frequency: float) -> Array:
    """Return what of an effort (n,) lies at a frequency [Hz], amplitude and phase changing slowly.
    """
    turn = np.exp(2j * math.pi * frequency * recording.time)
    half = max(1, round(HALF_WINDOW / recording.interval))
    window = np.hanning(2 * half + 1)
    # What the motion needs is slow, and would leak where the window meets the ends.
    smooth = oaconvolve(np.pad(effort, half, mode='edge'), window / window.sum(), mode='valid')
    slow, weight = (oaconvolve(values, window, mode='same')
                    for values in ((effort - smooth) * np.conj(turn), np.ones_like(effort)))
    found: Array = 2.0 * (slow / weight * turn).real
    return found
