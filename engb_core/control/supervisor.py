"""Supervision of a brake's loop: what may come in, what may go out, and what happens otherwise.

Times are of a steady clock [s], passed in: nothing here reads a clock, so every timing can be
tested exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntFlag
import math

from engb_core.errors import InputError

__all__ = ['CAUSES', 'Cause', 'FinalClamp', 'STALE_ACTIONS', 'Severity', 'State', 'Supervisor',
           'SupervisorSettings']

STALE_ACTIONS = ('hold', 'ramp_to_zero', 'ramp_to_value')

# An angle or speed beyond this is no measurement [rad, rad/s].
LARGEST = 1e6

# A rejected input is shown for so long after it came [s].
SHOWN = 1.0


class State(Enum):
    """What the controller is doing."""

    READY = 'ready'
    ENABLED = 'enabled'
    DEGRADED = 'degraded'
    FAULT = 'fault'


class Severity(Enum):
    """What a cause does: notice (told), degraded (tracking goes on), fault (latched)."""

    NOTICE = 'notice'
    DEGRADED = 'degraded'
    FAULT = 'fault'


class Cause(IntFlag):
    """One bit per cause."""

    COMMAND_STALE = 1 << 0
    COMMAND_NOT_FINITE = 1 << 1
    COMMAND_OUT_OF_RANGE = 1 << 2
    COMMAND_JUMP = 1 << 3
    STATE_STALE = 1 << 4
    STATE_NOT_FINITE = 1 << 5
    STATE_JUMP = 1 << 6
    STATE_WRONG_JOINT = 1 << 7
    CLOCK_JUMP = 1 << 8
    OBSERVER_STALE = 1 << 9
    OUTPUT_LIMITED = 1 << 10
    OUTPUT_NOT_FINITE = 1 << 11
    TRACKING_ERROR = 1 << 12
    OTHER_CONTROLLER = 1 << 13
    FORCE_UNCERTAIN = 1 << 14


@dataclass(frozen=True)
class CauseInfo:
    """What a cause means and what is done about it."""

    severity: Severity
    meaning: str
    reaction: str


# The one table of causes; the documentation is made from it.
CAUSES: dict[Cause, CauseInfo] = {
    Cause.COMMAND_STALE: CauseInfo(
        Severity.FAULT, 'no valid command within `command_timeout`',
        'the set-point does what `stale_action` says; later commands are ignored until cleared'),
    Cause.COMMAND_NOT_FINITE: CauseInfo(
        Severity.NOTICE, 'a command was NaN or infinite', 'not taken; the last one stands'),
    Cause.COMMAND_OUT_OF_RANGE: CauseInfo(
        Severity.NOTICE, 'a command lay outside its range', 'not taken; the last one stands'),
    Cause.COMMAND_JUMP: CauseInfo(
        Severity.NOTICE, 'a command differed from the last by more than `largest_command_step`',
        'not taken; the last one stands'),
    Cause.STATE_STALE: CauseInfo(
        Severity.FAULT, 'no valid joint state within `state_timeout`',
        'the torque ramps to zero within `ramp_time`'),
    Cause.STATE_NOT_FINITE: CauseInfo(
        Severity.NOTICE, 'a joint state held NaN, infinity, or a number beyond 1e6',
        'the sample is not used'),
    Cause.STATE_JUMP: CauseInfo(
        Severity.NOTICE, 'the angle moved faster than `largest_speed`', 'the sample is not used'),
    Cause.STATE_WRONG_JOINT: CauseInfo(
        Severity.NOTICE, 'a joint state did not hold the joint\'s position',
        'the message is not used'),
    Cause.CLOCK_JUMP: CauseInfo(
        Severity.NOTICE, 'stamps and the steady clock parted by more than 0.1 s',
        'nothing is integrated over the jump'),
    Cause.OBSERVER_STALE: CauseInfo(
        Severity.DEGRADED, 'no `disturbance` within `observer_timeout`',
        'the force estimate relies on the angle alone'),
    Cause.OUTPUT_LIMITED: CauseInfo(
        Severity.NOTICE, 'the final clamp changed the torque', 'the clamped torque is sent'),
    Cause.OUTPUT_NOT_FINITE: CauseInfo(
        Severity.FAULT, 'the computed torque was NaN or infinite',
        'the torque ramps to zero within `ramp_time`'),
    Cause.TRACKING_ERROR: CauseInfo(
        Severity.DEGRADED, 'the angle is off by more than `largest_error` for `error_time`',
        'tracking goes on'),
    Cause.OTHER_CONTROLLER: CauseInfo(
        Severity.FAULT, 'someone else publishes `effort_command`',
        'the one who came later is silent; who was there first goes on, degraded'),
    Cause.FORCE_UNCERTAIN: CauseInfo(
        Severity.DEGRADED, 'angle and current disagree about the clamp force',
        'tracking goes on; the force\'s uncertainty says how far to trust it'),
}


_COMMAND_STALE = Cause.COMMAND_STALE.value
_STATE_STALE = Cause.STATE_STALE.value
_OBSERVER_STALE = Cause.OBSERVER_STALE.value
_TRACKING_ERROR = Cause.TRACKING_ERROR.value
# Someone else's torque is a fault for who came later; who was first goes on, degraded.
_DEGRADING = Cause.OTHER_CONTROLLER.value | sum(
    cause.value for cause, info in CAUSES.items() if info.severity is Severity.DEGRADED)


@dataclass(frozen=True)
class SupervisorSettings:
    """Limits of what is believed.

    Attributes:
        command_timeout, state_timeout, observer_timeout: [s]; 0: not watched.
        stale_action: one of STALE_ACTIONS.
        largest_command_step: between two commands, in the command's unit; inf: any.
        largest_speed: of the motor [rad/s].
        largest_error: of tracking [rad], for `error_time` [s].
        effort_limit: final clamp [N·m].
        effort_rate: final clamp's slew rate [N·m/s].
        ramp_time: from full torque to none [s].
    """

    command_timeout: float = 0.25
    state_timeout: float = 0.1
    observer_timeout: float = 0.0
    stale_action: str = 'hold'
    largest_command_step: float = math.inf
    largest_speed: float = 400.0
    largest_error: float = 2.0
    error_time: float = 0.3
    effort_limit: float = 0.75
    effort_rate: float = 1000.0
    ramp_time: float = 0.2

    def __post_init__(self) -> None:
        if self.stale_action not in STALE_ACTIONS:
            raise InputError(f'stale_action is {self.stale_action!r}; it must be one of '
                             f'{", ".join(STALE_ACTIONS)}')
        for name in ('effort_limit', 'effort_rate', 'ramp_time', 'largest_speed'):
            value = getattr(self, name)
            if not value > 0.0:
                raise InputError(f'{name} is {value}; it must be above 0')


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

    def ramp_down(self, dt: float) -> float:
        """Return the next torque [N·m] on the way to none."""
        settings = self.settings
        step = settings.effort_limit / settings.ramp_time * min(max(dt, 0.0), settings.ramp_time)
        value = self.output
        self.output = math.copysign(max(abs(value) - step, 0.0), value)
        return self.output


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
