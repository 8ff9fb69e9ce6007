# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What an integrator would not take on trust: as shipped, on real nodes, at their log level."""

import math

import pytest
import rclpy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from benchmarks.watched_loop import SPOILT
from engb_core.control.causes import Cause
from engb_ros.interface import (
    CLAMP_FORCE_COMMAND_STAMPED,
    CLOCK,
    POSITION_COMMAND,
    POSITION_COMMAND_STAMPED,
)
from engb_ros.nodes.messages import publisher_qos
from ros.test_as_shipped import ATTEMPTS, Shipped, within

# The brake may let go by so much while the next true command is under way.
ANGLE = 1.0

# Of the stack's commands [s].
PERIOD = 0.02

BY = {'angle': (POSITION_COMMAND_STAMPED, 'motor', 20.0),
      'force': (CLAMP_FORCE_COMMAND_STAMPED, 'clamp', 5000.0)}


class Named(Shipped):
    """The loop as shipped, under a stack that stamps, names and counts its commands; its clock
    is the probe's. It asks for angles or forces: `by`."""

    command_period = PERIOD

    def __init__(self, runner, probe, folder, by='angle', **arguments):
        self.by, self.counter = by, 0
        super().__init__(runner, probe, folder, **arguments)

    def clock(self):
        """Return the stack's time [ns]."""
        return self.probe.node.get_clock().now().nanoseconds

    def message(self, value, counter, ahead=0.0):
        """Return a command in the stack's name."""
        _, entry, _ = BY[self.by]
        made = JointState(name=[entry, 'counter'], position=[value, float(counter)],
                          effort=[value, float(counter)])
        made.header.frame_id = 'stack'
        made.header.stamp.sec, made.header.stamp.nanosec = divmod(
            self.clock() + round(1e9 * ahead), 10**9)
        return made

    def want(self, value):
        """Ask for another angle, or force."""
        self.ask(BY[self.by][0], value)

    def send(self, topic, value):
        self.counter += 1
        super().send(topic, self.message(value, self.counter))

    def applied(self):
        """Apply the brake and wait until it stands."""
        self.want(BY[self.by][2])
        self.reach(lambda: abs(self.position - 20.0) < 8.0, 'the brake')
        self.during(0.8)


# How far a forged command's counter and stamp [s] lie ahead of the stack's.
AHEAD = ((1, 0.0), (20, 0.0), (10**9, 0.0), (1, 0.2), (10**9, 0.2), (-5, 0.2))


@pytest.mark.parametrize('by', BY)
def test_one_command_in_the_stacks_name_takes_no_braking_away(runner, probe, tmp_path, by):
    """A stranger's stamp or counter had made repetitions of all that the stack sent afterwards:
    the brake let go, and ended in a fault."""
    loop = Named(runner, probe, tmp_path, by)
    topic = BY[by][0]
    stranger = probe.node.create_publisher(JointState, topic.name, publisher_qos(topic))

    def forged(beyond, ahead):
        loop.applied()
        before, begin, told = loop.position, len(loop.states), len(loop.state)
        for _ in range(3):
            counter = loop.counter
            loop.until(lambda counter=counter: loop.counter > counter, 'the stack')
            # Halfway to its next one: the controller reads the newest only.
            loop.during(0.5 * PERIOD)
            stranger.publish(loop.message(0.0, loop.counter + beyond, ahead))
            loop.during(0.5)
        return (min(loop.angles(begin)) > before - ANGLE
                and not any(message.data == 'fault' for message in loop.state[told:]))

    for beyond, ahead in AHEAD:
        assert any(forged(beyond, ahead) for _ in range(3)), (beyond, ahead, loop.words())
    runner.stop()


def test_an_angle_and_a_force_of_two_nodes_do_not_swing_the_brake(runner, probe, tmp_path):
    """Each topic has one publisher: nobody was told, and the brake went to and fro."""
    loop = Shipped(runner, probe, tmp_path)
    stranger = rclpy.create_node('another_stack', context=probe.node.context, namespace='/engb')

    def swings():
        other = stranger.create_publisher(Float64, POSITION_COMMAND.name, 1)
        try:
            loop.until(lambda: loop.has(Cause.COMMAND_CONFLICT), 'two sources to be told')
            told, begin = loop.is_in('degraded'), len(loop.states)
            for _ in range(60):
                other.publish(Float64(data=0.0))
                loop.during(0.03)
            return told and loop.span(begin) < ANGLE
        finally:
            stranger.destroy_publisher(other)

    assert loop.holds(6000.0, swings)
    assert within(loop)
    runner.stop()
    stranger.destroy_node()


@pytest.mark.parametrize('back', [0.4, 3600.0])
def test_a_release_goes_through_after_the_clock_was_set_back(runner, probe, tmp_path, back):
    """What the stack sent was a repetition until its clock was where it had been: an hour, in
    which the brake held on, and no release was heard."""
    loop = TurnedClock(runner, probe, tmp_path)

    def released():
        loop.applied()
        told = len(loop.state)
        loop.shift -= round(1e9 * back)
        loop.during(0.8)
        kept = not any(message.data == 'fault' for message in loop.state[told:])
        loop.want(8.0)
        loop.until(lambda: abs(loop.position - 8.0) < 0.5, 'the release')
        return kept

    assert any(released() for _ in range(ATTEMPTS)), loop.words()
    assert within(loop)
    runner.stop()


class TurnedClock(Named):
    """The loop with `use_sim_time`, on a /clock that the test sets."""

    def __init__(self, runner, probe, folder):
        self.shift = 0
        probe.advertise(CLOCK)
        super().__init__(runner, probe, folder, use_sim_time='true')

    def clock(self):
        return super().clock() + self.shift

    def _tick(self):
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(self.clock(), 10**9)
        self.probe.publish(CLOCK, message)

    def command(self):
        self._tick()
        return super().command()

    def pump(self):
        self._tick()
        super().pump()


@pytest.mark.parametrize('fault', ['no_effort', 'effort_infinite'])
def test_a_drive_that_tells_no_torque_any_more_is_told(runner, probe, tmp_path, fault):
    loop = Shipped(runner, probe, tmp_path, SPOILT)
    loop.clamp(3000.0)
    loop.set_parameter('plant', 'fault', fault)
    loop.until(lambda: loop.is_in('degraded') and loop.has(Cause.EFFORT_MISSING), 'the word')
    loop.during(0.5)
    assert abs(loop.forces[-1].data - 3000.0) < 200.0
    loop.set_parameter('plant', 'fault', 'none')
    loop.clamp(3000.0)
    assert within(loop)
    assert all(math.isfinite(message.data) for message in loop.forces)
    runner.stop()


@pytest.mark.parametrize('fault', ['velocity_reversed', 'velocity_none'])
def test_a_velocity_that_is_not_that_of_the_angles_is_told_and_not_used(runner, probe, tmp_path,
                                                                        fault):
    """Reversed, it is damping turned into its opposite: the brake had run out of its range."""
    loop = Shipped(runner, probe, tmp_path, SPOILT)

    def strokes():
        loop.clamp(1000.0)
        begin, told = len(loop.states), len(loop.state)
        loop.set_parameter('plant', 'fault', fault)
        for force in (6000.0, 500.0, 6000.0):
            loop.force = force
            loop.during(1.0)
        seen = any(message.data & Cause.VELOCITY_WRONG for message in loop.causes)
        loop.set_parameter('plant', 'fault', 'none')
        angles = loop.angles(begin)
        return (seen and min(angles) > 0.0 and max(angles) < 35.0
                and abs(loop.forces[-1].data - 6000.0) < 600.0
                and not any(message.data == 'fault' for message in loop.state[told:]))

    assert loop.holds(1000.0, strokes), loop.words()
    assert within(loop)
    runner.stop()
