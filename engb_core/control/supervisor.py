"""Supervision of a brake's loop: what may come in, what is too old, and what stays latched.

Times are of a steady clock [s], passed in: nothing here reads a clock, so every timing can be
tested exactly.
"""

from __future__ import annotations

import math

from engb_core.control.causes import Cause, CAUSES, Severity, State
from engb_core.control.supervisor_settings import SupervisorSettings

__all__ = ['Supervisor']

# An angle or speed beyond this is no measurement [rad, rad/s].
LARGEST = 1e6

# A rejected input is shown for so long after it came [s].
SHOWN = 1.0

_COMMAND_STALE = Cause.COMMAND_STALE.value
_STATE_STALE = Cause.STATE_STALE.value
_OBSERVER_STALE = Cause.OBSERVER_STALE.value
_TRACKING_ERROR = Cause.TRACKING_ERROR.value
# Someone else's torque is a fault for who came later; who was first goes on, degraded.
_DEGRADING = Cause.OTHER_CONTROLLER.value | sum(
    cause.value for cause, info in CAUSES.items() if info.severity is Severity.DEGRADED)


class Supervisor:
    """Judges inputs, watches their age, latches faults until they are cleared.

    Attributes:
        faults: faults that wait to be cleared, as a plain number: it is asked every cycle, and
            arithmetic with enum flags costs a microsecond each.
        counts: how often each cause came up.
    """

    def __init__(self, settings: SupervisorSettings) -> None:
        self.settings = settings
        self.faults = 0
        self.counts = dict.fromkeys(Cause, 0)
        self.watch_commands = True
        self._conditions = 0
        self._last_seen: dict[Cause, float] = {}
        self.start(0.0)

    def start(self, now: float) -> None:
        """Begin (on activation): ages count from now on."""
        self.faults = self._conditions = 0
        self._last_seen.clear()
        self.commanded = False
        self._command: float | None = None
        self._command_time = self._state_time = self._observer_time = now
        self._state: tuple[float, float] | None = None   # stamp, position
        self._error_since: float | None = None

    @property
    def latched(self) -> Cause:
        """Faults that wait to be cleared."""
        return Cause(self.faults)

    @property
    def state(self) -> State:
        """What the controller may do."""
        if self.faults:
            return State.FAULT
        if not self.commanded:
            return State.READY
        return State.DEGRADED if self._conditions & _DEGRADING else State.ENABLED

    def active(self, now: float) -> Cause:
        """Return the causes that hold now, or came up within the last second."""
        found = self._conditions | self.faults
        for cause, seen in self._last_seen.items():
            if now - seen <= SHOWN:
                found |= cause.value
        return Cause(found)

    def holds(self, cause: Cause) -> bool:
        """Whether a lasting condition holds now."""
        return bool(self._conditions & cause.value)

    def note(self, cause: Cause, now: float) -> None:
        """Take note of a passing cause."""
        self.counts[cause] += 1
        self._last_seen[cause] = now

    def set(self, cause: Cause, holds: bool, now: float, latch: bool | None = None) -> None:
        """Say whether a lasting condition holds; faults are latched (unless `latch` is False)."""
        bit = cause.value
        if not holds:
            self._conditions &= ~bit
            return
        if not self._conditions & bit:
            self.counts[cause] += 1
        self._conditions |= bit
        self._last_seen[cause] = now
        if latch or (latch is None and CAUSES[cause].severity is Severity.FAULT):
            self.faults |= bit

    def clear(self, now: float) -> Cause:
        """Clear the latched faults whose condition is gone; return those that remain."""
        self.faults &= self._conditions & ~_COMMAND_STALE
        if not self.faults:
            self._conditions &= ~_COMMAND_STALE
            self.commanded = False
            self._command = None
            self._command_time = now
        return self.latched

    def accept_command(self, now: float, value: float, low: float, high: float) -> bool:
        """Return whether a command may be taken; if so it feeds the watchdog."""
        if not math.isfinite(value):
            self.note(Cause.COMMAND_NOT_FINITE, now)
            return False
        if not low <= value <= high:
            self.note(Cause.COMMAND_OUT_OF_RANGE, now)
            return False
        if (self._command is not None
                and abs(value - self._command) > self.settings.largest_command_step):
            self.note(Cause.COMMAND_JUMP, now)
            return False
        if self.faults:
            return False
        self._command = value
        self._command_time = now
        self.commanded = True
        return True

    def accept_state(self, now: float, stamp: float, position: float, velocity: float) -> bool:
        """Return whether a joint state may be used; if so it feeds the watchdog.

        Args:
            now: steady clock [s].
            stamp: of the sample [s].
            position, velocity: [rad, rad/s]; a velocity of NaN means that none is given.
        """
        if not (math.isfinite(stamp) and abs(position) < LARGEST) or abs(velocity) > LARGEST:
            self.note(Cause.STATE_NOT_FINITE, now)
            return False
        settings, before = self.settings, self._state
        if before is not None:
            passed = stamp - before[0]
            waited = now - self._state_time
            if abs(passed - waited) > 0.1 and not 0.0 < passed <= 0.1:
                self.note(Cause.CLOCK_JUMP, now)
            # Either clock may have stood still or jumped; the longer one is the fairer.
            span = max(min(passed, 1.0), min(waited, 1.0), 0.001)
            if abs(position - before[1]) > settings.largest_speed * span:
                self.note(Cause.STATE_JUMP, now)
                return False
        self._state = (stamp, position)
        self._state_time = now
        if self._conditions & _STATE_STALE:
            self.set(Cause.STATE_STALE, False, now)
        return True

    def observer_spoke(self, now: float) -> None:
        """Feed the observer's watchdog."""
        self._observer_time = now
        if self._conditions & _OBSERVER_STALE:
            self.set(Cause.OBSERVER_STALE, False, now)

    def tracking(self, now: float, error: float) -> None:
        """Judge the tracking error [rad]."""
        if abs(error) <= self.settings.largest_error:
            self._error_since = None
            if self._conditions & _TRACKING_ERROR:
                self.set(Cause.TRACKING_ERROR, False, now)
        elif self._error_since is None:
            self._error_since = now
        elif now - self._error_since > self.settings.error_time:
            self.set(Cause.TRACKING_ERROR, True, now)

    def watch(self, now: float) -> None:
        """Look at the ages of all inputs."""
        settings = self.settings
        if settings.state_timeout > 0.0 and now - self._state_time > settings.state_timeout:
            # Before the very first sample nothing has failed yet.
            self.set(Cause.STATE_STALE, True, now, latch=self._state is not None)
        if (self.watch_commands and self.commanded and settings.command_timeout > 0.0
                and now - self._command_time > settings.command_timeout):
            self.set(Cause.COMMAND_STALE, True, now)
        if (settings.observer_timeout > 0.0
                and now - self._observer_time > settings.observer_timeout):
            self.set(Cause.OBSERVER_STALE, True, now)
