# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Stamps that jitter about samples that were taken evenly: a queue between the drive and the log.

A bus or a host often stamps a sample when it arrives. Then the samples are even and the stamps
are not, and a velocity by the stamps is off by the speed times their jitter. Whether the samples
or the stamps are even is told by the positions, which lie on a smoother motion over the true
times.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, minimum_filter1d

from engb_core.recording import Recording
from engb_core.repeated_stamps import come_in_bursts, usual_interval
from engb_core.signals.sampling_noise import sampling_noise

__all__ = ['VARY', 'evenly_timed', 'stamps_vary']

Array = NDArray[np.float64]

# Spread of the time between samples, as a part of it, from which on the stamps vary.
VARY = 0.1
# Samples over which jitter is averaged: it becomes a tenth, and clocks that drift apart by a
# thousandth move by a tenth of a sample meanwhile.
AVERAGED = 100
# Samples that are late where some were lost before, and as many times the longest burst.
STAYS, OF_LONGEST = 5, 4


def stamps_vary(recording: Recording) -> float:
    """Return the spread of the time between samples [s]; 0 where the stamps are even."""
    step = np.diff(recording.time)
    usual = step[step < 1.9 * recording.interval]
    spread = float(np.std(usual)) if usual.size else 0.0
    return spread if spread >= VARY * recording.interval else 0.0


def evenly_timed(recording: Recording) -> Recording:
    """Return the recording with even times where its positions are smoother over these than over
    the stamps; else as it is."""
    if stamps_vary(recording) == 0.0:
        return recording
    even = replace(recording, time=_even_times(recording.time))
    if come_in_bursts(recording.time):
        return even if _moves_alike(recording) else recording
    by_stamps, evenly = sampling_noise(recording), sampling_noise(even)
    return even if evenly.jitter < by_stamps.jitter else recording


def _moves_alike(recording: Recording) -> bool:
    """Return whether the shaft moves about as far between two stamps of a burst as between two
    bursts: then the samples were taken evenly. By its stamps it would move by their distance."""
    apart, moved = np.diff(recording.time), np.abs(np.diff(recording.position))
    close = apart < 0.5 * recording.interval
    by_stamps = np.mean(apart[close]) / np.mean(apart[~close])
    return bool(np.mean(moved[close]) > np.sqrt(by_stamps) * np.mean(moved[~close]))


def _even_times(time: Array) -> Array:
    """Return the times (n,) [s] of evenly taken samples that arrived at `time`, some of them lost.
    """
    step = _usual_step(time)
    for _ in range(2):
        number = _numbers(time, step)
        step = float(np.polyfit(number, time, 1)[0])
    number = _numbers(time, step)
    # No sample arrives before it is taken.
    drift = minimum_filter1d(time - step * number, 2 * _some_bursts(time, step) + 1,
                             mode='nearest')
    even: Array = step * number + gaussian_filter1d(drift, AVERAGED, mode='nearest')
    return even


def _usual_step(time: Array) -> float:
    """Return the time between samples [s] about which that of the stamps varies."""
    usual = usual_interval(time)
    if come_in_bursts(time):
        return usual
    # A late stamp makes one step long and the next one short, and lost samples one several times
    # as long: rounded to whole steps both are counted right on the whole.
    apart = np.diff(time)
    return float(np.sum(apart) / np.sum(np.round(apart / usual)))


def _some_bursts(time: Array, step: float) -> int:
    """Return how many samples hold several bursts, of which the one or other came in time."""
    close = np.diff(time) < 0.5 * step
    ends = np.flatnonzero(np.diff(np.concatenate([[False], close, [False]]).astype(int)))
    runs = ends[1::2] - ends[::2]
    return max(STAYS, OF_LONGEST * (1 + int(runs.max()))) if runs.size else STAYS


def _least_ahead(values: Array, count: int) -> Array:
    """Return the least of `count` values from each one on (n,)."""
    # A window whose origin is moved to its first sample looks ahead; it has a middle if it is odd.
    half = count // 2
    ahead: Array = minimum_filter1d(values, 2 * half + 1, origin=-half, mode='nearest')
    return ahead


def _numbers(time: Array, step: float) -> Array:
    """Return the number (n,) of each sample, the lost ones counted: a phase-locked loop."""
    count = _some_bursts(time, step)
    place = np.arange(time.size)
    # A late stamp is none of a sample after lost ones unless those that follow are late as well.
    arrived = _least_ahead(time - step * place, count) + step * place
    number = np.empty(time.size)
    expected, told = float(arrived[0]), 0.0
    for index, stamp in enumerate(arrived.tolist()):
        late = stamp - expected
        passed = max(0.0, float(np.round(late / step)))
        told += passed
        number[index] = told
        late -= passed * step
        expected += (passed + 1.0) * step + late / AVERAGED
        told += 1.0
    return number
