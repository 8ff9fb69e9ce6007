# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""When samples were taken, of which the stamps say when they were read."""

from __future__ import annotations

from collections import deque

__all__ = ['SampleClock']

# The mean spacing is that of so many samples: of bunches of 16, a USB adapter's at 1 kHz (they
# wait for 16 ms), it is found to a fourteenth. Fewer than the least tell nothing.
_MANY, _LEAST = 200, 20

# Of all that were seen the least counts, which grows by so much with each sample: by a fiftieth in
# _MANY.
_GROWTH = 1e-4

# What is ahead of the stamps, after a bunch, is made up for by this part of each spacing: that
# also covers a mean that is too long by as much, because one in twenty samples was lost.
_MADE_UP = 0.05

# No sample waits for longer than this in an adapter or a queue: where the stamps stay farther
# behind, the samples come faster than they did [s].
_LATEST = 0.05


class SampleClock:
    """Spaces samples evenly that come in bunches, stamped when they were read.

    An adapter, a driver or a busy computer may hand over several samples at once, stamped within
    microseconds: an angle moves between them as far as between any two, and what is divided by
    the difference of such stamps is no velocity. A stamp may be late, never early; so a drive's
    samples were taken no closer to each other than they come in the mean, and where the stamps
    say so they are spaced by that. Where samples are lost their stamps are farther apart, and are
    believed.

    Attributes:
        time: when the last sample was taken [s], from the first one on.
        spacing: least mean spacing of the samples [s]; 0: not known yet.
        pace: the same as it looks so far, of the fewest that tell it [s]; 0: no two have come.
            Samples that are lost, or a pause, make a drive look no slower for long.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self.time = self.spacing = self.pace = 0.0
        self._ahead = 0.0
        self._stamps = deque([0.0], _MANY + 1)

    def step(self, passed: float, *, stamped: bool = True) -> None:
        """Take a sample `passed` [s] after the last one.

        Args:
            passed: by the stamps; where those were set, by the steady clock [s].
            stamped: whether it is by the stamps. What messages waited tells no spacing.
        """
        stamps = self._stamps
        if stamped:
            stamps.append(stamps[-1] + passed)
        count = len(stamps) - 1
        if few := min(count, _LEAST):
            lately = (stamps[-1] - stamps[-1 - few]) / few
            self.pace = min(self.pace, lately) if count > _LEAST else lately
        if count >= _LEAST:
            mean = (stamps[-1] - stamps[0]) / count
            grown = self.spacing * (1.0 + _GROWTH)
            self.spacing = mean if count < _MANY else min(mean, grown)
        even = max(passed - self._ahead, (1.0 - _MADE_UP) * self.spacing)
        self.time += even
        self._ahead += even - passed
        if self._ahead > _LATEST:
            for _ in range(count - _LEAST):
                stamps.popleft()
            self._ahead = 0.0
            if count >= _LEAST:
                self.spacing = (stamps[-1] - stamps[0]) / _LEAST
