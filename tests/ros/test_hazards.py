# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the drive, the commands and other nodes can do wrong, over real DDS, on real nodes."""

import math
import os
import time

from lifecycle_msgs.srv import ChangeState
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, UInt64

from benchmarks.watched_loop import SPOILT
from engb_core.control.causes import Cause
from engb_core.model import Cogging, Model
from engb_ros.files import config_file, TRUE_BRAKE
from engb_ros.interface import (
    ACCEPT_MODEL,
    CLAMP_FORCE_COMMAND,
    CONTROLLER_ACTIVATION,
    DISTURBANCE,
    EFFORT_COMMAND,
    POSITION_COMMAND,
    POSITION_COMMAND_STAMPED,
    Service,
)
from engb_ros.processes.runner import node_command
from ros.loops import ATTEMPTS, BRAKE, closed_loop

LIMIT = 0.75


@pytest.fixture
def spoilt(runner, probe):
    """A loop around a drive that goes wrong on request."""
    loop = closed_loop(runner, probe, [(SPOILT, BRAKE)])
    loop.act = lambda fault: loop.set_parameter('plant', 'fault', fault)
    yield loop
    assert all(math.isfinite(message.data) and abs(message.data) <= LIMIT
               for message in loop.efforts)
    runner.stop()


def healthy(loop, angle=15.0):
    """End the fault, clear what it left, and track again."""
    loop.act('none')
    loop.healthy()
    loop.go(angle)


def test_a_drive_whose_stamps_or_angles_go_wrong(spoilt):
    loop = spoilt
    for fault, cause in (('stamps_stand', Cause.STATE_STALE), ('stamps_nought', Cause.STATE_STALE),
                         ('angle_jumps', Cause.ANGLE_LOST), ('angle_nan', Cause.STATE_STALE),
                         ('angle_far', Cause.ANGLE_LOST)):
        healthy(loop)
        loop.act(fault)
        loop.until(lambda cause=cause: loop.is_in('fault') and loop.has(cause), fault)
        loop.until(lambda: loop.efforts[-1].data == 0.0, 'the torque to be gone')
    healthy(loop)
    for fault, cause in (('clock_back', Cause.CLOCK_JUMP), ('clock_forward', Cause.CLOCK_JUMP),
                         ('angle_glitches', Cause.STATE_JUMP)):
        loop.act(fault)
        loop.until(lambda cause=cause: loop.has(cause), fault)
        for angle in (8.0, 15.0):
            loop.go(angle) if fault != 'angle_glitches' else loop.during(0.3)
        assert loop.tracks(), loop.words()
        loop.act('none')
        loop.during(0.3)


def test_a_drive_that_does_not_obey(spoilt):
    loop = spoilt
    for fault, cause in (('off', Cause.DRIVE_OFF), ('refuses', Cause.DRIVE_OFF),
                         ('holds_on', Cause.DRIVE_WRONG), ('reversed', Cause.DRIVE_WRONG),
                         ('stuck', Cause.DRIVE_WRONG), ('biased', Cause.DRIVE_WRONG),
                         ('deaf_for_a_second', Cause.DRIVE_OFF)):
        healthy(loop)
        loop.target = 25.0
        loop.act(fault)
        loop.until(lambda cause=cause: loop.is_in('fault') and loop.has(cause), fault)
        loop.until(lambda: loop.efforts[-1].data == 0.0, 'the torque to be gone')
        begin = len(loop.efforts)
        loop.during(1.2 if fault == 'deaf_for_a_second' else 0.2)
        assert all(message.data == 0.0 for message in loop.efforts[begin:])   # nothing winds up
    healthy(loop)
    loop.act('weak')
    loop.target = 36.0
    loop.until(lambda: loop.is_in('degraded') and loop.has(Cause.DRIVE_WEAK), 'weak')
    healthy(loop)
    loop.act('no_disc')
    loop.until(lambda: loop.is_in('degraded') and loop.has(Cause.DISC_SPEED_STALE), 'no disc')
    for fault in ('seized', 'angle_stuck'):
        healthy(loop)
        loop.act(fault)
        loop.target = 30.0
        loop.until(lambda: loop.is_in('fault') and loop.has(Cause.SHAFT_SEIZED), fault)


def test_a_request_too_high_and_then_none(runner, probe):
    loop = closed_loop(runner, probe)
    loop.target = 45.0   # 40 are allowed
    loop.until(lambda: loop.has(Cause.COMMAND_OUT_OF_RANGE) and loop.position > 39.0, 'the end')
    assert loop.is_in('enabled')
    loop.go(20.0)

    def told():   # the first ones go out before both sides know each other
        probe.publish(CLAMP_FORCE_COMMAND, 1000.0)
        return loop.has(Cause.FORCE_NOT_CONFIGURED)
    loop.until(told, 'the missing mechanism to be told')
    loop.target = None
    loop.until(lambda: loop.is_in('fault'), 'stale commands')
    probe.publish(POSITION_COMMAND, 0.0)
    loop.during(0.4)
    assert abs(loop.position - 20.0) < 0.5   # one message removes no braking
    loop.target = 30.0
    loop.during(1.0)
    assert abs(loop.position - 20.0) < 0.5
    loop.target = 3.0
    loop.until(lambda: abs(loop.position - 3.0) < 0.3, 'the lower request')
    assert loop.is_in('fault')
    assert loop.clear().success
    runner.stop()


def test_several_sources_of_commands(runner, probe):
    loop = closed_loop(runner, probe)
    count = [0]

    def stamped(value, source, age=0.0, counter=None):
        count[0] += 1
        message = JointState(name=['motor', 'counter'], position=[
            value, float(count[0] if counter is None else counter)])
        message.header.frame_id = source
        message.header.stamp = probe.node.get_clock().now().to_msg()
        message.header.stamp.sec -= int(age)
        probe.publish(POSITION_COMMAND_STAMPED, message)

    def until(condition, what, *sending):
        last = [0.0]

        def step():
            if time.monotonic() - last[0] > 0.05:
                last[0] = time.monotonic()
                for arguments in sending:
                    stamped(*arguments)
                    probe.spin(0.02)   # the controller reads the newest only
            return condition()
        loop.reach(step, what)

    stack = (12.0, 'stack')
    loop.until(lambda: probe.subscribers(POSITION_COMMAND_STAMPED), 'the subscription')
    until(lambda: abs(loop.position - 12.0) < 0.3 and loop.is_in('enabled'), 'the stack', stack)
    until(lambda: loop.has(Cause.COMMAND_LATE), 'late', stack, (12.0, 'stack', 60.0))
    until(lambda: loop.has(Cause.COMMAND_REPEATED), 'repeated', stack, (30.0, 'stack', 0.0, 1))
    until(lambda: loop.is_in('degraded') and loop.has(Cause.COMMAND_CONFLICT), 'a stranger',
          stack, (30.0, 'stranger'))
    assert abs(loop.position - 12.0) < 0.5
    runner.stop()


def test_two_publishers_of_one_float64_do_not_swing_the_brake(runner, probe):
    loop = closed_loop(runner, probe)
    loop.go(20.0)
    other = probe.node.create_publisher(Float64, POSITION_COMMAND.name, 1)
    loop.until(lambda: loop.is_in('degraded') and loop.has(Cause.COMMAND_CONFLICT), 'two sources')
    begin = len(loop.states)
    for _ in range(40):
        other.publish(Float64(data=3.0))
        loop.during(0.03)
    angles = [message.position[0] for message in loop.states[begin:]]
    assert max(angles) - min(angles) < 1.0
    runner.stop()


def test_an_intruder_neither_silences_nor_hides(runner, probe):
    loop = closed_loop(runner, probe)

    def intrude():
        loop.during(1.5)
        claims = probe.node.create_publisher(UInt64, CONTROLLER_ACTIVATION.name, 1)
        torque = probe.node.create_publisher(Float64, EFFORT_COMMAND.name, 1)
        claims.publish(UInt64(data=1))   # the most senior controller there ever was
        loop.reach(lambda: loop.is_in('degraded') and loop.has(Cause.OTHER_CONTROLLER),
                   'the intruder')
        loop.during(1.0)
        goes_on = not loop.is_in('fault') and abs(loop.position - 10.0) < 0.5
        for _ in range(30):
            torque.publish(Float64(data=1e6))
            loop.during(0.01)
        inside = loop.position < 44.0   # it was driven to 53 rad of 40
        probe.node.destroy_publisher(claims)
        probe.node.destroy_publisher(torque)
        return goes_on and inside

    assert loop.undisturbed(intrude), loop.words()
    runner.stop()


def test_watchdogs_cannot_be_switched_off_while_it_runs(runner, probe):
    loop = closed_loop(runner, probe)
    loop.go(10.0)
    for name, value in (('state_timeout', 0.0), ('command_timeout', 0.0), ('use_sim_time', True),
                        ('u_clamp_max', 0.0), ('effort_limit', 100.0), ('position_max', 1000.0)):
        with pytest.raises(RuntimeError, match='refused'):
            loop.set_parameter('controller', name, value)
    loop.set_parameter('controller', 'p', 0.5)   # what is tuned is live
    loop.target = None
    loop.until(lambda: loop.is_in('fault'), 'stale commands all the same')
    runner.stop()


def test_a_live_parameter_makes_nobody_read_a_file_again(runner, probe, tmp_path):
    mechanism = tmp_path / 'mechanism.yaml'
    mechanism.write_text(config_file('mechanism.yaml').read_text(encoding='utf-8'))
    loop = closed_loop(runner, probe, model=str(TRUE_BRAKE), mechanism=str(mechanism))
    mechanism.unlink()   # a slow or broken file system would stop the loop
    loop.set_parameter('controller', 'p', 0.5)
    loop.go(10.0)
    runner.stop()


def test_no_model_file_stops_the_loop(runner, probe, tmp_path):
    loop = closed_loop(runner, probe, model=str(TRUE_BRAKE),
                       mechanism=str(config_file('mechanism.yaml')))
    loop.go(10.0)
    true = Model.read(TRUE_BRAKE)
    from dataclasses import replace
    files = {}
    for name, cogging in (('order', (Cogging(1e308, 0.001),)),
                          ('harmonics', (Cogging(1.0, 1e-6),) * 3000)):
        files[name] = tmp_path / f'{name}.yaml'
        replace(true, cogging=cogging).write(files[name])
    files['the load'] = tmp_path / 'load.yaml'
    replace(true, load_torque=replace(true.load_torque, coefficients=tuple(
        0.1 * value for value in true.load_torque.coefficients))).write(files['the load'])
    files['not a regular file'] = tmp_path / 'pipe'
    os.mkfifo(files['not a regular file'])
    files['cannot be read'] = tmp_path / 'none.yaml'
    for told, path in files.items():
        loop.set_parameter('controller', 'candidate_model', str(path))
        for _ in range(ATTEMPTS):
            loop.go(10.0)
            begin = len(loop.efforts)
            answer = probe.call('controller', ACCEPT_MODEL, timeout=40.0)
            assert not answer.success
            assert told in answer.message
            loop.during(0.3)
            if loop.is_in('enabled') or not loop.was_late():
                break
        assert len(loop.efforts) > begin + 10
        assert loop.is_in('enabled')
        assert abs(loop.position - 10.0) < 0.5
    loop.set_parameter('controller', 'candidate_model', str(TRUE_BRAKE))
    assert probe.call('controller', ACCEPT_MODEL).success
    runner.stop()


def test_a_driver_that_offers_best_effort_only_is_heard(runner, probe):
    runner.start('disturbance_observer')
    loop_drive = [(SPOILT, {**BRAKE, 'best_effort': True})]
    estimates = probe.listen(DISTURBANCE)
    states = []
    probe.node.create_subscription(
        JointState, 'joint_states', states.append,
        QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT))
    efforts = probe.listen(EFFORT_COMMAND)
    runner.start(SPOILT, parameters=loop_drive[0][1])
    runner.start('controller')
    runner.wait_until(lambda: states and efforts and estimates, 'all to hear the driver',
                      pause=probe.spin)
    runner.stop()


def test_who_asks_for_more_than_is_offered_is_told_in_words(runner, probe):
    process = runner.start('plant')
    probe.node.create_subscription(JointState, 'joint_states', lambda message: None, QoSProfile(
        depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    runner.wait_until(lambda: 'asks for more durability' in process.output, 'the word',
                      pause=probe.spin)
    assert 'volatile' in process.output
    runner.stop()


def test_the_guard_against_two_controllers_sees_remapped_names(runner, probe):
    loop = closed_loop(runner, probe)
    loop.go(10.0)
    loop.during(1.2)
    remap = ['-r', 'effort_command:=other_torque', '-r', 'joint_states:=joint_states']
    for name in ('second', 'third'):
        runner.start_command(name, [*node_command('controller', name=name), *remap])
    loop.until(lambda: probe.node.count_publishers('other_torque') == 2, 'both', timeout=60.0)
    # They drive the same (other) topic: one of them yields, the first loop's goes on.
    loop.until(lambda: any(message.data == 'fault' for message in loop.state), 'one to yield')
    assert abs(loop.position - 10.0) < 0.5
    runner.kill()


def test_a_failing_configuration_leaves_nothing_behind(runner, probe):
    runner.start('controller', parameters={'autostart': False, 'model': '/nowhere.yaml'})
    service = Service('~/change_state', 'lifecycle_msgs/srv/ChangeState', '')
    request = ChangeState.Request()
    request.transition.id = 1
    for _ in range(2):
        assert not probe.call('controller', service, request=request).success
    assert probe.publishers(EFFORT_COMMAND) == 0
    runner.stop()
