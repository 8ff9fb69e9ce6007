# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Samples that share a stamp, or nearly: told twice, within one digit, or out of a queue.

A recorder that writes a sample twice writes all of it twice. Where samples of one stamp differ,
each was taken: the time was written with too few digits (0.01 s at 1 kHz), or several came out of
a queue at once. No sample is taken after it was stamped, so that those of one stamp are spread
evenly over the time before it; rounding moves all of them alike, which is no error.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ['GAP_STEPS', 'come_in_bursts', 'one_stamp_each', 'usual_interval']

Array = NDArray[np.float64]

# So many samples take several bursts of a queue; where more than this part of them come closer
# together than half of what they take on the whole, they come in bursts.
BURSTS, CLOSE = 50, 0.25
# From so many usual intervals on a pause between samples is a gap.
GAP_STEPS = 4.5


def usual_interval(time: Array) -> float:
    """Return the usual time [s] between samples that were stamped at `time` (n,), which increases:
    the median; what samples take over several bursts where they come in bursts."""
    return _on_the_whole(time) if come_in_bursts(time) else float(np.median(np.diff(time)))


def come_in_bursts(time: Array) -> bool:
    """Return whether samples left a queue several at once: an adapter that is polled, a host that
    was busy."""
    return time.size > 2 * BURSTS and float(np.quantile(np.diff(time), CLOSE)) \
        < 0.5 * _on_the_whole(time)


def _on_the_whole(time: Array) -> float:
    return float(np.median(time[BURSTS:] - time[:-BURSTS])) / BURSTS


def one_stamp_each(stamp: Array, columns: Sequence[Array],
                   ) -> tuple[NDArray[np.intp], Array, tuple[str, ...]]:
    """Return which samples (k,) are kept, their stamps (k,) [s], which increase strictly, and what
    was repaired, a sentence each.

    Args:
        stamp: (n,) [s], finite, in order.
        columns: (n,) each, what was taken at them, the position first.
    """
    notes: list[str] = []
    again = np.append(False, np.diff(stamp) <= 0.0)
    kept = np.arange(stamp.size)
    if not again.any():
        return kept, stamp, ()
    doubled = _doubled(stamp, columns, again)
    if doubled.any():
        notes.append(f'{np.count_nonzero(doubled)} samples with a stamp seen before left out')
        kept = kept[~doubled]
    spread = _spread(stamp[kept])
    moved = np.count_nonzero(again & ~doubled)
    if moved:
        notes.append(f'{moved} samples share the stamp of another one: they are taken as evenly '
                     'spaced; write the time with more digits, or stamp samples where they are '
                     'taken')
    return kept, spread, tuple(notes)


def _doubled(stamp: Array, columns: Sequence[Array], again: NDArray[np.bool_],
             ) -> NDArray[np.bool_]:
    """Return which samples (n,) repeat the one before: those that are like it, if that is what
    most of one stamp are. A shaft that stands is alike from sample to sample whatever is
    recorded: only one that moves tells."""
    alike = again.copy()
    for column in columns:
        alike[1:] &= (column[1:] == column[:-1]) | (np.isnan(column[1:]) & np.isnan(column[:-1]))
    group = np.cumsum(~again) - 1
    first = np.flatnonzero(~again)
    position = columns[0]
    moves = (np.diff(position[first], append=position[-1]) != 0.0)[group]
    asked = again & moves if (again & moves).any() else again
    return alike if np.mean(alike[asked]) > 0.5 else np.zeros(stamp.size, bool)


def _spread(stamp: Array) -> Array:
    """Return the stamps (n,) [s] with those that are alike spread over the time before them, no
    farther apart than samples usually are."""
    first = np.flatnonzero(np.append(True, np.diff(stamp) > 0.0))
    if first.size < 2:
        return stamp
    count = np.diff(np.append(first, stamp.size))
    step = np.diff(stamp[first]) / count[1:]
    usual = float(np.median(step))
    # Of the first ones nothing is known but that.
    step = np.minimum(np.append(usual, step), usual)
    behind = np.repeat(first + count, count) - 1 - np.arange(stamp.size)
    return stamp - np.where(np.repeat(count, count) > 1, behind * np.repeat(step, count), 0.0)
