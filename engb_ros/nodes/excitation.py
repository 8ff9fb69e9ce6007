# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Node `excitation`: drives the motor open loop, for step and sweep tests of the nominal plant.

Only for a motor that may turn freely: it answers every sample with a torque, whatever the angle.
"""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

from sensor_msgs.msg import JointState

from engb_core.control.excitation import Excitation, EXCITATIONS, ExcitationSettings
from engb_ros import interface
from engb_ros.nodes.base import ManagedNode, run
from engb_ros.nodes.messages import scalar, StampClock
from engb_ros.nodes.parameters import ParameterSpec

__all__ = ['ExcitationNode', 'main']

DEFAULT = ExcitationSettings()


class ExcitationNode(ManagedNode):
    """Publishes `effort_command`, one for each sample of `joint_states`.

    It lets go (torque 0) when the excitation is over, when it is deactivated, and as soon as the
    motor turns faster than `highest_speed`.
    """

    node_name = 'excitation'
    parameters = (
        ParameterSpec('kind', DEFAULT.kind, 'what to excite with', choices=EXCITATIONS),
        ParameterSpec('amplitude', DEFAULT.amplitude, 'of the torque', 'N·m', 0.0, 1e3),
        ParameterSpec('hold', DEFAULT.hold, 'how long each step is held', 's', 0.0, 1e3),
        ParameterSpec('first_frequency', DEFAULT.first_frequency, 'where the sweep begins', 'Hz',
                      0.0, 1e4),
        ParameterSpec('last_frequency', DEFAULT.last_frequency, 'where it ends', 'Hz', 0.0, 1e4),
        ParameterSpec('duration', DEFAULT.duration, 'of the whole', 's', 0.0, 1e4),
        ParameterSpec('highest_speed', 500.0, 'beyond it the motor is let go', 'rad/s', 0.0, 1e5),
    )

    def configure(self, values: dict[str, Any]) -> None:
        """Build the excitation."""
        names = ExcitationSettings.__dataclass_fields__
        self._excitation = Excitation(ExcitationSettings(**{name: values[name]
                                                            for name in names}))
        self._stamps = StampClock()
        self._begin: float | None = None
        self._fast = False
        self._publish = self.advertise(interface.EFFORT_COMMAND).publish
        self.listen(interface.JOINT_STATES, self._on_joint_states)

    def start(self) -> None:
        """Begin with the next sample."""
        self._begin = None
        self._fast = False

    def stop(self) -> None:
        """Send a last command: no torque."""
        self._publish(scalar(0.0))

    def _on_joint_states(self, message: JointState) -> None:
        if not self.active:
            return
        time = self._stamps.seconds(message.header.stamp)
        if self._begin is None:
            self._begin = time
        speed = message.velocity[0] if len(message.velocity) else 0.0
        if math.isfinite(speed) and abs(speed) > self.values['highest_speed'] and not self._fast:
            self._fast = True
            self.get_logger().error(f'{speed:.0f} rad/s is too fast; the motor is let go')
        torque = 0.0 if self._fast else self._excitation.torque(time - self._begin)
        self._publish(scalar(torque))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(ExcitationNode, args)
