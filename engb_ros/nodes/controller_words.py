# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What node `controller` says of itself: state, causes, diagnostics, and its log."""

from __future__ import annotations

from time import monotonic

from rclpy.duration import Duration
from std_msgs.msg import String, UInt32

from engb_core.control.brake_controller import BrakeController
from engb_core.control.causes import Cause, State
from engb_core.io.bags.cdr import parse_joint_state
from engb_core.io.bags.compression import Damaged
from engb_ros import interface
from engb_ros.nodes.base import ManagedNode
from engb_ros.nodes.diagnostics import controller_status, DiagnosticMessage, WARN

__all__ = ['ControllerWords']

# Several joint states of another joint are no chance [messages].
_SEVERAL = 10

# Of a message with many joints so many are named.
_NAMES = 4


class ControllerWords:
    """Publishes state and causes, which stay in the graph for who joins later, and diagnostics.

    Args:
        node: whose words these are.
        controller: of which they speak.
        hardware_id: of the drive, for diagnostics.
    """

    def __init__(self, node: ManagedNode, controller: BrakeController, hardware_id: str) -> None:
        self._node, self._controller = node, controller
        self._diagnostic = DiagnosticMessage(
            f'{node.get_namespace().strip("/")}: {node.get_name()}', hardware_id)
        self._state = node.advertise(interface.CONTROLLER_STATE)
        self._causes = node.advertise(interface.CONTROLLER_CAUSES)
        self._diagnostics = node.advertise(interface.DIAGNOSTICS)
        self._wrong_joint = 0
        self._told: tuple[State, int, bool] | None = None

    def tell_changes(self) -> None:
        """Publish the state if it has changed."""
        if self._told != self._now():
            self.tell()

    def _now(self) -> tuple[State, int, bool]:
        supervisor = self._controller.supervisor
        return supervisor.state, supervisor.stopping, supervisor.too_slow

    def tell(self) -> None:
        """Publish the state now, and put into the log what has changed."""
        supervisor, logger = self._controller.supervisor, self._node.get_logger()
        before, self._told = self._told, self._now()
        self._state.publish(String(data=supervisor.state.value))
        self.diagnose()
        if before is None or before[1:] == self._told[1:]:
            return
        if supervisor.latched:
            logger.error('fault: ' + ', '.join(
                cause.key for cause in Cause if supervisor.latched & cause))
        elif supervisor.stopping:
            logger.warning(f'{supervisor.waits_for}; until then there is no torque, and no '
                           'command is taken')

    def hear_wrong_joint(self, message: bytes, joint: str) -> None:
        """Say once that the drive tells of another joint, while it has told nothing of `joint`;
        one message may be of somebody else on the topic."""
        if self._controller.supervisor.states.seen:
            return
        self._wrong_joint += 1
        if self._wrong_joint != _SEVERAL:
            return
        try:
            names = ', '.join(map(repr, parse_joint_state(message).names[:_NAMES])) or 'no joint'
        except Damaged:
            names = 'no joint that can be read'
        self._node.get_logger().warning(
            f'joint_states tell of {names}, and nothing of {joint!r}, the joint that this '
            'controller drives: give both the same parameter joint; until then there is no torque')

    def diagnose(self) -> None:
        """Publish causes and diagnostics."""
        now = monotonic()
        self._causes.publish(UInt32(data=int(self._controller.supervisor.active(now))))
        self._publish_diagnostics(*controller_status(self._controller, now))

    def say_inactive(self, longest: float) -> None:
        """Say as the last word that no torque is given any more: who joins later hears it, and
        not what held before. It is given so long to arrive [s]."""
        self._told = None
        self._state.publish(String(data=State.INACTIVE.value))
        self._causes.publish(UInt32(data=0))
        self._publish_diagnostics(WARN, State.INACTIVE.value, {'state': State.INACTIVE.value})
        end = monotonic() + longest
        for publisher in (self._state, self._causes):
            publisher.wait_for_all_acked(Duration(seconds=max(end - monotonic(), 0.0)))

    def _publish_diagnostics(self, level: int, text: str, values: dict[str, str]) -> None:
        self._diagnostics.publish(self._diagnostic.fill(
            self._node.get_clock().now().to_msg(), level, text, values))
