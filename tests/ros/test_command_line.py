# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What nodes answer on the command line: help that is true, and options that are none."""

from importlib import import_module
import sys

import pytest

from engb_core.bench.settings import BenchSettings
from engb_ros.files import config_file, TRUE_BRAKE
from engb_ros.interface import EFFORT_COMMAND, JOINT_STATES, SERVICES
from engb_ros.nodes.base import ManagedNode
from engb_ros.nodes.command_line import answer_without_ros, ENDPOINTS, help_text
from engb_ros.processes.runner import RunnerTimeout

NODES = ('can_bridge', 'controller', 'disturbance_observer', 'drive_emulator', 'excitation',
         'identifier', 'monitor', 'plant', 'recorder')

# Of rclpy and of managed nodes themselves.
OF_ROS = ('/rosout', '/parameter_events', 'transition_event', '/get_', '/set_', '/list_',
          '/describe_', '/change_state')


def node_class(name):
    found = [entry for entry in vars(import_module(f'engb_ros.nodes.{name}')).values()
             if isinstance(entry, type) and issubclass(entry, ManagedNode)
             and vars(entry).get('node_name') == name]
    assert len(found) == 1
    return found[0]


@pytest.mark.parametrize('name', NODES)
def test_every_node_helps_and_ends(runner, name):
    process = runner.start_command(name, [sys.executable, '-m', 'engb_ros.start', name, '--help',
                                          '--ros-args', '-r', '__ns:=/engb'])
    assert process.wait(60.0) == 0
    assert process.output.strip() == help_text(node_class(name))
    assert process.output.startswith(f'usage: ros2 run engb_ros {name} ')
    for spec in node_class(name).parameters:
        assert f'  {spec.name} := ' in process.output


@pytest.mark.parametrize('words', [
    ['-p', 'amplitude:=0.1'], ['amplitude:=0.1'], ['--amplitude', '0.1'],
    ['--ros-args', '-r', '__ns:=/engb', '--', '--verbose'], ['now']])
def test_what_is_no_option_is_refused_before_anything_is_sent(runner, words):
    process = runner.start_command('excitation', [sys.executable, '-m', 'engb_ros.start',
                                                  'excitation', *words])
    assert process.wait(60.0) == 2
    assert process.output.count('\n') == 1, process.output
    assert process.output.startswith('excitation: ')
    assert '--ros-args -p name:=value' in process.output


@pytest.mark.parametrize('words', [
    [], ['--ros-args', '-p', 'rate:=1.0'], ['--ros-args', '-p', 'rate:=1.0', '--']])
def test_what_is_for_ros_is_left_to_it(words):
    assert answer_without_ros(ManagedNode, ['plant', *words]) is None


def parameters(name, folder, bus):
    return {'recorder': {'bag': str(folder / 'bag')}, 'can_bridge': bus, 'drive_emulator': bus,
            'monitor': {'model': str(TRUE_BRAKE)},
            'controller': {'model': str(TRUE_BRAKE), 'standby': True,
                           'observer_timeout': 0.2,
                           'mechanism': str(config_file('mechanism.yaml'))},
            'plant': {'publish_clock': True, 'bench': str(folder / 'bench.yaml')}}.get(name, {})


@pytest.mark.parametrize('name', NODES)
def test_the_help_names_the_topics_and_services_that_a_node_has(runner, probe, tmp_path, bus,
                                                                 name):
    BenchSettings().write(tmp_path / 'bench.yaml')
    runner.start(name, parameters=parameters(name, tmp_path, bus))
    graph = probe.node

    def seen():
        if name not in graph.get_node_names():
            return None
        kinds = [look(name, '/engb') for look in (
            graph.get_publisher_names_and_types_by_node,
            graph.get_subscriber_names_and_types_by_node,
            graph.get_service_names_and_types_by_node)]
        helper = f'_{name}_models'   # answers one of its services, beside it
        if helper in graph.get_node_names():
            kinds[2] += graph.get_service_names_and_types_by_node(helper, '/engb')
        return [{topic for topic, _ in kind if not any(word in topic for word in OF_ROS)}
                for kind in kinds]

    told = ENDPOINTS[name]
    services = {f'/engb/{service.name.replace("~", name)}' for service in SERVICES
                if service.meaning.startswith(f'{name}: ')}
    wanted = [{graph.resolve_topic_name(topic.name) for topic in topics} for topics in told]
    if EFFORT_COMMAND in told.hears and JOINT_STATES in told.publishes:
        wanted[1].discard('/engb/joint_command')   # by parameter, in the other one's place
    try:
        runner.wait_until(lambda: seen() == [*wanted, services], 'the graph', pause=probe.spin)
    except RunnerTimeout:
        assert seen() == [*wanted, services]
