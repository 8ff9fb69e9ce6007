# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Node `plant`: the simulated brake behind its drive."""

from __future__ import annotations

from collections.abc import Sequence
import time as steady
from typing import Any

from builtin_interfaces.msg import Time
from rosgraph_msgs.msg import Clock

from engb_core.errors import InputError
from engb_ros import interface
from engb_ros.nodes.base import ManagedNode, run
from engb_ros.nodes.brake_parameters import BRAKE_PARAMETERS, make_brake, word_about_torque
from engb_ros.nodes.joint import EFFORT_SOURCE, listen_for_effort
from engb_ros.nodes.messages import JointMessage, scalar
from engb_ros.nodes.parameters import ParameterSpec

__all__ = ['PlantNode', 'main']

# A late timer makes up for no more than this at once; beyond, the brake's time falls behind [s].
_LONGEST_CATCH_UP = 0.05


class PlantNode(ManagedNode):
    """Publishes `joint_states` at the drive's rate and obeys `effort_command`.

    It keeps the pace of the clock, `speed` times. In lockstep it goes on only once a command
    has answered the last sample: a loaded computer makes it slower, never worse. With
    `publish_clock` its time is the graph's (`use_sim_time` for the others).
    """

    node_name = 'plant'
    parameters = (
        *BRAKE_PARAMETERS,
        EFFORT_SOURCE,
        ParameterSpec('speed', 1.0, 'simulated seconds per second; 0: as fast as commands answer '
                      '(lockstep only)', '-', 0.0, 1000.0),
        ParameterSpec('lockstep', False, 'wait for a command after each sample'),
        ParameterSpec('answer_timeout', 0.25, 'in lockstep, an answer that never comes is waited '
                      'for so long', 's', 0.01, 60.0),
        ParameterSpec('publish_clock', False, 'publish /clock'),
    )

    def configure(self, values: dict[str, Any]) -> None:
        """Build the brake."""
        if values['speed'] == 0.0 and not values['lockstep']:
            raise InputError('parameter speed is 0.0 without lockstep; nothing would set the '
                             'pace: set lockstep, or a speed above 0')
        self._brake = make_brake(values)
        if word := word_about_torque(values):
            self.get_logger().warning(word)
        self._lockstep = values['lockstep']
        self._patience = values['answer_timeout']
        self._speed = values['speed'] if values['speed'] > 0.0 else float('inf')
        self._joint = JointMessage(self._brake.model.joint.name)
        self._publish_joint = self.advertise(interface.JOINT_STATES).publish
        self._publish_disc = self.advertise(interface.DISC_SPEED).publish
        self._publish_temperature = self.advertise(interface.PAD_TEMPERATURE).publish
        self._publish_cell = (self.advertise(interface.LOAD_CELL).publish
                              if values['bench'] else None)
        self._publish_clock = (self.advertise(interface.CLOCK).publish if values['publish_clock']
                               else None)
        listen_for_effort(self, values, self._brake.model.joint.name, self._on_command,
                          self._on_other_command)
        period = self._brake.period
        self.every(period if self._speed > 10.0 else max(period / self._speed, 2e-4), self._tick)
        self._period_ns = round(1e9 * period)
        self._disc_every = max(1, round(0.01 / period))
        self._temperature_every = max(1, round(0.1 / period))

    def start(self) -> None:
        """Let the time run from now on."""
        self._origin_ns = steady.time_ns() - self._brake.samples * self._period_ns
        self._restart_pace()
        self._answered = True
        self._sent = steady.monotonic()

    def _restart_pace(self) -> None:
        self._pace_start = steady.monotonic()
        self._pace_samples = self._brake.samples

    def _due(self) -> float:
        """Return how many samples the clock asks for and were not yet made."""
        passed = (steady.monotonic() - self._pace_start) * self._speed / self._brake.period
        return passed - (self._brake.samples - self._pace_samples)

    def _tick(self) -> None:
        if not self.active:
            return
        if self._lockstep:
            if not self._answered and steady.monotonic() - self._sent < self._patience:
                return
            if self._due() >= 1.0:
                self._sample()
            return
        due = int(self._due())
        if due * self._brake.period > _LONGEST_CATCH_UP * max(self._speed, 1.0):
            due = 1
            self._restart_pace()
        for _ in range(due):
            self._sample()

    def _on_command(self, torque: float) -> None:
        if not self.active:
            return
        if not self._brake.command(torque):
            self.get_logger().warning(
                f'{torque:g} N·m is no command of this drive\'s controller; not taken. Is someone '
                'else on the topic?', throttle_duration_sec=10.0)
        self._answered = True
        if self._lockstep and self._due() >= 1.0:
            self._sample()

    def _on_other_command(self) -> None:
        self.get_logger().warning(
            'more than one node commands torque; the one that came first is obeyed',
            throttle_duration_sec=10.0)

    def _sample(self) -> None:
        brake = self._brake
        if self._lockstep:
            self._answered = False
            self._sent = steady.monotonic()
            if self._due() * brake.period > _LONGEST_CATCH_UP * self._speed:
                self._restart_pace()
        measured = brake.advance()
        stamp = self._origin_ns + brake.samples * self._period_ns
        if self._publish_clock is not None:
            seconds, nanoseconds = divmod(stamp, 1_000_000_000)
            self._publish_clock(Clock(clock=Time(sec=seconds, nanosec=nanoseconds)))
        if brake.samples % self._disc_every == 0:
            self._publish_disc(scalar(measured.disc_speed))
            if self._publish_cell is not None:
                self._publish_cell(scalar(measured.clamp_force))
        if brake.samples % self._temperature_every == 0:
            self._publish_temperature(scalar(measured.pad_temperature))
        self._publish_joint(self._joint.fill(
            stamp, measured.position, measured.velocity, measured.effort))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(PlantNode, args)
