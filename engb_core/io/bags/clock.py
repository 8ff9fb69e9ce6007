# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Two clocks in one bag: the sender's stamps and the recorder's log times.

JointState carries the time of sampling; Float64 carries none, so only the time at which the
recorder got it is known. The two clocks may differ (another machine, simulated time), and each
message is some 0.1 ms to 3 ms under way. `ClockMap` takes log times to the stamps' clock.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ['ClockMap', 'usable_stamps', 'wild']

Times = NDArray[np.int64]

_SECOND = 1_000_000_000
_WILD = 10 * _SECOND        # a stamp this far from its neighbours is damaged
_STRAIGHT = 2_000_000       # [ns] offsets that wander less than this are taken as constant
_BLOCKS = 64
_WINDOW = 11


@dataclass(frozen=True)
class ClockMap:
    """Piecewise linear: log time `log` (k,) [ns] ↔ stamp minus log time `offset` (k,) [ns]."""

    log: Times
    offset: NDArray[np.float64]

    @classmethod
    def fit(cls, stamp: Times, log_time: Times) -> ClockMap:
        """Find the offset between the clocks from messages that carry both times, (n,) [ns].

        The median over blocks: the delays under way scatter to one side only, and single late
        messages must not count.
        """
        difference = (stamp - log_time).astype(float)
        blocks = np.array_split(np.arange(stamp.size), min(_BLOCKS, max(1, stamp.size // 20)))
        log = np.array([np.median(log_time[block]) for block in blocks]).astype(np.int64)
        offset = np.array([np.median(difference[block]) for block in blocks])
        order = np.argsort(log, kind='stable')
        log, offset = log[order], offset[order]
        if np.ptp(offset) < _STRAIGHT or np.ptp(log) == 0:
            return cls(log[:1], np.array([np.median(difference)]))
        return cls(log, offset)

    def stamps(self, log_time: Times) -> Times:
        """Return when messages logged at `log_time` (k,) [ns] were sampled, by the stamps' clock.

        Beyond both ends the last blocks' slope goes on.
        """
        if self.log.size == 1:
            return log_time + np.int64(self.offset[0])
        base = self.log[0]
        x, knots = (log_time - base).astype(float), (self.log - base).astype(float)
        result = np.interp(x, knots, self.offset)
        for end, inner, beyond in ((0, 1, x < knots[0]), (-1, -2, x > knots[-1])):
            width = knots[end] - knots[inner]
            if width and beyond.any():
                slope = (self.offset[end] - self.offset[inner]) / width
                result[beyond] = self.offset[end] + slope * (x[beyond] - knots[end])
        joined: NDArray[np.int64] = log_time + result.astype(np.int64)
        return joined


def usable_stamps(stamp: Times) -> bool:
    """Return whether stamps (n,) tell samples apart: a driver may leave them zero."""
    # Each sample may be there twice or thrice; less than a quarter of them new is no clock.
    return stamp.size < 2 or int(np.count_nonzero(np.diff(stamp))) > stamp.size / 4


def wild(times: Times) -> NDArray[np.bool_]:
    """Return which of `times` (n,) [ns] lie far from their neighbours in the file, (n,).

    A pause is no such thing: behind it the neighbours agree.
    """
    if times.size < _WINDOW or np.abs(np.diff(times)).max() < _WILD:
        return np.zeros(times.size, bool)
    from scipy.ndimage import median_filter
    relative = (times - times[times.size // 2]).astype(float)
    usual = median_filter(relative, _WINDOW, mode='nearest')
    found: NDArray[np.bool_] = np.abs(relative - usual) > _WILD
    return found
