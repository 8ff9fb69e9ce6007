# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The joint's name by parameter, and torque commands that come as JointState (ros2_control)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
import math
from time import monotonic
from typing import Any, TYPE_CHECKING

from sensor_msgs.msg import JointState

from engb_core.control.publisher_watch import PublisherWatch
from engb_core.control.sample_watch import SampleWatch
from engb_core.model import Model
from engb_ros import interface
from engb_ros.nodes.messages import joint_sample, JointSample
from engb_ros.nodes.parameters import ParameterSpec

if TYPE_CHECKING:
    from engb_ros.nodes.base import ManagedNode

__all__ = ['EFFORT_SOURCE', 'HARDWARE_ID', 'JOINT', 'JointListener', 'joint_effort',
           'listen_for_effort', 'with_joint']

JOINT = ParameterSpec('joint', '', 'name of the joint, where several brakes share a robot '
                      'description; empty: the model file\'s')
HARDWARE_ID = ParameterSpec('hardware_id', '', 'of the drive, in /diagnostics; empty: the '
                            'namespace')
EFFORT_SOURCE = ParameterSpec(
    'effort_source', 'effort_command', 'which topic the torque comes from: effort_command '
    '(Float64), or joint_command (JointState, as ros2_control\'s joint_state_topic_'
    'hardware_interface sends it); never both', choices=('effort_command', 'joint_command'))


def with_joint(model: Model, values: dict[str, Any]) -> Model:
    """Return the model with the joint's name that parameter `joint` gives.

    Raises:
        InputError: its friction is negative.
    """
    model.refuse_negative_friction()
    name = values['joint']
    return replace(model, joint=replace(model.joint, name=name)) if name else model


class JointListener:
    """Takes one joint out of what is heard, and says once in the log if it is not there.

    Args:
        node: who listens.
        joint: the joint's name.

    Attributes:
        name: the joint's.
    """

    def __init__(self, node: ManagedNode, joint: str) -> None:
        self.name = joint
        self._watch = SampleWatch(joint)
        self._node = node

    def sample(self, message: JointState) -> JointSample | None:
        """Return the joint's sample in a message; None where it holds none."""
        found = joint_sample(message, self.name)
        if found is None:
            self.other(message.name)
        else:
            self.present()
        return found

    def present(self) -> None:
        """Note a message that holds the joint."""
        self._watch.present(monotonic())

    def other(self, names: Sequence[str]) -> None:
        """Note a message without the joint."""
        if words := self._watch.other(monotonic(), names):
            self._node.get_logger().warning(words)


def joint_effort(message: JointState, joint: str) -> float:
    """Return the effort of `joint` [N·m]; NaN where the message holds none."""
    try:
        return float(message.effort[message.name.index(joint)])
    except (ValueError, IndexError):
        return math.nan


def listen_for_effort(node: ManagedNode, values: dict[str, Any], joint: str,
                      callback: Callable[[float], None], ignored: Callable[[], None]) -> None:
    """Call `callback` with each torque [N·m] that comes from the source of the parameters, of one
    publisher at a time (`PublisherWatch`), and `ignored` where it is another one's."""
    watch = PublisherWatch(values['command_timeout'], values['effort_limit'])
    by_joint = values['effort_source'] == 'joint_command'

    def on_command(message: Any, publisher: bytes | None) -> None:
        torque = joint_effort(message, joint) if by_joint else message.data
        if not watch.obeys(monotonic(), torque, publisher):
            if node.count_publishers(topic) > 1:
                ignored()
                return
            watch.forget()   # there is nobody else any more
        callback(torque)

    topic = node.listen_by_publisher(
        interface.JOINT_COMMAND if by_joint else interface.EFFORT_COMMAND, on_command).topic_name
