# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Clamp forces with what the launch file starts, at its parameters and its log level."""

import math
import time

import pytest
from std_msgs.msg import Float64

from benchmarks.watched_loop import SPOILT
from engb_core.control.causes import Cause
from engb_core.model import Model
from engb_ros.files import config_file, TRUE_BRAKE
from engb_ros.interface import CLAMP_FORCE, CLAMP_FORCE_COMMAND, EFFORT_COMMAND
from engb_ros.processes.live_loop import LiveLoop, Request
from engb_ros.processes.runner import RunnerError
from ros.launched import launched

LIMIT = 0.75

# What the drive sends per second is its own matter; 250 leave a busy computer time.
DRIVE = '/**/plant:\n  ros__parameters: {rate: 250.0}\n'

# A busy computer spoils an attempt at the default timeouts; what is wrong in the code spoils all.
ATTEMPTS = 5


class Shipped(LiveLoop):
    """Plant, observer and controller of `one_wheel.launch.xml`; `force` [N] is commanded."""

    force = Request(CLAMP_FORCE_COMMAND)

    def __init__(self, runner, probe, folder, drive='plant', **arguments):
        wheel = folder / 'wheel.yaml'
        wheel.write_text(DRIVE)
        self.commands = launched('one_wheel.launch.xml', identifier='false',
                                 parameters=str(wheel), **arguments)
        self.commands['/engb/plant'][3] = drive
        self.forces = probe.listen(CLAMP_FORCE)
        super().__init__(runner, probe, [('plant', {}), ('disturbance_observer', {})])

    def start(self, name):
        self.runner.start_command(name, self.commands[f'/engb/{name}'])

    def reach(self, condition, what):
        """Wait for `condition`, enabled, whatever a busy computer makes the watchdogs find."""
        asked = [0.0]

        def reached():
            if self.is_in('fault') and time.monotonic() - asked[0] > 0.3:
                asked[0] = time.monotonic()
                self.clear()
            return self.is_in('enabled') and condition()

        self.until(reached, what, timeout=60.0)

    def clamp(self, force):
        """Clamp with `force`."""
        def clamped():
            new = self.forces[count:]   # in a fault none are published
            return len(new) > 20 and all(
                abs(message.data - force) < max(0.05 * force, 50.0) for message in new[-20:])

        self.force = force
        count = len(self.forces)
        self.reach(clamped, f'{force} N')

    def holds(self, force, attempt):
        """Whether `attempt`, begun with this clamp force, is true at least once."""
        for _ in range(ATTEMPTS):
            self.clamp(force)
            self.causes.clear()
            if attempt():
                return True
        return False

    def angles(self, begin):
        return [message.position[0] for message in self.states[begin:]]

    def span(self, begin):
        angles = self.angles(begin)
        return max(angles) - min(angles)

    def steps(self, begin):
        torques = [message.data for message in self.efforts[begin:]]
        return max(abs(later - earlier)
                   for earlier, later in zip(torques, torques[1:], strict=False))


@pytest.fixture
def loop(runner, probe, tmp_path):
    """The loop as shipped; never a torque beyond the limit."""
    made = Shipped(runner, probe, tmp_path)
    yield made
    runner.stop()


@pytest.fixture
def spoilt(runner, probe, tmp_path):
    """The same around a drive that goes wrong on request."""
    made = Shipped(runner, probe, tmp_path, SPOILT)
    yield made
    runner.stop()


def within(loop, begin=0):
    """Whether every torque is finite and within the limit."""
    return all(math.isfinite(message.data) and abs(message.data) <= LIMIT
               for message in loop.efforts[begin:])


def test_a_clamp_force_is_obeyed(loop):
    loop.clamp(3000.0)
    model = Model.read(TRUE_BRAKE)
    assert loop.position > model.load_torque.contact_angle
    loop.clamp(6000.0)
    loop.clamp(0.0)
    assert loop.position < model.load_torque.contact_angle
    assert within(loop)


def test_a_ramp_to_more_than_is_allowed_does_not_lock_the_brake(loop):
    def ramp():
        for force in range(8000, 9600, 100):   # 9000 N are allowed
            loop.force = float(force)
            loop.during(0.06)
        loop.during(0.6)   # told with the next diagnostics
        return loop.has(Cause.COMMAND_OUT_OF_RANGE) and not loop.is_in('fault')

    assert loop.holds(8000.0, ramp)
    loop.force = 0.0
    loop.until(lambda: loop.position < 4.0, 'the brake to let go')
    assert within(loop)


def test_two_publishers_do_not_swing_the_force(loop, probe):
    def swings():
        other = probe.node.create_publisher(Float64, CLAMP_FORCE_COMMAND.name, 1)
        try:
            loop.until(lambda: loop.has(Cause.COMMAND_CONFLICT), 'two sources to be told')
            told, begin = loop.is_in('degraded'), len(loop.states)
            for _ in range(60):
                other.publish(Float64(data=1000.0))
                loop.during(0.03)
            return told and loop.span(begin) < 1.0   # from 6000 to 1000 N it is 10 rad and more
        finally:
            probe.node.destroy_publisher(other)

    assert loop.holds(6000.0, swings)
    assert within(loop)


def test_torque_of_an_intruder_that_no_controller_asks_for_does_nothing(loop, probe):
    def intrude(torque):
        intruder = probe.node.create_publisher(Float64, EFFORT_COMMAND.name, 1)
        begin, end = len(loop.states), time.monotonic() + 2.0
        while time.monotonic() < end:   # the test hears him as well: efforts are no measure here
            intruder.publish(Float64(data=torque))
            loop.during(0.005)
        told = loop.has(Cause.OTHER_CONTROLLER)
        probe.node.destroy_publisher(intruder)
        return told and loop.span(begin) < 1.0   # it had been driven to 53 rad of 40

    for torque in (1e6, -1e6, math.inf, math.nan):
        assert loop.holds(3000.0, lambda torque=torque: intrude(torque)), (torque, loop.words())
    loop.clamp(3000.0)


@pytest.mark.parametrize('torque', [LIMIT, -LIMIT, 0.0])
def test_torque_of_an_intruder_within_the_limit_is_told_and_moves_nothing(loop, probe, torque):
    """The drive knows whom it has obeyed so far, also when another one overtakes in numbers."""
    def intrude():
        intruder = probe.node.create_publisher(Float64, EFFORT_COMMAND.name, 1)
        begin, end = len(loop.states), time.monotonic() + 3.0
        while time.monotonic() < end:   # several times as many as the controller sends
            for _ in range(4):
                intruder.publish(Float64(data=torque))
            loop.during(0.005)
        told = loop.has(Cause.OTHER_CONTROLLER)
        probe.node.destroy_publisher(intruder)
        if loop.has(Cause.ANGLE_OUT_OF_RANGE):   # no controller moves it from there
            loop.kill('plant')
            loop.start('plant')
        return told and not loop.is_in('fault') and loop.span(begin) < 1.0

    assert loop.holds(3000.0, intrude), loop.words()


@pytest.mark.parametrize('fault', ['angle_jumps', 'angle_far'])
def test_an_angle_that_jumps_makes_no_more_force(spoilt, fault):
    loop = spoilt
    shift = {'angle_jumps': -8.0, 'angle_far': 500.0}[fault]

    def jump():
        before, begin = loop.position, len(loop.states)
        loop.set_parameter('plant', 'fault', fault)
        try:
            loop.until(lambda: loop.is_in('fault') and loop.has(Cause.ANGLE_LOST),
                       'the lost angle', timeout=5.0)
            loop.until(lambda: loop.efforts[-1].data == 0.0, 'the torque to be gone', timeout=5.0)
        except RunnerError as error:
            # After a pause of its samples the motor may have gone so far (docs/hazards.md).
            print(error, flush=True)
            loop.set_parameter('plant', 'fault', 'none')
            return False
        loop.during(1.0)
        told = [angle for angle in loop.angles(begin) if abs(angle - before) > 4.0]
        loop.set_parameter('plant', 'fault', 'none')
        latched = loop.is_in('fault')
        return latched and max(angle - shift for angle in told) < before + 1.0

    assert loop.holds(3000.0, jump)
    assert within(loop)


def test_stamps_that_stand_in_force_control_release_the_brake(spoilt):
    loop = spoilt
    loop.clamp(3000.0)
    loop.set_parameter('plant', 'fault', 'stamps_stand')
    begin = len(loop.states)
    loop.until(lambda: loop.is_in('fault') and loop.has(Cause.STATE_STALE), 'the stale state')
    loop.until(lambda: loop.efforts[-1].data == 0.0, 'the torque to be gone')
    loop.during(2.0)
    assert min(loop.angles(begin)) > -5.0   # it had been driven to -56 rad
    assert within(loop)


def test_the_torque_does_not_jump_when_the_feedforward_is_switched(loop):
    def switch():
        begin = len(loop.efforts)
        loop.during(0.5)
        usual = loop.steps(begin)
        begin = len(loop.efforts)
        for value in (False, True):
            loop.set_parameter('controller', 'load_feedforward', value)
            loop.during(0.3)
        return loop.steps(begin) < usual + 0.05   # it was 0.19 N·m

    assert loop.holds(3000.0, switch)
    assert within(loop)


def test_clearing_a_healthy_brake_takes_no_torque_away(runner, probe, tmp_path):
    # The torque that holds the load comes of the integral part alone: this model knows no load.
    loop = Shipped(runner, probe, tmp_path, model=str(config_file('nominal.yaml')), mechanism='')

    def clear():
        loop.target = 30.0
        loop.until(lambda: loop.is_in('enabled') or not loop.clear().success, 'a healthy loop')
        loop.during(1.0)
        begin = len(loop.efforts)
        loop.during(0.5)
        usual, before = loop.steps(begin), loop.efforts[-1].data
        begin = len(loop.efforts)
        cleared = loop.clear().success
        loop.during(0.3)
        return (before > 0.1 and cleared and loop.is_in('enabled')
                and loop.steps(begin) < usual + 0.05)   # from 0.198 N·m it had gone to 0

    assert any(clear() for _ in range(ATTEMPTS))
    assert within(loop)
    runner.stop()


def test_the_mechanism_is_the_launchs(loop):
    assert any(str(config_file('mechanism.yaml')) in word
               for word in loop.commands['/engb/controller'])
