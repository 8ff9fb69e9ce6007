# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whoever speaks right after the stack does not hide what the stack says."""

import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from engb_ros.interface import POSITION_COMMAND, POSITION_COMMAND_STAMPED
from engb_ros.nodes.messages import publisher_qos
from ros.stepped import Stepped

# Whoever is silent for so long counts as silent [s]: longer than a busy computer stalls, as the
# watchdogs are none of what is tested here.
SILENT = 1.5


@pytest.fixture
def stepped(domain):
    """A controller that may speak."""
    with Stepped(domain, state_timeout=SILENT, command_timeout=SILENT) as made:
        made.sample()
        made.spin(0.6)   # it listens for half a second before it may speak
        yield made


def two(stepped, topic, kind):
    """Return publishers of a topic: the stack's and a stranger's."""
    made = [stepped.node.create_publisher(kind, topic.name, publisher_qos(topic))
            for _ in range(2)]
    for publisher in made:
        stepped.until(lambda publisher=publisher: publisher.get_subscription_count())
    stepped.until(lambda: stepped.controller.count_publishers(topic.name) == 2)
    stepped.spin(0.2)   # the controller has looked at the graph
    return made


def told(stepped, messages):
    """Send `messages()`, (publisher, message) each, all at once; again until who is not read
    counts as silent."""
    for number in range(100):
        for publisher, message in messages(number):
            publisher.publish(message)
        stepped.spin(0.02)
        stepped.sample()
    return stepped.controller._controller


def test_of_two_nameless_publishers_the_highest_request_counts_whoever_spoke_last(stepped):
    """The controller had read the newest one only: on a busy computer the stack's were hidden."""
    stack, stranger = two(stepped, POSITION_COMMAND, Float64)
    controller = told(stepped, lambda number: (
        (stack, Float64(data=20.0)), (stranger, Float64(data=3.0))))
    assert controller.source.target == 20.0


def test_a_stranger_who_speaks_last_is_not_obeyed_in_the_stacks_place(stepped):
    """The stack, of whom nothing was read, counted as silent."""
    stack, stranger = two(stepped, POSITION_COMMAND_STAMPED, JointState)

    def message(value, source, number):
        made = JointState(name=['motor', 'counter'], position=[value, float(number)])
        made.header.frame_id = source
        made.header.stamp = stepped.node.get_clock().now().to_msg()
        return made

    told(stepped, lambda number: ((stack, message(20.0, 'stack', number)),))
    controller = told(stepped, lambda number: (
        (stack, message(20.0, 'stack', 100 + number)),
        (stranger, message(3.0, 'stranger', number))))
    assert controller.source.target == 20.0
    assert controller.supervisor.commands.source == 'stack'
