# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""No single message or service call ends a controller that holds the brake."""

import contextlib
import random

from builtin_interfaces.msg import Time
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
import pytest
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Header, String, UInt64

from engb_ros.files import config_file, TRUE_BRAKE
from engb_ros.interface import (
    CLAMP_FORCE_COMMAND,
    CLAMP_FORCE_COMMAND_STAMPED,
    CONTROLLER_ACTIVATION,
    DISC_SPEED,
    DISTURBANCE,
    DRIVE_STATE,
    JOINT_STATES,
    POSITION_COMMAND,
    POSITION_COMMAND_STAMPED,
    Service,
)
from engb_ros.nodes.messages import publisher_qos
from ros.loops import closed_loop

CHANGE_STATE = Service('~/change_state', 'lifecycle_msgs/srv/ChangeState', '')

# Transitions that an active node has not: configure, cleanup, activate, the shutdowns of other
# states, and numbers that are none.
NOT_POSSIBLE = (1, 2, 3, 5, 6, 0, 8, 97, 255)

LARGEST = 2**31 - 1
STAMPS = (Time(), Time(sec=-2**31), Time(sec=LARGEST, nanosec=2**32 - 1))
NUMBERS = (float('nan'), float('inf'), -float('inf'), 1e308, -1e308)


def joint_states():
    """Yield joint states that no drive and no stack sends."""
    for stamp in STAMPS:
        header = Header(stamp=stamp, frame_id='x' * 10_000)
        yield JointState(header=header)
        yield JointState(header=header, name=['motor', 'clamp', 'counter'])
        yield JointState(header=header, name=['motor'], velocity=[1.0], effort=[1.0])
        yield JointState(header=header, name=['motor'] * 1000, position=[3.0] * 999)
        for number in NUMBERS:
            yield JointState(header=header, name=['motor', 'clamp', 'counter'],
                             position=[number] * 3, velocity=[number], effort=[number] * 3)


def messages():
    """Yield (topic, message)."""
    for topic in (JOINT_STATES, POSITION_COMMAND_STAMPED, CLAMP_FORCE_COMMAND_STAMPED):
        for message in joint_states():
            yield topic, message
    for topic in (POSITION_COMMAND, CLAMP_FORCE_COMMAND, DISC_SPEED, DISTURBANCE):
        for number in NUMBERS:
            yield topic, Float64(data=number)
    for text in ('', 'x' * 100_000, '\x00', 'obeys\n'):
        yield DRIVE_STATE, String(data=text)
    for claim in (0, 2**64 - 1):
        yield CONTROLLER_ACTIVATION, UInt64(data=claim)


def damaged():
    """Yield (topic, its class, bytes that are no message of it)."""
    chance = random.Random(1)
    state = JointState(name=['motor', 'clamp'], position=[1.0, 2.0], velocity=[1.0, 2.0],
                       effort=[1.0, 2.0])
    for topic, message in (
            (JOINT_STATES, state), (POSITION_COMMAND_STAMPED, state),
            (CLAMP_FORCE_COMMAND_STAMPED, state), (POSITION_COMMAND, Float64(data=20.0)),
            (DISC_SPEED, Float64(data=1.0)), (DRIVE_STATE, String(data='obeys')),
            (CONTROLLER_ACTIVATION, UInt64(data=1))):
        good = bytes(serialize_message(message))
        yield topic, type(message), b''
        for end in (3, 4, 6, len(good) - 3):
            yield topic, type(message), good[:end]
        for head in (b'\x00\x07\x00\x00', b'\xff' * 4):
            yield topic, type(message), head + good[4:]
        yield topic, type(message), good[:4] + b'\xff' * (len(good) - 4)
        yield topic, type(message), good + b'\xff' * 50
        for _ in range(20):
            spoilt = bytearray(good)
            for _ in range(3):
                spoilt[chance.randrange(4, len(good))] = chance.randrange(256)
            yield topic, type(message), bytes(spoilt)


def requests():
    """Yield (service, request)."""
    values = [ParameterValue(), ParameterValue(type=99), ParameterValue(type=3),
              ParameterValue(type=4, string_value='\x00' * 10), ParameterValue(type=9),
              ParameterValue(type=3, double_value=float('nan'))]
    for name in ('', 'p', 'nothing', 'x' * 10_000, 'autostart', 'model', 'use_sim_time'):
        yield 'GetParameters', GetParameters.Request(names=[name])
        yield 'GetParameterTypes', GetParameterTypes.Request(names=[name])
        yield 'DescribeParameters', DescribeParameters.Request(names=[name])
        yield 'ListParameters', ListParameters.Request(prefixes=[name], depth=2**63)
        for value in values:
            parameters = [Parameter(name=name, value=value)]
            yield 'SetParameters', SetParameters.Request(parameters=parameters)
            yield 'SetParametersAtomically', SetParametersAtomically.Request(
                parameters=parameters)


def service_of(kind):
    """Return the node's service of a kind."""
    word = ''.join(f'_{letter.lower()}' if letter.isupper() else letter for letter in kind)
    return Service(f'~/{word[1:]}', f'rcl_interfaces/srv/{kind}', '')


@pytest.fixture
def loop(runner, probe):
    """A brake that is applied, and at the end still is."""
    made = closed_loop(runner, probe, model=str(TRUE_BRAKE),
                       mechanism=str(config_file('mechanism.yaml')))
    made.go(20.0)
    yield made
    runner.check()
    made.until(lambda: not made.is_in('fault') or made.clear().success, 'a healthy loop')
    made.go(20.0)
    assert made.efforts[-1].data > 0.03
    runner.stop()


def test_a_transition_that_is_not_possible_is_refused(loop, probe):
    for number in NOT_POSSIBLE:
        request = ChangeState.Request(transition=Transition(id=number))
        assert not probe.call('controller', CHANGE_STATE, request=request).success
        loop.pump()
    request = ChangeState.Request(transition=Transition(label='brake'))
    assert not probe.call('controller', CHANGE_STATE, request=request).success


def test_no_request_of_parameters_ends_the_controller(loop, probe):
    for kind, request in requests():
        probe.call('controller', service_of(kind), request=request)
        loop.pump()


def test_no_damaged_bytes_end_the_controller(loop, probe):
    publishers = {}
    for topic, kind, data in damaged():
        if topic not in publishers:
            publishers[topic] = probe.node.create_publisher(kind, topic.name, publisher_qos(topic))
            loop.during(0.3)
        with contextlib.suppress(RuntimeError):   # some are too few for the own side to send
            publishers[topic].publish(data)
        loop.during(0.02)
        loop.runner.check()
    for publisher in publishers.values():
        probe.node.destroy_publisher(publisher)


def test_no_message_ends_the_controller(loop, probe):
    node, publishers = probe.node, {}
    for topic, message in messages():
        if topic not in publishers:
            publishers[topic] = node.create_publisher(type(message), topic.name, 10)
            loop.during(0.3)
        publishers[topic].publish(message)
        loop.during(0.02)
        loop.runner.check()
    for publisher in publishers.values():   # a second one degrades
        node.destroy_publisher(publisher)


def test_a_time_below_nought_ends_no_node(runner, probe):
    """rclpy cannot take it: one message on /clock had ended every node with `use_sim_time`."""
    nodes = ('plant', 'controller', 'disturbance_observer', 'excitation')
    for name in nodes:
        runner.start(name, parameters={'use_sim_time': True})
    publisher = probe.node.create_publisher(Clock, '/clock', 1)
    runner.wait_until(lambda: publisher.get_subscription_count() >= len(nodes), 'all to listen',
                      pause=probe.spin)
    for number in (-5, -2**31, 7):
        publisher.publish(Clock(clock=Time(sec=number)))
        probe.spin(0.2)
        runner.check()
    for name in nodes:
        assert probe.call(name, Service('~/get_state', 'lifecycle_msgs/srv/GetState', ''))
    runner.stop()


def test_no_message_of_the_only_drive_ends_the_controller(runner, probe):
    """Where the test is the drive, whose messages count."""
    runner.start('controller')
    publisher = probe.advertise(JOINT_STATES)
    runner.wait_until(publisher.get_subscription_count, 'the controller', pause=probe.spin)
    spoilt = [data for topic, _, data in damaged() if topic is JOINT_STATES]
    whole = [message for topic, message in messages() if topic is JOINT_STATES]
    for message in (*whole, *spoilt):
        with contextlib.suppress(RuntimeError):   # some are too few for the own side to send
            publisher.publish(message)
        probe.spin(0.01)
        runner.check()
    assert probe.call('controller', Service('~/get_state', 'lifecycle_msgs/srv/GetState', ''))
    runner.stop()
