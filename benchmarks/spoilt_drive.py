# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The simulated brake behind a drive that goes wrong on request: node `plant` with faults.

Tests and `fault_times` start it in the place of the plant; the live parameter `fault` says what
it acts out.
"""

from __future__ import annotations

from collections.abc import Sequence
import math
import sys
from typing import Any

from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from engb_ros import interface
from engb_ros.nodes.base import run
from engb_ros.nodes.parameters import ParameterSpec
from engb_ros.nodes.plant import PlantNode

__all__ = ['FAULTS', 'SpoiltDriveNode']

# What is acted out: how the drive spoils what it says, or what it does.
FAULTS = ('none', 'stamps_stand', 'stamps_nought', 'clock_back', 'clock_forward', 'angle_jumps',
          'angle_far', 'angle_glitches', 'angle_nan', 'angle_stuck', 'off', 'weak', 'reversed',
          'stuck', 'biased', 'deaf_for_a_second', 'seized', 'refuses', 'holds_on', 'no_disc',
          'no_effort', 'effort_infinite', 'velocity_reversed', 'velocity_none', 'other_joint_now',
          'no_joint_now', 'angle_nan_now', 'velocity_infinite_now', 'angle_far_now',
          'clock_forward_now', 'clock_back_now')

# What ends in `_now` spoils one of so many messages.
GLITCH = 7

# As a bridge does, it says again and again that it does not obey [s].
SAY_PERIOD = 0.01


class SpoiltDriveNode(PlantNode):
    """Node `plant`, whose messages and torques pass through a fault."""

    parameters = (
        *PlantNode.parameters,
        ParameterSpec('fault', 'none', 'acted out now', choices=FAULTS, live=True),
        ParameterSpec('best_effort', False, 'publish as SensorDataQoS does'),
    )

    def configure(self, values: dict[str, Any]) -> None:
        """Build the drive and put the fault between it and the graph."""
        super().configure(values)
        self._count = 0
        self._say_every = max(1, round(SAY_PERIOD / self._brake.period))
        self._stood: Any = None
        self._frozen_angle = math.nan
        self._since = 0
        self._publish_drive = self.advertise(interface.DRIVE_STATE).publish
        send, command, disc = self._publish_joint, self._brake.command, self._publish_disc
        if values['best_effort']:
            send = self.create_lifecycle_publisher(
                JointState, interface.JOINT_STATES.name,
                QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)).publish

        self._send = send

        def spoilt(message: JointState) -> None:
            self._count += 1
            if self._spoil(message):
                send(message)

        def given(torque: float) -> bool:
            return command(self._torque(torque))

        def told(message: Float64) -> None:
            if self.values['fault'] != 'no_disc':
                disc(message)

        self._publish_joint, self._brake.command, self._publish_disc = spoilt, given, told

    def start(self) -> None:
        """Let the time run; the drive obeys."""
        super().start()
        self._say('obeys')

    def reconfigure(self, values: dict[str, Any]) -> None:
        """Begin another fault."""
        self._stood, self._frozen_angle = None, math.nan
        self._since = self._count
        self._say('obeys')

    def _say(self, word: str) -> None:
        from std_msgs.msg import String
        self._publish_drive(String(data=word))

    def _spoil_one(self, message: JointState, fault: str) -> None:
        """Change one of many messages, whose object is used again for the next one."""
        spoilt = JointState(name=['wheel' if fault == 'other_joint_now' else message.name[0]],
                            position=[message.position[0]], velocity=[message.velocity[0]],
                            effort=[message.effort[0]])
        shift = {'clock_forward_now': 3600, 'clock_back_now': -3600}.get(fault, 0)
        spoilt.header.stamp.sec = message.header.stamp.sec + shift
        spoilt.header.stamp.nanosec = message.header.stamp.nanosec
        if fault == 'no_joint_now':
            spoilt = JointState()
        elif fault == 'angle_nan_now':
            spoilt.position[0] = math.nan
        elif fault == 'velocity_infinite_now':
            spoilt.velocity[0] = math.inf
        elif fault == 'angle_far_now':
            spoilt.position[0] = 1e5
        self._send(spoilt)

    def _spoil(self, message: JointState) -> bool:
        """Change a message; return whether it is sent."""
        fault, stamp = self.values['fault'], message.header.stamp
        if fault in ('refuses', 'holds_on') and self._count % self._say_every == 0:
            self._say(fault)
        if fault.endswith('_now') and self._count % GLITCH == 0:
            self._spoil_one(message, fault)
            return False
        if fault == 'stamps_stand':
            if self._stood is None:
                self._stood = (stamp.sec, stamp.nanosec)
            stamp.sec, stamp.nanosec = self._stood
        elif fault == 'stamps_nought':
            stamp.sec = stamp.nanosec = 0
        elif fault in ('clock_back', 'clock_forward'):
            shift = -60_000_000 if fault == 'clock_back' else 3_600_000_000_000
            stamp.sec, stamp.nanosec = divmod(
                stamp.sec * 1_000_000_000 + stamp.nanosec + shift, 1_000_000_000)
        elif fault == 'angle_jumps':
            message.position[0] -= 8.0
        elif fault == 'angle_far':
            message.position[0] += 500.0
        elif fault == 'angle_glitches' and self._count % GLITCH == 0:
            message.position[0] += 30.0
        elif fault == 'angle_nan':
            message.position[0] = math.nan
        elif fault in ('angle_stuck', 'seized'):
            if math.isnan(self._frozen_angle):
                self._frozen_angle = message.position[0]
            message.position[0], message.velocity[0] = self._frozen_angle, 0.0
        elif fault == 'no_effort':
            message.effort[0] = math.nan
        elif fault == 'velocity_reversed':
            message.velocity[0] = -message.velocity[0]
        elif fault == 'velocity_none':
            message.velocity[0] = 0.0
        elif fault == 'effort_infinite':
            message.effort[0] = math.inf
        return True

    def _torque(self, torque: float) -> float:
        """Return what the drive gives of a command [N·m]."""
        fault = self.values['fault']
        if fault == 'off' or (fault == 'deaf_for_a_second'
                              and (self._count - self._since) * self._brake.period < 1.0):
            return 0.0
        return {'weak': 0.4 * torque, 'reversed': -torque, 'stuck': 0.6,
                'biased': torque + 0.4}.get(fault, torque)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(SpoiltDriveNode, args)


if __name__ == '__main__':
    sys.exit(main())
