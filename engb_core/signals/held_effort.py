# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Effort that is polled more slowly than the position and held in between.

Drives send their current on a slow cycle beside a position on a fast one, and the log repeats the
last value. A held value is no measurement of the instant at which it stands: friction that turns
within it would seem to turn late. Only where a value was just taken is it held against a model;
in between effort is drawn without jumps, for what needs a signal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from engb_core.recording import Recording, Signal
from engb_core.signals.count_edges import quantum_of

__all__ = ['EFFORT_TAKEN', 'between_polls', 'effort_as_taken', 'effort_taken',
           'time_between_polls']

# The side signal whose times are those at which effort was taken.
EFFORT_TAKEN = 'effort_taken'
# From so many changes on it can be told that they come at even times.
LEAST_CHANGES = 20
# Part of the changes that may follow each other at once: a repaired stamp, a queue.
AT_ONCE = 0.01
# Part of the time between two polls for which, on both sides, a value is drawn as it was taken: a
# low-pass leaves it as it is.
DRAWN = 0.25
# A poll comes every so many samples, or one more or less where it runs on a clock of its own.
BESIDE = 1


def effort_taken(recording: Recording) -> NDArray[np.int64] | None:
    """Return the samples (k,) at which effort was taken; None where each sample is one.

    A value that stands because nothing changes, or because its counts are coarse, leaves for the
    next count whenever it does so; what is polled leaves at even times, by several counts.
    """
    effort = recording.effort
    change = np.diff(effort)
    places = np.flatnonzero(change != 0.0) + 1
    if places.size < LEAST_CHANGES:
        return None
    apart = np.diff(places)
    usual = int(np.median(apart))
    even = np.mean(np.abs(apart - usual) <= BESIDE)
    counts = np.abs(change[places - 1]) / max(quantum_of(effort), 1e-300)
    if (usual < 2 or np.mean(apart == 1) > AT_ONCE or even < 0.5 or np.median(counts) < 1.5
            or np.mean(np.diff(recording.position)[places[0]:places[-1]] != 0.0) < 2.0 / usual):
        return None
    return places


def effort_as_taken(recording: Recording) -> Recording:
    """Return the recording with straight lines between the efforts that were taken, and a side
    signal of when that was; the recording itself where every sample was taken."""
    places = effort_taken(recording)
    if places is None:
        return recording
    when, values = recording.time[places], recording.effort[places]
    beside = DRAWN * float(np.median(np.diff(when)))
    corners = np.stack([when - beside, when + beside], axis=1).ravel()
    drawn = np.interp(recording.time, np.maximum.accumulate(corners), np.repeat(values, 2))
    return replace(recording, effort=drawn,
                   signals={**recording.signals, EFFORT_TAKEN: Signal(when, values)})


def time_between_polls(recording: Recording) -> float:
    """Return how long [s] a value usually stands in a recording with effort as it was taken."""
    return float(np.median(np.diff(recording.signals[EFFORT_TAKEN].time)))


def between_polls(recordings: Sequence[Recording]) -> list[str]:
    """Return what recordings with effort as it was taken cannot tell because it was polled, in a
    sentence each."""
    return [f'what happens between two values of effort: in {recording.name} it is taken every '
            f'{time_between_polls(recording) * 1e3:.3g} ms only and stands in between'
            for recording in recordings if EFFORT_TAKEN in recording.signals]
