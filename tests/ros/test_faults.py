# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Faults injected for real: processes killed, frozen, restarted; garbage on the wires."""

import math
import signal
import time

import pytest
from sensor_msgs.msg import JointState

from engb_core.control.causes import Cause
from engb_core.model import Model
from engb_ros.files import TRUE_BRAKE
from engb_ros.interface import (
    ACCEPT_MODEL,
    CLAMP_FORCE,
    CLAMP_FORCE_COMMAND,
    DISTURBANCE,
    EFFORT_COMMAND,
    JOINT_STATES,
    POSITION_COMMAND,
    Service,
)
from engb_ros.nodes.messages import publisher_qos
from engb_ros.processes.runner import node_command
from ros.loops import ATTEMPTS, BRAKE, can_drive, closed_loop, FAULTS, plant, STATE_TIMEOUT

# Which drive, and which of its nodes is hit.
HIT = [('plant', 'plant'), ('can', 'drive_emulator'), ('can', 'can_bridge')]


@pytest.fixture
def drive(request):
    """The plant, or a drive behind a CAN bus."""
    return can_drive(request.getfixturevalue('bus')) if request.param == 'can' else plant()


def cleared_and_back(loop, angle):
    """Clear the fault once its cause is gone, and track again."""
    loop.healthy()
    loop.go(angle)


@pytest.mark.parametrize(('drive', 'node'), HIT, indirect=['drive'])
def test_a_killed_drive_and_a_frozen_drive(runner, probe, drive, node):
    loop = closed_loop(runner, probe, drive)
    loop.go(12.0)
    loop.kill(node)
    loop.until(lambda: loop.is_in('fault') and loop.has(Cause.STATE_STALE), 'the fault')
    loop.until(lambda: loop.efforts[-1].data == 0.0, 'the torque to be gone')
    assert not loop.clear().success   # the cause is still there
    loop.start(node)
    cleared_and_back(loop, 5.0)

    runner.processes[node].signal(signal.SIGSTOP)
    loop.until(lambda: loop.is_in('fault'), 'the fault')
    runner.processes[node].signal(signal.SIGCONT)
    count = len(loop.states)
    loop.until(lambda: len(loop.states) > count + 20, 'the drive to be back')
    assert loop.is_in('fault')   # latched although the drive is back
    cleared_and_back(loop, 8.0)
    runner.stop()


@pytest.mark.parametrize(('drive', 'node'), HIT, indirect=['drive'])
def test_a_drive_that_is_silent_before_the_first_command_is_waited_for(runner, probe, drive, node):
    loop = closed_loop(runner, probe, drive)
    loop.until(lambda: loop.is_in('ready') and not loop.has(Cause.STATE_STALE)
               and len(loop.efforts) > 50, 'the controller to hold what it found')
    runner.processes[node].signal(signal.SIGSTOP)
    loop.until(lambda: loop.has(Cause.STATE_STALE), 'the word')
    loop.until(lambda: loop.efforts[-1].data == 0.0, 'the torque to be gone')
    runner.processes[node].signal(signal.SIGCONT)
    loop.until(lambda: not loop.has(Cause.STATE_STALE), 'the drive to be back')
    assert not any(message.data == 'fault' for message in loop.state), loop.words()
    loop.go(8.0)   # nothing had to be cleared
    runner.stop()


@pytest.mark.parametrize('drive', ['plant', 'can'], indirect=True)
def test_a_killed_controller_and_its_restart_in_mid_stroke(runner, probe, drive):
    loop = closed_loop(runner, probe, drive)
    loop.go(20.0)
    loop.until(lambda: loop.effort > 0.03, 'a torque')
    loop.kill('controller')
    loop.until(lambda: loop.effort == 0.0, 'the drive to let go')
    loop.target = None
    loop.start('controller')
    begin = len(loop.efforts)
    loop.until(lambda: loop.is_in('ready') and len(loop.efforts) > begin + 50, 'the restart')
    # It holds what it found; it neither jumps to zero nor to the old command.
    held = [message.position[0] for message in loop.states[-30:]]
    assert max(held) - min(held) < 1.0
    loop.go(20.0)
    runner.stop()


@pytest.mark.parametrize('drive', ['plant', 'can'], indirect=True)
def test_a_frozen_controller(runner, probe, drive):
    loop = closed_loop(runner, probe, drive)
    loop.go(20.0)
    runner.processes['controller'].signal(signal.SIGSTOP)
    loop.until(lambda: loop.effort == 0.0, 'the drive to let go')
    loop.during(STATE_TIMEOUT + 0.5)
    runner.processes['controller'].signal(signal.SIGCONT)
    loop.until(lambda: loop.is_in('fault'), 'the controller to notice that it slept')
    cleared_and_back(loop, 6.0)
    runner.stop()


def test_who_only_listens_may_die_or_freeze(runner, probe, tmp_path):
    loop = closed_loop(runner, probe)
    listeners = {'recorder': {'bag': str(tmp_path / 'bag')}, 'identifier': {},
                 'disturbance_observer': {}, 'monitor': {'model': str(TRUE_BRAKE)}}
    for name, parameters in listeners.items():
        runner.start(name, parameters=parameters)
    loop.until(lambda: probe.subscribers(JOINT_STATES) >= 2 + len(listeners), 'all to listen')

    def hit(number):
        """Hit the listeners; return the causes of the faults that came of it, if any."""
        for name, parameters in listeners.items():
            if name not in runner.processes:
                runner.start(name, parameters=parameters)
            runner.processes[name].signal(signal.SIGCONT)
        loop.go(10.0)
        begin, dead = len(loop.causes), []
        for name in listeners:
            runner.processes[name].signal(number)
            if number == signal.SIGKILL:
                dead.append(runner.processes.pop(name))
        for angle in (16.0, 8.0):   # commands go on meanwhile: nobody is waited for
            loop.go(angle)
        for process in dead:
            process.wait()
        listeners['recorder'] = {'bag': str(tmp_path / f'bag{time.monotonic_ns()}')}
        return [str(Cause(message.data & FAULTS)) for message in loop.causes[begin:]
                if message.data & FAULTS]

    for number in (signal.SIGSTOP, signal.SIGKILL):
        for _ in range(ATTEMPTS):
            found = hit(number)
            if not found:   # else a busy computer let the loop wait, or `go` had not moved on
                break
        assert not found, loop.words()
    runner.stop()


def test_garbage_and_stale_commands(runner, probe):
    loop = closed_loop(runner, probe, stale_action='ramp_to_zero')
    loop.go(10.0)
    for value, cause in (
            (math.nan, Cause.COMMAND_NOT_FINITE), (math.inf, Cause.COMMAND_NOT_FINITE),
            (1e30, Cause.COMMAND_NOT_FINITE), (-60.0, Cause.COMMAND_OUT_OF_RANGE)):
        def told(value=value, cause=cause):
            probe.publish(POSITION_COMMAND, value)   # the newest only is read: again
            return loop.has(cause)
        loop.until(told, cause.name)
        assert loop.is_in('enabled')
    loop.go(10.0)   # −60 rad was taken as the range's end
    assert abs(loop.position - 10.0) < 0.5
    probe.publish(CLAMP_FORCE_COMMAND, 5000.0)   # no mechanism: no force mode
    loop.during(0.2)
    assert abs(loop.position - 10.0) < 0.5
    loop.target = None
    loop.until(lambda: loop.is_in('fault') and loop.has(Cause.COMMAND_STALE), 'the fault')
    loop.until(lambda: abs(loop.position) < 0.4, 'the brake to be released')
    probe.publish(POSITION_COMMAND, 15.0)
    loop.during(0.3)
    assert abs(loop.position) < 0.5   # latched: not obeyed
    assert loop.clear().success
    loop.go(4.0)
    assert all(math.isfinite(message.data) and abs(message.data) <= 0.75
               for message in loop.efforts)
    runner.stop()


def test_garbage_joint_states_and_jumps_of_the_clock(runner, probe):
    loop = closed_loop(runner, probe, [('benchmarks.spoilt_drive', BRAKE)])
    # Its own garbage comes to the test as well.
    loop.states = drive = []
    probe.listen(JOINT_STATES, lambda message: drive.append(message) if len(
        message.position) and abs(message.position[0]) < 1e3 else None)
    loop.until(lambda: drive, 'the drive')
    for fault, cause in (
            ('other_joint_now', Cause.STATE_WRONG_JOINT),
            ('no_joint_now', Cause.STATE_WRONG_JOINT),
            ('angle_nan_now', Cause.STATE_NOT_FINITE),
            ('velocity_infinite_now', Cause.STATE_NOT_FINITE),
            ('angle_far_now', Cause.STATE_JUMP),
            ('clock_forward_now', Cause.CLOCK_JUMP), ('clock_back_now', Cause.CLOCK_JUMP)):
        def trial(fault=fault, cause=cause):
            loop.set_parameter('plant', 'fault', fault)
            try:
                loop.until(lambda: loop.has(cause), cause.name)
                loop.during(0.3)
            finally:
                loop.set_parameter('plant', 'fault', 'none')
            return not loop.is_in('fault')
        assert loop.undisturbed(trial), loop.words()
        assert abs(loop.position - 10.0) < 1.0
    assert all(math.isfinite(message.data) and abs(message.data) <= 0.75
               for message in loop.efforts)
    runner.stop()


@pytest.mark.parametrize('follows', [False, True])
def test_joint_states_of_a_stranger_are_told_and_not_used(runner, probe, follows):
    """Three thousand a second, of a brake that stands open; or those of the drive itself,
    each an angle farther off, which motion alone cannot tell from the drive's."""
    loop = closed_loop(runner, probe)
    loop.states = drive = []
    probe.listen(JOINT_STATES, lambda message: drive.append(message) if (
        message.header.frame_id != 'stranger') else None)
    loop.until(lambda: drive, 'the drive')
    seen = []

    def trial():
        begin = len(drive)
        stranger = probe.node.create_publisher(
            JointState, JOINT_STATES.name, publisher_qos(JOINT_STATES))
        offset, end = 0.0, time.monotonic() + 2.0
        while time.monotonic() < end:
            own = drive[-1]
            angle = own.position[0] if follows else 2.0
            offset += 0.003 if follows else 0.0
            message = JointState(name=['motor'], position=[angle - offset], velocity=[
                own.velocity[0] if follows else 0.0], effort=[own.effort[0]])
            message.header.frame_id = 'stranger'
            message.header.stamp = probe.node.get_clock().now().to_msg()
            for _ in range(1 if follows else 10):
                stranger.publish(message)
            loop.during(0.003)
        told = loop.has(Cause.OTHER_DRIVE)
        probe.node.destroy_publisher(stranger)
        seen[:] = [message.position[0] for message in drive[begin:]]
        return told and not loop.is_in('fault') and max(seen) - min(seen) < 0.5

    assert loop.undisturbed(trial), (loop.words(), min(seen), max(seen))
    runner.stop()


def test_two_controllers_at_once(runner, probe):
    loop = closed_loop(runner, probe)
    loop.go(10.0)
    loop.during(1.2)
    second = runner.start_command('second', node_command(
        'controller', parameters=loop.controller, name='second'))
    # From its start, which takes a second or more, to its silence; it never sends anything.
    loop.until(lambda: any(message.data == 'fault' for message in loop.state),
               'the second one to yield')
    loop.until(lambda: any(message.data & Cause.OTHER_CONTROLLER for message in loop.causes),
               'the cause')
    loop.during(1.0)
    assert abs(loop.position - 10.0) < 0.5   # the first one went on
    second.signal(signal.SIGINT)
    runner.processes.pop('second')   # it shall end
    loop.until(lambda: second.status is not None, 'the second one to end')
    assert second.status == 0
    loop.go(6.0)
    runner.stop()


def test_force_mode_observer_loss_and_a_model_accepted(runner, probe, tmp_path):
    from rcl_interfaces.srv import SetParameters
    from rclpy.parameter import Parameter

    from engb_ros.files import config_file
    loop = closed_loop(runner, probe, model=str(TRUE_BRAKE), observer_timeout=STATE_TIMEOUT,
                    mechanism=str(config_file('mechanism.yaml')))
    observer = runner.start('disturbance_observer')
    forces = probe.listen(CLAMP_FORCE)
    loop.until(lambda: probe.publishers(DISTURBANCE), 'the observer')
    last = [0.0]

    def forced():
        if time.monotonic() - last[0] > 0.05:
            last[0] = time.monotonic()
            probe.publish(CLAMP_FORCE_COMMAND, 4000.0)
        return forces and abs(forces[-1].data - 4000.0) < 200.0 and loop.is_in('enabled')

    loop.reach(forced, 'the clamp force')
    observer.signal(signal.SIGKILL)
    runner.processes.pop('disturbance_observer').wait()
    loop.until(lambda: forced() is None or (loop.is_in('degraded')
                                            and loop.has(Cause.OBSERVER_STALE)), 'degraded')
    runner.start('disturbance_observer')
    loop.reach(forced, 'the observer to be back')

    def candidate(model):
        model.write(tmp_path / 'model.yaml')
        service = Service('~/set_parameters', 'rcl_interfaces/srv/SetParameters', '')
        request = SetParameters.Request(parameters=[Parameter(
            'candidate_model', value=str(tmp_path / 'model.yaml')).to_parameter_msg()])
        assert probe.call('controller', service, request=request).results[0].successful
        return probe.call('controller', ACCEPT_MODEL)

    from dataclasses import replace
    true = Model.read(TRUE_BRAKE)
    assert candidate(replace(true, motor=replace(true.motor, inertia=7.2e-5))).success
    refused = candidate(replace(true, motor=replace(true.motor, inertia=7e-4)))
    assert not refused.success
    assert 'inertia' in refused.message
    runner.stop()


def test_a_last_command_of_no_torque_is_sent(runner, probe):
    loop = closed_loop(runner, probe)
    loop.go(20.0)
    assert loop.efforts[-1].data > 0.02
    runner.stop(['controller'], signal.SIGTERM)
    loop.until(lambda: loop.efforts[-1].data == 0.0, 'the last command')
    assert probe.publishers(EFFORT_COMMAND) <= 1
    runner.stop()
