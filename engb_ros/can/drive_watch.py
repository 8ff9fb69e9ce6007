# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whether the drive is in the mode that it was asked for, and what it is told to the graph as."""

from __future__ import annotations

from enum import Enum

from engb_ros.can.codec import DriveStatus, TORQUE

__all__ = ['DriveState', 'DriveWatch']


class DriveState(Enum):
    """What `drive_state` says."""

    OFF = 'off'
    OBEYS = 'obeys'
    REFUSES = 'refuses'
    HOLDS_ON = 'holds_on'
    LOST = 'lost'


class DriveWatch:
    """Compares the mode that is asked with the mode that is reported.

    Args:
        patience: a drive may take so long to follow [s].

    Attributes:
        reported_mode: the drive's last word; None before the first one.
    """

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self._asked: int | None = None
        self._torque_is_asked = False
        self._differs_since: float | None = None
        self._command_lost = False
        self.reported_mode: int | None = None

    def ask(self, mode: int, now: float) -> None:
        """Note that the drive was asked for `mode` at `now` [s]."""
        if mode != self._asked:
            self._asked = mode
            self._torque_is_asked = mode == TORQUE
            # From here on, however long it followed, or did not follow, another wish.
            self._differs_since = now
            self._compare(now)

    def report(self, status: DriveStatus, now: float) -> None:
        """Note what the drive said at `now` [s]."""
        self.reported_mode = status.mode
        self._command_lost = 'COMMAND_LOST' in status.flags
        self._compare(now)

    def state(self, link_is_valid: bool, now: float) -> DriveState:
        """Return the drive's state at `now` [s]."""
        if not link_is_valid:
            self._differs_since = now   # nothing is known: the patience begins anew
            return DriveState.LOST
        if self._differs_since is not None and now - self._differs_since > self._patience:
            return DriveState.REFUSES if self._torque_is_asked else DriveState.HOLDS_ON
        return DriveState.OBEYS if self._torque_is_asked else DriveState.OFF

    def _compare(self, now: float) -> None:
        # Who does not hear the torque that it shall give is no better than who does not give it.
        follows = self.reported_mode == self._asked and not (
            self._command_lost and self._torque_is_asked)
        if follows or self._asked is None:
            self._differs_since = None
        elif self._differs_since is None:
            self._differs_since = now
