# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A controller's node inside the test's process, step by step."""

import gc
import threading
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from engb_ros.interface import EFFORT_COMMAND, JOINT_STATES
from engb_ros.nodes.controller import ControllerNode
from engb_ros.nodes.messages import publisher_qos


class Stepped:
    """A controller, and one node in the place of its drive, its stack and other controllers, in
    this process: each thing happens when the test says so. A context manager.

    Args:
        domain: ROS_DOMAIN_ID.
        with_primary: the other node publishes torque, as a primary does. A controller that is not
            its standby yields to it a second later, as it never says who it is.
        parameters: of the controller.
    """

    def __init__(self, domain, with_primary=False, **parameters):
        self._threads = threading.active_count()
        self.context = rclpy.Context()
        self.context.init(domain_id=domain)
        self.node = rclpy.create_node('others', context=self.context, namespace='/engb')
        if with_primary:
            self.node.create_publisher(
                Float64, EFFORT_COMMAND.name, publisher_qos(EFFORT_COMMAND))
        self.states = self.node.create_publisher(
            JointState, JOINT_STATES.name, publisher_qos(JOINT_STATES))
        self.heard = []
        self.node.create_subscription(Float64, EFFORT_COMMAND.name, self.heard.append, 100)
        self.controller = ControllerNode(
            context=self.context, namespace='/engb',
            parameter_overrides=[Parameter(name, value=value) for name, value in
                                 {**parameters, 'autostart': False}.items()])
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.controller)
        self.executor.add_node(self.node)
        self.controller.trigger_configure()
        self.controller.trigger_activate()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        threads = self._threads
        self.close()
        assert threading.active_count() <= threads

    def close(self):
        """Leave the graph."""
        self.executor.shutdown()
        self.controller.destroy_node()
        self.node.destroy_node()
        self.context.try_shutdown()
        # rclpy keeps the services of a node's states until it is collected: the next test's calls
        # of `controller` would go to this one, which does not answer.
        self.__dict__.clear()
        gc.collect()

    def sample(self):
        """Give the controller a joint state: of a drive that gives what it was asked for last."""
        effort = self.heard[-1].data if self.heard else 0.1
        message = JointState(name=['motor'], position=[20.0], velocity=[0.0], effort=[effort])
        message.header.stamp = self.node.get_clock().now().to_msg()
        self.controller._on_joint_states(bytes(serialize_message(message)))

    def spin(self, seconds=0.02):
        """Let both nodes work."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.005)

    def until(self, condition):
        """Wait for `condition`."""
        end = time.monotonic() + 30.0
        while not condition():
            assert time.monotonic() < end
            self.spin()
