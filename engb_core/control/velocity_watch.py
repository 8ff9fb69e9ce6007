# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whether the velocity that a drive tells is that of its angles."""

from __future__ import annotations

import math

from engb_core.bench.sensors import VelocityFromPosition
from engb_core.control.loop import VELOCITY_CUTOFF

__all__ = ['VelocityWatch']

# What the told velocity is off by is averaged over this [s]: a few filters of 100 Hz, which is
# where drives differ while a motor speeds up, and less than a reversed velocity takes to run away
# (D·ω/J is 88/s at the default gain).
_MEAN = 0.02

# A single sample stands for no more than this part of the mean, and counts for no more than so
# many tolerances: it takes three in a row, and an angle that is off in one makes two.
_PART, _MOST = 0.2, 2.0


class VelocityWatch:
    """Compares the told velocity with the one derived from the angles, and chooses one.

    A velocity of the wrong sign turns the loop's damping into its opposite; one of another unit,
    or one that stands, makes it too much or none. The derived one is used instead as long as the
    mean difference is beyond `tolerance`.

    A single sample may be wrong by more than a mean tells: one told velocity of 399 rad/s is a
    control cycle of full torque through the loop's damping. So what is used changes from one
    sample to the next by no more than the motor's largest `acceleration` allows. A told velocity
    beyond that is replaced by that of the angles, unless they say the same; and beyond that only
    the second sample in a row is believed, as when the motor runs against its end stop.

    What the angles' own velocity may be off by is no fault of the told one: a count of the encoder
    between two samples (the least change of the angle that was ever seen), and when they were
    taken, which is for `SampleClock` to say.

    Args:
        tolerance: [rad/s]; 0: what is told is used, whatever it is.

    Attributes:
        acceleration: the motor's largest [rad/s²]; whoever knows it says.
        wrong: the told velocity is not that of the angles.
        used: the velocity that was returned last [rad/s].
    """

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self.acceleration = math.inf
        self._count = math.inf
        self.reset()

    def reset(self) -> None:
        """Forget the past, but for the encoder's count."""
        self.wrong = False
        self._derived = VelocityFromPosition(VELOCITY_CUTOFF)
        self._time, self._position = math.nan, math.nan
        self._off = self.used = 0.0
        self._beyond = 0   # on which side of what is possible the last sample lay

    def step(self, time: float, span: float, position: float, velocity: float) -> float:
        """Return the velocity to use [rad/s] for one sample.

        Args:
            time: when it was taken, evenly spaced (`SampleClock`) [s].
            span: since the last one, in which the motor may have been sped up; what its stamp
                alone says gives no room (`StateWatch`) [s].
            position, velocity: measured [rad, rad/s]; NaN where the drive tells no velocity.
        """
        derived = self._derived.step(time, position)
        dt, moved = time - self._time, abs(position - self._position)
        self._time, self._position = time, position
        told = velocity == velocity
        if not dt > 0.0 or (told and self.tolerance <= 0.0):   # the first sample, or not watched
            self.used = velocity if told else derived
            return self.used
        if 0.0 < moved < self._count:
            self._count = moved
        # One count, through the filter of the angles' velocity.
        doubt = self._count / (dt + self._derived.time_constant) if moved else 0.0
        if told:
            self._compare(velocity, derived, doubt, dt)
        reach = self.acceleration * span + doubt
        wish = derived
        if told and not self.wrong and (abs(velocity - self.used) <= reach
                                        or abs(velocity - derived) <= self.tolerance + doubt):
            wish = velocity
        return self._towards(wish, reach)

    def _compare(self, velocity: float, derived: float, doubt: float, dt: float) -> None:
        """Judge the told velocity by its mean difference from the angles' own."""
        tolerance = self.tolerance
        off = min(max(abs(velocity - derived) - doubt, 0.0), _MOST * tolerance)
        self._off += (off - self._off) * min(dt / _MEAN, _PART)
        self.wrong = self._off > tolerance

    def _towards(self, wish: float, reach: float) -> float:
        """Return the velocity to use [rad/s]: `wish`, if it is possible, or was not twice."""
        change = wish - self.used
        beyond = 0 if abs(change) <= reach else 1 if change > 0.0 else -1
        if beyond and beyond != self._beyond:
            wish = self.used + beyond * reach
        self._beyond = beyond
        self.used = wish
        return wish
