# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Supervision of a brake's loop: what may come in, what is too old, and what stays latched.

Times are of a steady clock [s], passed in: nothing here reads a clock, so every timing can be
tested exactly.
"""

from __future__ import annotations

import math

from engb_core.control.causes import Cause, CAUSES, Severity, State, Stop
from engb_core.control.command_arbiter import Command, CommandArbiter
from engb_core.control.state_watch import StateWatch
from engb_core.control.supervisor_settings import SupervisorSettings
from engb_core.control.torque_watch import TorqueWatch

__all__ = ['Supervisor']

# A rejected input is shown for so long after it came [s].
SHOWN = 1.0

_COMMAND_STALE = Cause.COMMAND_STALE.value
_STATE_STALE = Cause.STATE_STALE.value
_OBSERVER_STALE = Cause.OBSERVER_STALE.value
_TRACKING_ERROR = Cause.TRACKING_ERROR.value
_ANGLE_OUT_OF_RANGE = Cause.ANGLE_OUT_OF_RANGE.value
_SHAFT_SEIZED = Cause.SHAFT_SEIZED.value
_DISC_SPEED_STALE = Cause.DISC_SPEED_STALE.value
_COMMAND_CONFLICT = Cause.COMMAND_CONFLICT.value
_EFFORT_MISSING = Cause.EFFORT_MISSING.value
_OUTPUT_NOT_FINITE = Cause.OUTPUT_NOT_FINITE.value
_VELOCITY_WRONG = Cause.VELOCITY_WRONG.value

# A bridge says again and again (each 10 ms) that its drive does not obey: that counts once it has
# been said for so long, three times at its pace, and until it was not said for so long [s].
_WORD_KEPT_UP, _WORD_FORGOTTEN = 0.015, 0.5

# Who goes beyond `largest_error` to one side, to the other and back again, so many times at one
# set-point, swings.
_SWINGS = 3

_DRIVE = (Cause.DRIVE_WEAK | Cause.DRIVE_OFF | Cause.DRIVE_WRONG).value
# Someone else's torque is a fault for who came later; who was first goes on, degraded.
_DEGRADING = Cause.OTHER_CONTROLLER.value | sum(
    cause.value for cause, info in CAUSES.items() if info.severity is Severity.DEGRADED)


class Supervisor:
    """Judges inputs, watches their age, latches faults until they are cleared.

    Attributes:
        faults: faults that wait to be cleared, as a plain number: it is asked every cycle, and
            arithmetic with enum flags costs a microsecond each.
        counts: how often each cause came up.
        longest_interval: samples that come farther apart leave the loop no phase margin [s];
            whoever knows the loop says; inf: none are too far apart.
        enabled_once: since `start` a command was taken, or a torque taken over. Before, joint
            states that stop are no fault: nothing was asked of the brake, and whoever sends them
            may still be starting. They are waited for, without torque.
    """

    def __init__(self, settings: SupervisorSettings) -> None:
        self.counts = dict.fromkeys(Cause, 0)
        self.watch_commands = True
        self.longest_interval = math.inf
        self._last_seen: dict[Cause, float] = {}
        self.commands = CommandArbiter(settings, self.note)
        self.states = StateWatch(settings, self.note)
        self.torques = TorqueWatch(settings)
        self.settings = settings
        self.start(0.0)

    @property
    def settings(self) -> SupervisorSettings:
        """The settings in use."""
        return self._settings

    @settings.setter
    def settings(self, settings: SupervisorSettings) -> None:
        """Use these settings from now on, in all watches."""
        self._settings = settings
        self.commands.settings = self.states.settings = self.torques.settings = settings
        self._release, self._ramp = settings.with_stop(Stop.RELEASE), settings.with_stop(Stop.RAMP)

    def start(self, now: float) -> None:
        """Begin (on activation): ages count from now on."""
        self.faults = self._conditions = 0
        self._last_seen.clear()
        self.commanded = self.enabled_once = False
        self._back_since = -math.inf   # when joint states that were waited for came back
        self._state_time = self._observer_time = now
        self._disc_time: float | None = None
        self._refuses = self._holds_on = False
        self._word, self._word_since, self._word_at = '', now, now
        self._outside = False
        self.commands.reset(now)
        self.states.reset()
        self.torques.reset()
        self._error_since: float | None = None
        self._swings, self._aim = 0, 0.0
        self._is_above, self._beyond_at = False, now
        settings = self.settings
        if settings.state_timeout <= 0.0 or (
                self.watch_commands and settings.command_timeout <= 0.0):
            self.set(Cause.NOT_WATCHED, True, now)

    @property
    def stop(self) -> Stop | None:
        """What becomes of the torque: the strictest stop of `stopping`."""
        faults = self.stopping
        if not faults:
            return None
        if faults & self._release:
            return Stop.RELEASE
        return Stop.RAMP if faults & self._ramp else Stop.HOLD

    @property
    def stopping(self) -> int:
        """Latched faults, and joint states that are waited for, as a plain number."""
        if self.enabled_once or not self.states.seen:
            return self.faults
        return self.faults | self._conditions & _STATE_STALE

    @property
    def too_slow(self) -> bool:
        """Whether joint states come too seldom for the loop to be closed."""
        return not self.enabled_once and self.states.taken.pace > self.longest_interval

    @property
    def waits_for(self) -> str:
        """What is waited for before the first command, in one line; '': nothing."""
        if not self.stopping & ~self.faults:
            return ''
        if not self.too_slow:
            return 'joint states have stopped: waiting for them'
        pace, longest = self.states.taken.pace, self.longest_interval
        return (f'joint states come every {1e3 * pace:.3g} ms ({1.0 / pace:.3g} Hz): with these '
                f'gains and the model\'s inertia the loop has no phase margin below '
                f'{1.0 / longest:.3g} Hz; let the drive send faster, or start with lower p and d')

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
        # What can only be seen while commands are followed, or torque is given, is tried anew.
        tried_anew = _COMMAND_STALE | _OUTPUT_NOT_FINITE | _SHAFT_SEIZED
        if not self._refuses:
            tried_anew |= Cause.DRIVE_OFF.value
        self.faults &= self._conditions & ~tried_anew
        if not self.faults:
            self._conditions &= ~(tried_anew | _DRIVE | _TRACKING_ERROR)
            self.commanded = False
            self._error_since = None
            self._swings = 0
            self.commands.reset(now)
            self.torques.reset()
        return self.latched

    def accept_command(self, now: float, command: Command, low: float,
                       high: float) -> float | None:
        """Return the value to follow, within `low` and `high`; None: the last one stands.

        In a fault only a source that has been speaking for a while is listened to: the caller
        follows lower requests. None is taken while joint states are waited for.
        """
        value = self.commands.judge(now, command, low, high)
        if value is None or not (self.enabled_once or self._have_states(now)):
            return None
        if self.faults:
            return value if self.commands.steady(now) else None
        self.enable()
        return value

    def enable(self) -> None:
        """Follow a command, or a trajectory, from now on."""
        self.commanded = self.enabled_once = True

    @property
    def paced(self) -> bool:
        """Whether samples have shown how far apart they come: before, nothing is tracked."""
        return self.longest_interval == math.inf or self.states.taken.pace > 0.0

    def _have_states(self, now: float) -> bool:
        """Whether joint states, once missed, have come for `state_timeout` without a gap."""
        return (not self._conditions & _STATE_STALE and self.paced
                and now - self._back_since >= self._settings.state_timeout)

    def accept_state(self, now: float, stamp: float, position: float, velocity: float) -> bool:
        """Return whether a joint state may be used; if so it feeds the watchdog.

        Args:
            now: steady clock [s].
            stamp: of the sample [s].
            position, velocity: [rad, rad/s]; a velocity of NaN means that none is given.
        """
        first = not self.states.seen
        if not self.states.accept(now, stamp, position, velocity):
            if not self.states.lost:
                return False
            # The torque goes; what comes after a clear needs an angle to begin with.
            self.set(Cause.ANGLE_LOST, True, now)
            self.set(Cause.ANGLE_LOST, False, now)
            self.states.believe()
        too_slow = self.too_slow
        if too_slow or self._conditions & _STATE_STALE:
            timeout = self._settings.state_timeout
            if first or now - self._state_time > timeout:
                self._back_since = now
            if too_slow:
                self._follow(Cause.STATE_STALE, True, now, latch=False)
            elif first or self.enabled_once or now - self._back_since >= timeout:
                self._conditions &= ~_STATE_STALE
        self._state_time = now
        return True

    def angle(self, now: float, position: float, low: float, high: float) -> None:
        """Judge whether the angle lies in its range [rad]; one sample outside is none yet."""
        margin = self.settings.largest_error
        if low - margin <= position <= high + margin:
            self._outside = False
            self._conditions &= ~_ANGLE_OUT_OF_RANGE
        elif not self._outside:
            self._outside = True
        elif not self._conditions & _ANGLE_OUT_OF_RANGE:
            self.set(Cause.ANGLE_OUT_OF_RANGE, True, now)

    def torque(self, now: float, effort: float, dt: float) -> None:
        """Judge the torque that the drive measured [N·m], `dt` [s] after the last."""
        watch = self.torques
        watch.given(effort, dt)
        if watch.weak or watch.off or watch.wrong or self._conditions & _DRIVE:
            self._follow(Cause.DRIVE_WEAK, watch.weak, now)
            self._follow(Cause.DRIVE_OFF, watch.off or self._refuses, now)
            self._follow(Cause.DRIVE_WRONG, watch.wrong or self._holds_on, now)
        if watch.missing or self._conditions & _EFFORT_MISSING:
            self._follow(Cause.EFFORT_MISSING, watch.missing, now)

    def velocity(self, now: float, wrong: bool) -> None:
        """Say whether the told velocity is not that of the angles."""
        if wrong or self._conditions & _VELOCITY_WRONG:
            self._follow(Cause.VELOCITY_WRONG, wrong, now)

    def drive_state(self, now: float, word: str) -> None:
        """Take what a bridge says of its drive: 'refuses' the torque mode, or 'holds_on' to it
        though it was switched off; anything else is well.

        These two count while they are kept up: one message releases no brake, and what is not
        said any more holds no longer.
        """
        if word != self._word or now - self._word_at > _WORD_FORGOTTEN:
            self._word, self._word_since = word, now
        self._word_at = now
        kept_up = now - self._word_since >= _WORD_KEPT_UP
        self._refuses = kept_up and word == 'refuses'
        self._holds_on = kept_up and word == 'holds_on'
        self._follow(Cause.DRIVE_OFF, self._refuses or self.torques.off, now)
        self._follow(Cause.DRIVE_WRONG, self._holds_on or self.torques.wrong, now)

    def shaft(self, now: float, position: float, error: float, full: bool, dt: float) -> bool:
        """Judge whether the shaft moves; return whether it is seized."""
        watch = self.torques
        watch.moves(position, error, full, dt, self.settings.largest_error)
        if watch.seized or self._conditions & _SHAFT_SEIZED:
            self._follow(Cause.SHAFT_SEIZED, watch.seized, now)
        return watch.seized

    def disc_spoke(self, now: float) -> None:
        """Feed the disc speed's watchdog, which begins with its first message."""
        self._disc_time = now
        self._conditions &= ~_DISC_SPEED_STALE

    def _follow(self, cause: Cause, holds: bool, now: float, latch: bool | None = None) -> None:
        if bool(self._conditions & cause.value) is not holds:
            self.set(cause, holds, now, latch)

    def observer_spoke(self, now: float) -> None:
        """Feed the observer's watchdog."""
        self._observer_time = now
        self._conditions &= ~_OBSERVER_STALE

    def tracking(self, now: float, error: float, setpoint: float = 0.0) -> None:
        """Judge the tracking error [rad], at a set-point [rad]: one that lasts, and one that
        swings."""
        largest, error_time = self._settings.largest_error, self._settings.error_time
        if self._swings and abs(setpoint - self._aim) > largest:
            self._swings = 0   # another move
        if abs(error) <= largest:
            self._error_since = None
            if self._swings and now - self._beyond_at > error_time:
                self._swings = 0
            if self._swings < _SWINGS:
                self._conditions &= ~_TRACKING_ERROR
            return
        is_above = error > 0.0
        if not self._swings:
            self._swings, self._aim = 1, setpoint
        elif is_above is not self._is_above:
            self._swings += 1
        self._is_above, self._beyond_at = is_above, now
        if self._error_since is None:
            self._error_since = now
        if now - self._error_since > error_time or self._swings >= _SWINGS:
            self.set(Cause.TRACKING_ERROR, True, now)

    def watch(self, now: float) -> None:
        """Look at the ages of all inputs."""
        settings, commands = self._settings, self.commands
        if (self._refuses or self._holds_on) and now - self._word_at > _WORD_FORGOTTEN:
            self.drive_state(now, '')
        if settings.state_timeout > 0.0 and now - self._state_time > settings.state_timeout:
            # Before the very first sample, and the first command, nothing has failed yet.
            self.set(Cause.STATE_STALE, True, now, latch=self.states.seen and self.enabled_once)
        if (self.watch_commands and self.commanded and settings.command_timeout > 0.0
                and now - commands.spoke_at > settings.command_timeout
                and not commands.successor(now)):
            self.set(Cause.COMMAND_STALE, True, now)
        if (settings.observer_timeout > 0.0
                and now - self._observer_time > settings.observer_timeout):
            self.set(Cause.OBSERVER_STALE, True, now)
        if (self._disc_time is not None and settings.disc_speed_timeout > 0.0
                and now - self._disc_time > settings.disc_speed_timeout):
            self.set(Cause.DISC_SPEED_STALE, True, now)
        conflict = commands.rivals or now - commands.conflict_at < SHOWN
        if conflict or self._conditions & _COMMAND_CONFLICT:
            self._follow(Cause.COMMAND_CONFLICT, conflict, now)
