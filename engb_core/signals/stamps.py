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
from scipy.ndimage import gaussian_filter1d

from engb_core.recording import Recording
from engb_core.signals.sampling_noise import sampling_noise

__all__ = ['VARY', 'evenly_timed', 'stamps_vary']

Array = NDArray[np.float64]

# Spread of the time between samples, as a part of it, from which on the stamps vary.
VARY = 0.1
# Samples over which jitter is averaged: it becomes a tenth, and clocks that drift apart by a
# thousandth move by a tenth of a sample meanwhile.
AVERAGED = 100
# Samples that are late where some were lost before.
STAYS = 5


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
    by_stamps, evenly = sampling_noise(recording), sampling_noise(even)
    return even if evenly.jitter < by_stamps.jitter else recording


def _even_times(time: Array) -> Array:
    """Return the times (n,) [s] of evenly taken samples that arrived at `time`, some of them lost.
    """
    # A late stamp makes one step long and the next one short, and lost samples one several times
    # as long: rounded to whole steps both are counted right on the whole.
    apart = np.diff(time)
    step = float(np.sum(apart) / np.sum(np.round(apart / np.median(apart))))
    for _ in range(2):
        number = _numbers(time, step)
        step = float(np.polyfit(number, time, 1)[0])
    number = _numbers(time, step)
    drift = time - step * number
    even: Array = step * number + gaussian_filter1d(drift, AVERAGED, mode='nearest')
    return even


def _numbers(time: Array, step: float) -> Array:
    """Return the number (n,) of each sample, the lost ones counted: a phase-locked loop."""
    first = time[:2 * STAYS]
    expected = float(np.median(first - step * np.arange(first.size))) - step
    number = np.empty(time.size)
    count = -1.0
    for place, stamp in enumerate(time.tolist()):
        passed = 1.0
        if stamp - expected > 1.5 * step:
            # A single late stamp is none that was lost: those after it are late as well.
            following = time[place:place + STAYS]
            late = (following - expected) / step - np.arange(following.size)
            passed = max(1.0, float(np.round(np.min(late))))
        count += passed
        expected += passed * step
        expected += (stamp - expected) / AVERAGED
        number[place] = count
    return number
