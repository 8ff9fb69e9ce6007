"""Nodes start, stop by signal with status 0, and refuse bad parameters in one line."""

from pathlib import Path
import signal

import pytest
from rcl_interfaces.srv import DescribeParameters, SetParameters
from rclpy.parameter import Parameter

from engb_ros.interface import EFFORT_COMMAND, Service
from engb_ros.runner import node_command

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
def test_a_signal_in_the_midst_of_the_imports_is_a_clean_end_too(runner, number):
    process = runner.start('controller')
    libraries = Path(f'/proc/{process.process.pid}/maps')
    # It is importing ROS: Python's own handler would answer with a traceback.
    runner.wait_until(lambda: 'librcl' in libraries.read_text(), 'the imports',
                      pause=lambda: None)
    process.signal(number)
    assert process.wait() == 0
    assert 'Traceback' not in process.output


@pytest.mark.parametrize(('node', 'parameters', 'told'), [
    ('controller', {'p': 5}, 'write 5.0'),
    ('controller', {'p': -1.0}, 'must lie within 0.0 and 1000.0 N·m/rad'),
    ('controller', {'reference': 'circus'}, 'must be one of command, strokes, file'),
    ('controller', {'model': '/nowhere/model.yaml'}, 'cannot be read'),
    ('controller', {'reference': 'file'}, 'reference_file is empty'),
    ('controller', {'stroke_amplitudes': [1, 2]}, 'write [1.0, 2.0]'),
    ('disturbance_observer', {'order': 3}, 'must lie within 1 and 2'),
    ('plant', {'effects': 'telepathy: {strength: 1.0}'}, 'telepathy'),
    ('plant', {'effects': 'stribeck_friction: {colour: 1.0}'}, 'colour'),
    ('plant', {'speed': 0.0}, 'lockstep'),
    ('plant', {'disc_speed_times': [0.0, 1.0]}, '2 times and 1 values'),
    ('recorder', {'bag': '/proc/bag'}, 'cannot be made'),
])
def test_bad_parameters_end_in_one_line_and_status_2(runner, node, parameters, told):
    process = runner.start_command(node, node_command(node, parameters=parameters))
    assert process.wait(60.0) == 2
    lines = [line for line in process.output.splitlines() if told in line]
    assert len(lines) == 1, process.output
    assert 'Traceback' not in process.output


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
    assert not change('antiwindup_strategy', 'magic').successful
    assert not change('reference', 'strokes').successful   # read only
    runner.stop()
