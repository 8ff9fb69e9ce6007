# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Nodes start, stop by signal with status 0, and refuse bad parameters in one line."""

import math
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import threading
import time

from lifecycle_msgs.srv import ChangeState
import pytest
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.parameter import Parameter

from engb_ros.interface import EFFORT_COMMAND, Service
from engb_ros.processes.runner import node_command


def may_be_real_time():
    """Whether this process may ask for it."""
    tried = subprocess.run([sys.executable, '-c', 'import os; os.sched_setscheduler(0, '
                            'os.SCHED_FIFO, os.sched_param(1)); import ctypes; '
                            'assert ctypes.CDLL(None).mlockall(3) == 0'],
                           capture_output=True, check=False)
    return tried.returncode == 0


NODES = ('plant', 'controller', 'disturbance_observer', 'identifier', 'recorder')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_every_node_ends_with_status_0(runner, probe, tmp_path, number):
    for name in NODES:
        options = {'bag': str(tmp_path / 'bag')} if name == 'recorder' else {}
        runner.start(name, parameters=options)
    runner.wait_until(lambda: set(NODES) <= set(probe.node.get_node_names()),
                      'all nodes in the graph', pause=probe.spin)
    runner.stop(number=number)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_who_is_signalled_again_while_it_ends_ends_with_status_0_too(runner, probe, number):
    """Ctrl-C under ros2 launch comes twice: from the terminal, and from launch."""
    process = runner.start('disturbance_observer')
    runner.wait_until(lambda: 'disturbance_observer' in probe.node.get_node_names(), 'the node',
                      pause=probe.spin)

    def ended():
        process.signal(number)
        return process.status is not None
    runner.processes.clear()   # it shall end
    runner.wait_until(ended, 'its end', pause=lambda: time.sleep(1e-3))
    assert process.status == 0


# Runs a node and prints which of the middleware's threads are left when it has ended.
THREADS = '''
from importlib import import_module
from pathlib import Path
import sys
import_module(sys.argv.pop(1)).main()
names = [path.read_text().strip() for path in Path('/proc/self/task').glob('*/comm')]
print('left:', [name for name in names if name.startswith('dds.')])
'''


@pytest.mark.parametrize('name', ['controller', 'recorder', 'can_bridge'])
def test_no_thread_of_the_middleware_outlives_a_node(runner, probe, tmp_path, bus, name):
    """They ran on into the process's end, which then crashed at times, or hung."""
    options = {'recorder': {'bag': str(tmp_path / 'bag')}, 'can_bridge': bus}.get(name, {})
    command = node_command(name, parameters=options)
    process = runner.start_command(name, [
        sys.executable, '-c', THREADS, f'engb_ros.nodes.{name}', *command[4:]])
    runner.wait_until(lambda: name in probe.node.get_node_names(), 'the node', pause=probe.spin)
    comm = Path(f'/proc/{process.process.pid}/task')
    assert any(path.read_text().startswith('dds.') for path in comm.glob('*/comm'))
    runner.stop()
    assert process.output_path.read_text().splitlines()[-1] == 'left: []'


@pytest.mark.parametrize('name', [*NODES, 'excitation', 'can_bridge', 'drive_emulator'])
def test_every_node_goes_through_its_states_twice(runner, probe, tmp_path, bus, name):
    options = {'recorder': {'bag': str(tmp_path / 'bag')}, 'can_bridge': bus,
               'drive_emulator': bus}.get(name, {})
    process = runner.start(name, parameters={**options, 'autostart': False})
    service = Service('~/change_state', 'lifecycle_msgs/srv/ChangeState', '')
    # configure, activate, deactivate, cleanup; and shut down from active
    for transition in (1, 3, 4, 2) + ((1, 3, 7) if name != 'recorder' else ()):
        request = ChangeState.Request()
        request.transition.id = transition
        assert probe.call(name, service, request=request).success, transition
        for _ in range(5):
            probe.spin()
    runner.stop()
    assert 'Traceback' not in process.output_path.read_text()


def test_a_node_that_stood_still_is_asked_again(runner, probe):
    process = runner.start('disturbance_observer')
    service = Service('~/get_parameters', 'rcl_interfaces/srv/GetParameters', '')
    runner.wait_until(lambda: probe.ready('disturbance_observer', service), 'the node',
                      pause=probe.spin)
    process.signal(signal.SIGSTOP)
    goes_on = threading.Timer(2.5, process.signal, [signal.SIGCONT])
    goes_on.start()
    request = GetParameters.Request(names=['autostart'])
    try:
        answer = probe.call('disturbance_observer', service, request=request)
    finally:
        goes_on.join()
    assert answer.values[0].bool_value


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_in_the_midst_of_the_imports_is_a_clean_end_too(runner_of_commands, number):
    runner = runner_of_commands
    process = runner.start('controller')
    libraries = Path(f'/proc/{process.process.pid}/maps')
    # It is importing ROS: Python's own handler would answer with a traceback.
    runner.wait_until(lambda: 'librcl' in libraries.read_text(), 'the imports',
                      pause=lambda: None)
    process.signal(number)
    assert process.wait() == 0
    assert 'Traceback' not in process.output


@pytest.mark.skipif(not shutil.which('setpriv'), reason='setpriv takes the permissions away')
@pytest.mark.parametrize(('parameters', 'told'), [
    ({'scheduling_priority': 50}, 'scheduling_priority 50: not permitted'),
    ({'lock_memory': True}, 'lock_memory: not permitted'),
    ({'processors': [4000]}, 'processors [4000]: not possible'),
])
def test_real_time_that_is_not_permitted_is_refused(runner, parameters, told):
    command = node_command('controller', parameters=parameters)
    process = runner.start_command('controller', [
        'bash', '-c', 'ulimit -r 0 -l 64; exec setpriv "$@"', 'bash',
        *(['--bounding-set=-sys_nice,-ipc_lock'] if os.geteuid() == 0 else []), *command])
    assert process.wait(60.0) == 2
    assert told in process.output
    assert 'Traceback' not in process.output


@pytest.mark.skipif(not may_be_real_time(), reason='real time is not permitted here')
def test_real_time_holds_for_every_thread(runner, probe):
    process = runner.start('controller', parameters={
        'scheduling_priority': 10, 'processors': [min(os.sched_getaffinity(0))],
        'lock_memory': True})
    runner.wait_until(lambda: probe.publishers(EFFORT_COMMAND), 'the controller',
                      pause=probe.spin)
    threads = [int(path.name) for path in
               Path(f'/proc/{process.process.pid}/task').iterdir()]
    assert len(threads) > 3
    assert {os.sched_getscheduler(thread) for thread in threads} == {os.SCHED_FIFO}
    assert {len(os.sched_getaffinity(thread)) for thread in threads} == {1}
    runner.stop()


@pytest.mark.parametrize(('node', 'parameters', 'told'), [
    ('controller', {'p': 5}, 'write 5.0'),
    ('controller', {'p': -1.0}, 'must lie within 0.0 and 1000.0 N·m/rad'),
    ('controller', {'reference': 'circus'}, 'must be one of command, strokes, file'),
    ('controller', {'model': '/nowhere/model.yaml'}, 'cannot be read'),
    ('controller', {'reference': 'file'}, 'reference_file is empty'),
    ('controller', {'stroke_amplitudes': [1, 2]}, 'write [1.0, 2.0]'),
    ('controller', {'slow_speeds': []}, 'slow_speeds is given without a value'),
    ('disturbance_observer', {'order': 3}, 'must lie within 1 and 2'),
    ('plant', {'effects': 'telepathy: {strength: 1.0}'}, 'telepathy'),
    ('plant', {'effects': 'stribeck_friction: {colour: 1.0}'}, 'colour'),
    ('plant', {'effects': 'inertia_error: {inertia: -1.0}'}, 'inertia is -1 kg·m²'),
    # Once it has moved.
    ('plant', {'effects': 'viscous_friction_error: {viscous_friction: 1.0e6}'},
     'viscous_friction_error (viscous_friction 1e+06)'),
    ('plant', {'speed': 0.0}, 'lockstep'),
    ('plant', {'disc_speed_times': [0.0, 1.0]}, '2 times and 1 values'),
    ('recorder', {'bag': '/proc/bag'}, 'cannot be made'),
])
def test_bad_parameters_end_in_one_line_and_status_2(runner, node, parameters, told):
    process = runner.start_command(node, node_command(node, parameters=parameters))
    assert process.wait(60.0) == 2
    lines = process.output.splitlines()
    assert len(lines) == 1 and told in lines[0], process.output


@pytest.mark.parametrize('lockstep', [True, False])
def test_a_simulation_beyond_all_numbers_ends_in_one_line_however_it_is_driven(
        runner, probe, lockstep):
    process = runner.start('plant', parameters={
        'lockstep': lockstep, 'rate': 200.0,
        'effects': 'nonlinear_viscous_friction: {quadratic_viscous_friction: -1.0}'})
    probe.advertise(EFFORT_COMMAND)
    end = time.monotonic() + 60.0
    while process.status is None and time.monotonic() < end:
        probe.publish(EFFORT_COMMAND, 0.1)
        probe.spin()
    assert process.wait() == 2
    assert process.output.count('\n') == 1, process.output
    assert 'nonlinear_viscous_friction (quadratic_viscous_friction -1)' in process.output
    runner.processes.clear()


def test_a_drive_emulator_beyond_all_numbers_ends_in_one_line(runner, bus):
    process = runner.start('drive_emulator', parameters={
        **bus, 'effects': 'viscous_friction_error: {viscous_friction: 1.0e6}'})
    assert process.wait(60.0) == 2
    assert process.output.count('\n') == 1, process.output
    assert 'viscous_friction_error (viscous_friction 1e+06)' in process.output
    runner.processes.clear()


def test_parameters_are_described_and_checked_while_running(runner, probe):
    runner.start('controller')
    runner.wait_until(lambda: probe.publishers(EFFORT_COMMAND), 'the controller',
                      pause=probe.spin)
    request = DescribeParameters.Request(names=['p', 'antiwindup_strategy'])
    service = Service('~/describe_parameters', 'rcl_interfaces/srv/DescribeParameters', '')
    gain, strategy = probe.call('controller', service, request=request).descriptors
    assert gain.description.endswith('[N·m/rad]')
    assert gain.floating_point_range[0].to_value == 1000.0
    assert 'back_calculation' in strategy.additional_constraints

    def change(name, value):
        return probe.call(
            'controller', Service('~/set_parameters', 'rcl_interfaces/srv/SetParameters', ''),
            request=SetParameters.Request(
                parameters=[Parameter(name, value=value).to_parameter_msg()])).results[0]

    assert change('p', 0.6).successful
    assert not change('p', -0.6).successful
    assert not change('p', math.nan).successful   # no range holds it off, and it takes all torque
    assert not change('antiwindup_strategy', 'magic').successful
    assert not change('reference', 'strokes').successful   # read only
    runner.stop()
