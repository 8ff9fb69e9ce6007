# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A controller fed by hand, with its clock, and the ways into each of its states."""

from engb_core.control.brake_controller import BrakeController
from engb_core.control.brake_settings import ControllerSettings, ForceSettings
from engb_core.control.causes import Cause, State
from engb_core.control.clamp_force import read_mechanism
from engb_core.control.loop import LoopSettings
from engb_core.control.pid import PidGains
from engb_core.control.supervisor_settings import SupervisorSettings
from engb_core.model import Model
from engb_ros.files import config_file, TRUE_BRAKE

BRAKE = Model.read(TRUE_BRAKE)
GAINS = PidGains(0.4, 1.5, 0.006, 0.75, -0.75, 0.5, -0.5)
LIMITS = SupervisorSettings(effort_limit=0.5, largest_command_step=20.0, command_timeout=0.25)
FORCE = ForceSettings(read_mechanism(config_file('mechanism.yaml')))
DT = 0.002


class Bench:
    """A controller fed by hand, with its clock."""

    def __init__(self, **options):
        options = {'supervisor': LIMITS, 'position_max': 36.0, 'force': FORCE, **options}
        self.controller = BrakeController(BRAKE, ControllerSettings(
            LoopSettings(GAINS), **options))
        self.now = 100.0
        self.controller.start(self.now)
        self.position = 5.0
        self.effort = 0.0   # an obedient drive gives what it was asked for last

    def state(self, count=1, **given):
        """Feed joint states and return the last torque."""
        torque = None
        for _ in range(count):
            self.now += DT
            sample = {'stamp': self.now, 'position': self.position, 'velocity': 0.0,
                      'effort': self.effort, **given}
            torque = self.controller.on_state(self.now, **sample)
            self.effort = self.effort if torque is None else torque
        return torque

    def commanded(self, value=6.0):
        """Feed joint states and a valid command."""
        self.state(3)
        assert self.controller.on_position_command(self.now, value)
        self.state(3)
        return self

    @property
    def supervisor(self):
        return self.controller.supervisor


def in_ready(**options):
    bench = Bench(**options)
    bench.state(3)
    return bench


def in_enabled(**options):
    return Bench(**options).commanded()


def in_degraded(**options):
    bench = in_enabled(**options)
    bench.supervisor.set(Cause.OBSERVER_STALE, True, bench.now)
    return bench


def in_fault(**options):
    bench = in_enabled(**options)
    bench.now += 1.0
    bench.controller.on_tick(bench.now)
    bench.state()
    return bench


STATES = {State.READY: in_ready, State.ENABLED: in_enabled, State.DEGRADED: in_degraded,
          State.FAULT: in_fault}
