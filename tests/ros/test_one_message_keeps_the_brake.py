# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""One well-formed message of a stranger takes no braking away: as shipped, on every topic."""

from builtin_interfaces.msg import Time
import pytest
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String, UInt64

from engb_ros.interface import (
    ACCEPT_MODEL,
    CLAMP_FORCE_COMMAND,
    CLAMP_FORCE_COMMAND_STAMPED,
    CLEAR_FAULTS,
    CONTROLLER_ACTIVATION,
    DISC_SPEED,
    DRIVE_STATE,
    EFFORT_COMMAND,
    JOINT_STATES,
    POSITION_COMMAND,
    POSITION_COMMAND_STAMPED,
    Service,
    START_REFERENCE,
)
from engb_ros.nodes.messages import publisher_qos
from ros.test_as_shipped import Shipped

# The brake may let go by so much while the next true message is under way.
ANGLE = 1.0

# What one message brings about shows by then [s].
SHOWS = 0.5


def stamp(probe, shift=0.0):
    return Time(sec=(now := probe.node.get_clock().now().nanoseconds + int(1e9 * shift))
                // 10**9, nanosec=now % 10**9)


def sample(loop, shift=0.0, position=0.0, velocity=0.0, effort=0.0):
    """Return a joint state that differs from the newest one in something."""
    message = JointState(name=['motor'], position=[loop.position + position],
                         velocity=[] if velocity is None else [velocity],
                         effort=[loop.effort + effort])
    message.header.stamp = stamp(loop.probe, shift)
    return message


def request(loop, entry, source, shift=0.0):
    message = JointState(name=[entry], position=[0.0], effort=[0.0])
    message.header.stamp, message.header.frame_id = stamp(loop.probe, shift), source
    return message


RESTORED = {'p': 0.4, 'i': 1.5, 'd': 0.006, 'error_deadband': 0.0, 'derivative_filter_time': 0.0,
            'load_feedforward': True}

MESSAGES = {
    **{f'torque measured {effort:g}': (JOINT_STATES, lambda loop, effort=effort: sample(
        loop, effort=effort)) for effort in (1e5, -1e5, 5.0, -5.0)},
    **{f'speed {velocity:g}': (JOINT_STATES, lambda loop, velocity=velocity: sample(
        loop, velocity=velocity)) for velocity in (399.0, -399.0, 1e5, -1e5)},
    'speed 399, stamped ahead': (JOINT_STATES, lambda loop: sample(
        loop, shift=0.09, velocity=399.0)),
    **{f'angle off by {angle}, no speed': (JOINT_STATES, lambda loop, angle=angle: sample(
        loop, position=angle, velocity=None)) for angle in (1.5, -1.5)},
    **{f'angle off by {angle}, and its speed': (JOINT_STATES, lambda loop, angle=angle: sample(
        loop, position=angle, velocity=266.0 * angle)) for angle in (1.5, -1.5)},
    **{f'angle off by {angle}': (JOINT_STATES, lambda loop, angle=angle: sample(
        loop, position=angle)) for angle in (1.5, -1.5, 10.0, -10.0, 1e5)},
    **{f'stamp off by {shift}': (JOINT_STATES, lambda loop, shift=shift: sample(
        loop, shift=shift)) for shift in (0.09, -0.09, 1.0, -1.0, 3600.0)},
    **{f'the drive {word}': (DRIVE_STATE, lambda loop, word=word: String(data=word))
       for word in ('refuses', 'holds_on', 'lost', 'off')},
    'angle 0': (POSITION_COMMAND, lambda loop: Float64(data=0.0)),
    'force 0': (CLAMP_FORCE_COMMAND, lambda loop: Float64(data=0.0)),
    **{f'stamped angle 0 of {source!r}, {shift}': (
        POSITION_COMMAND_STAMPED, lambda loop, source=source, shift=shift: request(
            loop, 'motor', source, shift)) for source in ('', 'stack') for shift in (0.0, 0.2)},
    'stamped force 0': (CLAMP_FORCE_COMMAND_STAMPED, lambda loop: request(loop, 'clamp', 'x')),
    **{f'disc {speed}': (DISC_SPEED, lambda loop, speed=speed: Float64(data=speed))
       for speed in (1e4, -1e4)},
    **{f'torque {torque}': (EFFORT_COMMAND, lambda loop, torque=torque: Float64(data=torque))
       for torque in (0.0, 0.75, -0.75, 1e6)},
    'claim': (CONTROLLER_ACTIVATION, lambda loop: UInt64(data=1)),
}


def lost(loop, publisher, topic, make):
    """Send one message; return what it took away, or nothing."""
    before, begin, counted = loop.position, len(loop.states), len(loop.state)
    forged = make(loop)
    publisher.publish(forged)
    loop.during(SHOWS)
    angles = [message.position[0] for message in loop.states[begin:]
              if message.header.stamp != getattr(forged, 'header', message.header).stamp
              or topic is not JOINT_STATES]
    let_go = before - min(angles)
    if any(message.data == 'fault' for message in loop.state[counted:]):
        return 'fault'
    return f'{let_go:.2f} rad' if let_go > ANGLE else ''


def applied(loop, by):
    """Apply the brake."""
    if by == 'force':
        loop.clamp(6000.0)
    else:
        loop.target = 20.0
        loop.reach(lambda: abs(loop.position - 20.0) < 0.3, 'the brake')


def stranger(loop, topic, kind):
    """Return a publisher that the others have found."""
    made = loop.probe.node.create_publisher(kind, topic.name, publisher_qos(topic))
    loop.until(lambda: made.get_subscription_count() > 0, 'a subscription')
    loop.during(0.3)
    return made


@pytest.mark.parametrize('by', ['force', 'angle'])
def test_one_message_takes_no_braking_away(runner, probe, tmp_path, by):
    loop = Shipped(runner, probe, tmp_path)
    found = {}
    for topic in dict.fromkeys(topic for topic, _ in MESSAGES.values()):
        publisher = None
        for name, make in ((name, make) for name, (its, make) in MESSAGES.items() if its is topic):
            for _ in range(3):   # a busy computer takes braking away too, but not each time
                if publisher is None:
                    applied(loop, by)
                    publisher = stranger(loop, topic, type(make(loop)))
                took = lost(loop, publisher, topic, make)
                if not took:
                    found.pop(name, None)
                    break
                found[name] = took
                print(name, took, loop.words(), flush=True)
                probe.node.destroy_publisher(publisher)
                publisher = None
        if publisher is not None:
            probe.node.destroy_publisher(publisher)
    assert not found
    runner.stop()


def changes(**values):
    """Return parameters, all of one request."""
    return [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]


NO_GAINS = {'p': 0.0, 'i': 0.0, 'd': 0.0, 'load_feedforward': False}
REQUESTS = {
    'clear': ('controller', CLEAR_FAULTS, None),
    'start of a trajectory that there is none': ('controller', START_REFERENCE, None),
    'model that there is none': ('controller', ACCEPT_MODEL, None),
    **{f'parameters {values}, {kind.__name__}': (
        'controller', Service(f'~/{name}', f'rcl_interfaces/srv/{kind.__name__}', ''),
        kind.Request(parameters=changes(**values)))
       for name, kind in (('set_parameters', SetParameters),
                          ('set_parameters_atomically', SetParametersAtomically))
       for values in (NO_GAINS, {'p': 0.0, 'i': 0.0}, {'p': 1e-9, 'i': 1e-9}, {'p': 0.0},
                      {'i': 0.0}, {'d': 0.0}, {'error_deadband': 1000.0},
                      {'derivative_filter_time': 10.0}, {'load_feedforward': False})},
}


def test_one_request_takes_no_braking_away(runner, probe, tmp_path):
    """All gains at nought, without feedforward, in one request had let the brake go by 26 rad."""
    loop = Shipped(runner, probe, tmp_path)
    applied(loop, 'angle')
    lost = {}
    for name, (node, service, request) in REQUESTS.items():
        before, begin, counted = loop.position, len(loop.states), len(loop.state)
        probe.call(node, service, request=request)
        loop.during(3.0 * SHOWS)
        let_go = before - min(message.position[0] for message in loop.states[begin:])
        if let_go > ANGLE or any(message.data == 'fault' for message in loop.state[counted:]):
            lost[name] = let_go, loop.words()
        runner.check()
        applied(loop, 'angle')
        for given, value in RESTORED.items():
            loop.set_parameter('controller', given, value)
    assert not lost
    runner.stop()
