# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A subscription that knows whose each message is, as rclpy's on Jazzy does not."""

import contextlib
import os
import struct
import subprocess
import sys
import time

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import Float64

from engb_ros.interface import EFFORT_COMMAND
from engb_ros.nodes.base import make_executor, ManagedNode


class Listener(ManagedNode):
    node_name = 'listener'

    def configure(self, values):
        self.heard = []
        self.topic = self.listen_by_publisher(
            EFFORT_COMMAND, lambda message, publisher: self.heard.append((message, publisher))
        ).topic_name


@pytest.fixture(params=[make_executor, lambda context: SingleThreadedExecutor(context=context)],
                ids=['events', 'single'])
def graph(domain, request):
    """A listener, another node, and what lets both work until something is true."""
    context = rclpy.Context()
    context.init(domain_id=domain)
    listener = Listener(context=context, namespace='/engb', cli_args=[
        '--ros-args', '-r', 'effort_command:=torque'])
    other = rclpy.create_node('other', context=context, namespace='/engb')
    executor = request.param(context)
    executor.add_node(listener)
    executor.add_node(other)

    def until(condition):
        end = time.monotonic() + 20.0
        while not condition():
            assert time.monotonic() < end
            executor.spin_once(timeout_sec=0.01)
            listener.destroy_silenced()

    yield listener, other, until
    executor.shutdown()
    listener.destroy_node()
    other.destroy_node()
    context.try_shutdown()


def publishers_of(node, until, count):
    """Return publishers that all are heard."""
    made = [node.create_publisher(Float64, 'torque', 1) for _ in range(count)]
    until(lambda: all(one.get_subscription_count() for one in made))
    return made


def test_each_message_comes_with_its_publisher_as_the_graph_names_it(graph):
    listener, other, until = graph
    listener.trigger_configure()
    assert listener.topic == '/engb/torque'
    publishers = publishers_of(other, until, 3)
    for index, number in enumerate((0, 1, 2, 1, 0, 0)):
        publishers[number].publish(Float64(data=float(number)))
        until(lambda index=index: len(listener.heard) > index)
    named = {bytes(entry.endpoint_gid)
             for entry in listener.get_publishers_info_by_topic('/engb/torque')}
    by_number = {message.data: publisher for message, publisher in listener.heard}
    assert set(by_number.values()) == named and len(named) == 3
    assert all(by_number[message.data] == publisher for message, publisher in listener.heard)


def test_nobody_hides_what_another_one_said_by_speaking_right_after_it(graph):
    listener, other, until = graph
    listener.trigger_configure()
    first, second = publishers_of(other, until, 2)
    for number in range(1, 20):
        first.publish(Float64(data=float(number)))
        for _ in range(10):
            second.publish(Float64(data=-float(number)))
        until(lambda number=number: {message.data for message, _ in listener.heard}
              >= {float(number), -float(number)})


def test_bytes_that_are_no_message_are_left_out(graph):
    listener, other, until = graph
    listener.trigger_configure()
    publisher, = publishers_of(other, until, 1)
    for spoilt in (b'\x00\x01\x00\x00\x00', b'\xff' * 12, b'\x00\x01\x00\x00' + 500 * b'\xff'):
        with contextlib.suppress(RuntimeError):   # some are too few for the own side to send
            publisher.publish(spoilt)
        publisher.publish(b'\x00\x01\x00\x00' + struct.pack('<d', 2.0))
        until(lambda: listener.heard and listener.heard[-1][0].data == 2.0)
        listener.heard.clear()


def test_what_was_given_back_hears_nothing_and_may_be_made_anew(graph):
    listener, other, until = graph
    for _ in range(3):
        listener.trigger_configure()
        publisher, = publishers_of(other, until, 1)
        publisher.publish(Float64(data=1.0))
        until(lambda: listener.heard)
        publisher.publish(Float64(data=1.0))
        listener.trigger_cleanup()
        until(lambda publisher=publisher: not publisher.get_subscription_count())
        other.destroy_publisher(publisher)
        assert not listener.count_subscribers('/engb/torque')


def test_where_rcl_cannot_be_asked_every_message_is_heard(graph, monkeypatch):
    def missing(name):
        raise OSError(f'{name}: cannot open shared object file')

    monkeypatch.setattr('engb_ros.nodes.known_publisher.ctypes.CDLL', missing)
    listener, other, until = graph
    listener.trigger_configure()
    assert listener.topic == '/engb/torque'
    publisher, = publishers_of(other, until, 1)
    publisher.publish(Float64(data=1.0))
    until(lambda: listener.heard)
    assert listener.heard[0][0].data == 1.0 and listener.heard[0][1] is None


# In a process of its own: what is tested would end this one.
FLOODED = """
import threading, time
import rclpy
from std_msgs.msg import Float64
from engb_ros.interface import EFFORT_COMMAND
from engb_ros.nodes.base import make_executor, ManagedNode


class Listener(ManagedNode):
    node_name = 'listener'

    def configure(self, values):
        self.listen_by_publisher(EFFORT_COMMAND, lambda *told: heard.append(told), raw=True)


heard = []
rclpy.init()
node, other = Listener(), rclpy.create_node('other')
publisher = other.create_publisher(Float64, 'effort_command', 10)
executor = make_executor()
executor.add_node(node)
stop = threading.Event()


def flood():
    while not stop.wait(2e-4):
        publisher.publish(Float64())


thread = threading.Thread(target=flood)
thread.start()


def spin(seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        executor.spin_once(timeout_sec=0.005)
        node.destroy_silenced(0.05)


for _ in range(40):
    before = len(heard)
    node.trigger_configure()
    while len(heard) == before:
        spin(0.02)
    node.trigger_cleanup()
    spin(0.03)
stop.set()
thread.join()
spin(0.1)
assert not node._silenced
print('heard', len(heard) > 0)
"""


def test_giving_a_subscription_back_while_messages_come_ends_no_process(domain):
    """An event of it in the executor's queue had ended a controller in a segmentation fault."""
    done = subprocess.run([sys.executable, '-c', FLOODED], capture_output=True, text=True,
                          timeout=120, check=False,
                          env={**os.environ, 'ROS_DOMAIN_ID': str(domain)})
    assert done.returncode == 0, done.stderr
    assert 'heard True' in done.stdout
