# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The last thing before the drive: whatever was computed, what is sent is finite and limited."""

from __future__ import annotations

import math

from engb_core.control.supervisor_settings import SupervisorSettings

__all__ = ['FinalClamp']


class FinalClamp:
    """The last thing before the drive: finite, within the limit, no faster than the slew rate.

    Attributes:
        output: what was sent last [N·m].
        limited: whether the last step changed anything.
        activity: how often it did.
    """

    def __init__(self, settings: SupervisorSettings) -> None:
        self.settings = settings
        self.output = 0.0
        self.limited = False
        self.activity = 0

    def step(self, effort: float, dt: float) -> float:
        """Return the torque to send [N·m] for the wish `effort`, `dt` [s] after the last.

        A wish that is not finite counts as 0. The limit holds at once, even where the slew rate
        would leave more.
        """
        settings = self.settings
        wish = effort if math.isfinite(effort) else 0.0
        limit = settings.effort_limit
        step = settings.effort_rate * min(max(dt, 0.0), 0.1)
        low, high = max(-limit, self.output - step), min(limit, self.output + step)
        low, high = min(low, limit), max(high, -limit)
        value = min(max(wish, low), high)
        self.limited = value != effort
        self.activity += self.limited
        self.output = value
        return value

    def release(self) -> float:
        """Take the torque away at once; return 0."""
        self.output = 0.0
        return 0.0

    def ramp_down(self, dt: float) -> float:
        """Return the next torque [N·m] on the way to none.

        A ramp spares the vehicle a jerk when braking ends. Torque that releases brakes nothing:
        it goes at once, or it would drive the motor off its stroke, with nobody watching.
        """
        settings = self.settings
        step = settings.effort_limit / settings.ramp_time * min(max(dt, 0.0), settings.ramp_time)
        self.output = max(self.output - step, 0.0)
        return self.output
