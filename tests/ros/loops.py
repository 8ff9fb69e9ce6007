# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Loops to disturb, with the plant or with a drive behind a CAN bus: same topics, same tests."""

import time

from engb_core.control.causes import Cause, CAUSES, Severity
from engb_ros.nodes.controller_parameters import PARAMETERS
from engb_ros.processes.live_loop import LiveLoop
from engb_ros.processes.runner import RunnerError
from tests.machine import Watch

# As the controller is shipped [s].
STATE_TIMEOUT, COMMAND_TIMEOUT = (
    next(spec.default for spec in PARAMETERS if spec.name == name)
    for name in ('state_timeout', 'command_timeout'))

# For what is not about timeouts, and has two controllers whose words are mixed [s].
PATIENT = {'state_timeout': 1.5, 'command_timeout': 2.0}

# A slow rate leaves a loaded computer time; no noise: a drive that lets go shows exactly 0.
BRAKE = {'rate': 200.0, 'effort_noise': 0.0}

# What a watchdog finds, the controller's or the drive's, where the computer let somebody wait;
# and what else would be a fault.
OF_LATENESS = Cause.STATE_STALE | Cause.COMMAND_STALE | Cause.DRIVE_OFF
FAULTS = sum(cause.value for cause, info in CAUSES.items() if info.severity is Severity.FAULT)
OTHERS = FAULTS & ~OF_LATENESS.value

# A move is begun again so often, if it was stopped for that reason.
ATTEMPTS = 8


class ShippedLoop(LiveLoop):
    """A loop whose nodes keep their default timeouts, on a computer that may be busy.

    A watchdog that finds a fault because a process had to wait is right: the test then clears it,
    as an operator would, and moves again. It does so only where the lateness is seen: in the
    stamps of the drive, or in what the machine did meanwhile. What the controller makes of a
    fault that the test injects is never repeated.
    """

    def __init__(self, *arguments, **parameters):
        self._watch, self._begin, self._told = Watch(), 0, 0
        super().__init__(*arguments, **parameters)

    def go(self, angle):
        """Track `angle` [rad] and wait until the brake is there."""
        for _ in range(ATTEMPTS):
            if not self.is_in('fault'):   # else it is of the time since it was well
                self._mark()
            try:
                super().go(angle)
                return
            except RunnerError:
                if not self.is_in('fault') or not self.began_late():
                    raise
            self.healthy()
        super().go(angle)

    def reach(self, condition, what):
        """Wait for `condition`; a fault that comes of lateness is cleared meanwhile."""
        self._mark()
        asked = time.monotonic()

        def reached():
            nonlocal asked
            if condition():
                return True
            if self.is_in('fault') and time.monotonic() - asked > 0.3 and self.was_late():
                asked = time.monotonic()
                self.clear()
            return False

        self.until(reached, what)

    def undisturbed(self, trial, angle=10.0):
        """Return what `trial` returns, called at `angle` [rad]: again, where the controller found
        a fault meanwhile that comes of lateness, and a trial proves nothing."""
        for left in reversed(range(ATTEMPTS)):
            self.go(angle)
            self._mark()
            told = len(self.state)
            result = trial()
            if (left == 0 or not self.was_late()
                    or not any(message.data == 'fault' for message in self.state[told:])):
                break
        return result

    def healthy(self):
        """Clear a fault whose cause is over. A brake that was thrown out of its range, from where
        no controller moves it, is started anew where it stands at a start."""
        self.target = None
        self._wait_for_samples()
        if self.has(Cause.ANGLE_OUT_OF_RANGE):
            print(f'out of its range, so homed: {self.words()}', flush=True)
            for name in self.drive:
                self.kill(name)
            for name in self.drive:
                self.start(name)
            self._wait_for_samples()
        self.until(lambda: self.clear().success, 'the fault to be cleared')

    def began_late(self):
        """Return whether the first fault was one of lateness: the torque goes, and the brake may
        be thrown out of its range, which is its consequence."""
        first = next((message.data for message in self.causes[self._told:]
                      if message.data & FAULTS), 0)
        return not first & OTHERS and self._lateness_is_seen()

    def was_late(self):
        """Return whether what is latched comes of a drive, commands, or a machine that was
        late."""
        return not self.causes[-1].data & OTHERS and self._lateness_is_seen()

    def _lateness_is_seen(self):
        gap, _ = self._gaps()
        return (gap > STATE_TIMEOUT or self.pause > COMMAND_TIMEOUT
                or self._watch.may_be_late())

    def words(self):
        """Return what the loop is at, and who let it wait."""
        gap, pause = self._gaps()
        others, everybody = self._watch.used()
        return (f'{super().words()}; the drive told nothing for {1e3 * gap:.0f} ms at most, and '
                f'was told nothing for {1e3 * pause:.0f} ms; commands came '
                f'{1e3 * self.pause:.0f} ms apart at most; of the machine others took '
                f'{others:.0%}, everybody {everybody:.0%}')

    def _mark(self):
        """What `was_late` and `words` say is of the time from here on."""
        self._begin, self._watch, self.pause = max(len(self.states) - 1, 0), Watch(), 0.0
        self._told = len(self.causes)

    def _wait_for_samples(self):
        count = len(self.states)
        self.until(lambda: len(self.states) > count + 20, 'the drive')

    def _gaps(self):
        """Return for how long the drive told nothing, and for how long its torque stood still
        where it was not 0 [s]: each cycle gives it another one. By its own stamps."""
        gap = pause = 0.0
        since = before = torque = None
        for message in self.states[self._begin:]:
            now = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
            effort = message.effort[0] if len(message.effort) else 0.0
            gap = max(gap, now - before) if before is not None else 0.0
            if effort != torque or effort == 0.0:
                since = now
            pause, before, torque = max(pause, now - since), now, effort
        return gap, pause


def plant(**parameters):
    """Return the plant as a drive."""
    return [('plant', {**BRAKE, **parameters})]


def can_drive(bus):
    """Return emulator and bridge on `bus` as a drive."""
    return [('drive_emulator', {**BRAKE, **bus}), ('can_bridge', bus)]


def closed_loop(runner, probe, drive=None, **controller):
    """Return a loop that is closed, with the parameters that the nodes are shipped with."""
    return ShippedLoop(runner, probe, drive or plant(), **controller)
