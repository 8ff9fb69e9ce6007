# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whether the drive gives the torque that it is asked for, and whether the shaft moves by it."""

from __future__ import annotations

import math

from engb_core.control.supervisor_settings import SupervisorSettings

__all__ = ['TorqueWatch']

# A torque beyond this is no measurement [N·m].
LARGEST = 1e6

# One late sample stands for no more than this [s]: it takes several to find a fault.
_LONGEST = 0.02

# Below this part of what is asked a drive is off, not weak.
_NONE = 0.1

# A shaft that moves by less than this part of `largest_error` stands.
_STANDS = 0.1


class TorqueWatch:
    """Compares the measured torque with what was asked of the drive lately.

    The drive answers late by an unknown time up to `drive_delay`: what it gives must lie between
    the lowest and the highest torque of that span. What it gives beyond or short of it is
    averaged over `drive_time`, so noise doesn't count. Of three samples in a row the middle one is
    taken: a single one counts for nothing, however large (a flaw of the current's measurement, a
    message of a stranger).

    A drive that tells no torque, or one that is no number, is not watched; `missing` says so once
    that has lasted `drive_time`.

    Attributes:
        settings: `drive_tolerance`, `drive_time`, `drive_delay`, `seized_time`.
        measured: the middle one of the last three measured torques [N·m]; NaN where none is told.
        weak, off, wrong, seized, missing: what holds now.
        short: what is measured now is short of what was asked; the loop must not wind up.
    """

    def __init__(self, settings: SupervisorSettings) -> None:
        self.settings = settings
        self._newest = self._older = self.measured = math.nan
        self.missing = False
        self._untold = 0.0
        self.reset()

    def reset(self) -> None:
        """Forget the past, but for the last two samples, and whether there are any."""
        self.weak = self.off = self.wrong = self.seized = self.short = False
        self._low = self._high = self._low_before = self._high_before = 0.0
        self._span = 0.0
        self._lack = self._excess = self._given = 0.0
        self._place: float | None = None
        self._stood = 0.0

    def asked(self, torque: float, dt: float) -> None:
        """Take note of the torque that was sent [N·m], `dt` [s] after the last."""
        self._span += dt
        if self._span > self.settings.drive_delay:
            self._span = 0.0
            self._low_before, self._high_before = self._low, self._high
            self._low = self._high = torque
        elif torque < self._low:
            self._low = torque
        elif torque > self._high:
            self._high = torque

    def given(self, torque: float, dt: float) -> None:
        """Judge the measured torque [N·m]; NaN where the drive measures none."""
        settings = self.settings
        tolerance = settings.drive_tolerance
        if not abs(torque) < LARGEST:
            self.weak = self.off = self.wrong = self.short = False
            self._newest = self._older = self.measured = math.nan
            self._untold += min(dt, _LONGEST)
            self.missing = tolerance > 0.0 and self._untold > settings.drive_time
            return
        self._untold, self.missing = 0.0, False
        newest, older = self._newest, self._older
        self._newest, self._older = torque, newest
        # The middle one of three; with fewer, the one that came first.
        if older == older:
            torque = max(min(torque, newest), min(max(torque, newest), older))
        elif newest == newest:
            torque = newest
        self.measured = torque
        if tolerance <= 0.0:
            self.weak = self.off = self.wrong = self.short = False
            return
        low, high = min(self._low, self._low_before), max(self._high, self._high_before)
        lack = excess = 0.0
        if torque < low:
            if low > 0.0 and torque >= -tolerance:
                lack = low - max(torque, 0.0)
            else:
                excess = low - torque
        elif torque > high:
            if high < 0.0 and torque <= tolerance:
                lack = min(torque, 0.0) - high
            else:
                excess = torque - high
        part = min(dt, _LONGEST) / settings.drive_time
        self._lack += (lack - self._lack) * min(part, 1.0)
        self._excess += (excess - self._excess) * min(part, 1.0)
        # Whether it gives anything is seen sooner than how much.
        self._given += (abs(torque) - self._given) * min(4.0 * part, 1.0)
        self.short = lack > tolerance
        lacking = self._lack > tolerance
        self.off = lacking and self._given <= _NONE * (self._given + self._lack)
        self.weak = lacking and not self.off
        self.wrong = self._excess > tolerance

    def moves(self, position: float, error: float, full: bool, dt: float,
              largest_error: float) -> None:
        """Judge whether the shaft moves [rad], given the tracking error and whether the torque
        is as high as it may be."""
        if (not full or abs(error) <= largest_error or self._place is None
                or abs(position - self._place) > _STANDS * largest_error):
            self._place = position
            self._stood = 0.0
            self.seized = False
            return
        self._stood += min(dt, _LONGEST)
        self.seized = 0.0 < self.settings.seized_time < self._stood

    def moved(self) -> None:
        """Begin to look anew: the set-point was taken back to where the shaft stands."""
        self._place = None
