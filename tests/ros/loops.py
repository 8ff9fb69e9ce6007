# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Loops to disturb, with the plant or with a drive behind a CAN bus: same topics, same tests."""

from engb_core.control.causes import Cause, CAUSES, Severity
from engb_ros.live_loop import LiveLoop
from engb_ros.nodes.controller_parameters import PARAMETERS
from engb_ros.runner import RunnerError
from tests.machine import Watch

# As the controller is shipped [s].
STATE_TIMEOUT = next(spec.default for spec in PARAMETERS if spec.name == 'state_timeout')

# For what is not about timeouts, and has two controllers whose words are mixed [s].
PATIENT = {'state_timeout': 1.5, 'command_timeout': 2.0}

# A slow rate leaves a loaded computer time; no noise: a drive that lets go shows exactly 0.
BRAKE = {'rate': 200.0, 'effort_noise': 0.0}

# What a watchdog finds, the controller's or the drive's, where the computer let somebody wait;
# and what else would be a fault.
OF_LATENESS = Cause.STATE_STALE | Cause.COMMAND_STALE | Cause.DRIVE_OFF
OTHERS = sum(cause.value for cause, info in CAUSES.items() if info.severity is Severity.FAULT
             and not cause & OF_LATENESS)

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
        self._watch, self._begin = Watch(), 0
        super().__init__(*arguments, **parameters)

    def go(self, angle):
        """Track `angle` [rad] and wait until the brake is there."""
        for _ in range(ATTEMPTS):
            self._begin, self._watch = max(len(self.states) - 1, 0), Watch()
            try:
                super().go(angle)
                return
            except RunnerError:
                if not self.is_in('fault') or not self.was_late():
                    raise
            self.until(lambda: self.clear().success, 'the fault to be cleared')
        super().go(angle)

    def was_late(self):
        """Return whether what is latched comes of a drive or a machine that was late."""
        if self.causes[-1].data & OTHERS:
            return False
        stamps = [message.header.stamp for message in self.states[self._begin:]]
        times = [stamp.sec + 1e-9 * stamp.nanosec for stamp in stamps]
        gap = max((after - before for before, after in zip(times, times[1:], strict=False)),
                  default=0.0)
        return gap > STATE_TIMEOUT or self._watch.may_be_late()


def plant(**parameters):
    """Return the plant as a drive."""
    return [('plant', {**BRAKE, **parameters})]


def can_drive(bus):
    """Return emulator and bridge on `bus` as a drive."""
    return [('drive_emulator', {**BRAKE, **bus}), ('can_bridge', bus)]


def closed_loop(runner, probe, drive=None, **controller):
    """Return a loop that is closed, with the parameters that the nodes are shipped with."""
    return ShippedLoop(runner, probe, drive or plant(), **controller)
