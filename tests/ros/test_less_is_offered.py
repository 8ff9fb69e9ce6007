# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Publishers that offer less than a node asks for, several at a time, end no node."""

import pytest
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import UInt64

from engb_ros.interface import CONTROLLER_ACTIVATION, JOINT_STATES

OFFERED = {'disturbance_observer': (JOINT_STATES, JointState),
           'controller': (CONTROLLER_ACTIVATION, UInt64)}


@pytest.mark.parametrize('name', OFFERED)
def test_who_offers_less_ends_no_node(runner, probe, name):
    topic, kind = OFFERED[name]
    process = runner.start(name)
    runner.wait_until(lambda: probe.subscribers(topic), 'the node', pause=probe.spin)
    less = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    for _ in range(8):
        probe.node.create_publisher(kind, topic.name, less)
    runner.wait_until(lambda: 'is read best effort' in process.output, 'the word',
                      pause=probe.spin)
    for _ in range(20):
        probe.spin(0.05)
    runner.stop()   # which says so where it has ended
