# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whatever the running nodes publish, hear and serve is in the policy, and no more may speak."""

import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import pytest

from engb_ros.files import TRUE_BRAKE
from engb_ros.interface import (
    DEFAULT_NAMESPACE,
    EFFORT_COMMAND,
    JOINT_STATES,
    POSITION_COMMAND,
    SERVICES,
    TOPICS,
)
from engb_ros.processes.runner import node_command
from engb_ros.security import ENCLAVES, main, may_publish, policy


def allowed(name):
    """Return what an enclave may do: {rule: {full names}}."""
    profile = next(entry for entry in policy().iter('profile') if entry.get('node') == name)
    rules = {}
    for rule in profile:
        what = next(iter(rule.attrib))
        for entry in rule:
            full = entry.text.replace('~', f'{DEFAULT_NAMESPACE}/{name}')
            rules.setdefault(what, set()).add(
                full if full.startswith('/') else f'{DEFAULT_NAMESPACE}/{full}')
    return rules


def names(found):
    return {name for name, _ in found if not name.startswith('rt/')}


def test_every_endpoint_of_the_nodes_is_in_the_policy(runner, probe, bus, tmp_path):
    nodes = {'plant': {}, 'controller': {}, 'standby': {'standby': True},
             'disturbance_observer': {}, 'identifier': {},
             'recorder': {'bag': str(tmp_path / 'bag')}, 'monitor': {'model': str(TRUE_BRAKE)},
             'can_bridge': bus, 'drive_emulator': bus}
    for name, parameters in nodes.items():
        runner.start_command(name, node_command(
            'controller' if name == 'standby' else name, name=name, parameters=parameters))
    graph = probe.node
    for name in nodes:
        def endpoints(name=name):
            try:
                served = names(graph.get_service_names_and_types_by_node(name, DEFAULT_NAMESPACE))
                return served if any('get_state' in each for each in served) else None
            except Exception:   # not there yet
                return None
        runner.wait_until(endpoints, name, pause=probe.spin, timeout=60.0)
    runner.wait_until(lambda: probe.publishers(JOINT_STATES) >= 2, 'all', pause=probe.spin,
                      timeout=60.0)
    for name in nodes:
        rules = allowed(name)
        for ask, rule in ((graph.get_publisher_names_and_types_by_node, 'publish'),
                          (graph.get_subscriber_names_and_types_by_node, 'subscribe'),
                          (graph.get_service_names_and_types_by_node, 'reply')):
            missing = names(ask(name, DEFAULT_NAMESPACE)) - rules[rule]
            assert not missing, f'{name} may not {rule} {missing}'
    runner.stop()


def test_who_may_command():
    assert may_publish(POSITION_COMMAND) == ('stack',)
    assert set(may_publish(EFFORT_COMMAND)) == {'controller', 'standby', 'excitation'}
    assert set(may_publish(JOINT_STATES)) == {'plant', 'can_bridge'}
    for topic in TOPICS:
        assert set(may_publish(topic)) <= set(ENCLAVES)
    for name in ENCLAVES:
        asked = allowed(name).get('request', set())
        assert any('set_parameters' in each for each in asked) == (name == 'service')
        assert any('change_state' in each for each in asked) == (
            name in ('service', 'lifecycle_manager'))
        # Of a primary and its standby whoever may ask the one may ask the other.
        assert {each.replace('/standby/', '/controller/') for each in asked
                if '/standby/' in each} == {each for each in asked if '/controller/' in each}


def test_every_service_has_a_node():
    for service in SERVICES:
        assert service.meaning.partition(':')[0] in ENCLAVES


def tool():
    """Return `ros2 security` as a command; None where it is not installed."""
    program = shutil.which('ros2')
    if program is None or subprocess.run(
            [program, 'security', '--help'], capture_output=True, check=False).returncode:
        return None
    return [program, 'security']


def test_sros2_makes_the_keys_of_every_enclave(tmp_path):
    security = tool()
    if security is None:
        pytest.skip('ros2 security is not installed')
    path, keys = tmp_path / 'policy.xml', tmp_path / 'keys'
    assert main(['--out', str(path)]) == 0
    for words in (['create_keystore', str(keys)],
                  ['generate_artifacts', '-k', str(keys), '-p', str(path)]):
        ran = subprocess.run([*security, *words], capture_output=True, text=True, check=False)
        assert ran.returncode == 0, ran.stderr

    def may_send(name, topic):
        root = ElementTree.parse(
            keys / f'enclaves{DEFAULT_NAMESPACE}' / name / 'permissions.xml').getroot()
        return any((entry.text or '').endswith(topic)
                   for rule in root.iter('publish') for entry in rule.iter('topic'))

    for topic, names in (('effort_command', {'controller', 'standby', 'excitation'}),
                         ('position_command', {'stack'}),
                         ('clear_faultsRequest', {'stack', 'service'}),
                         ('change_stateRequest', {'service', 'lifecycle_manager'}),
                         ('set_parametersRequest', {'service'})):
        assert {name for name in ENCLAVES if may_send(name, topic)} == names, topic


def test_it_overwrites_nothing(tmp_path, capsys):
    path = tmp_path / 'policy.xml'
    assert main(['--out', str(path)]) == 0
    before = path.read_text()
    assert main(['--out', str(path)]) == 2
    assert path.read_text() == before
    assert 'cannot be written' in capsys.readouterr().err


@pytest.mark.parametrize('namespace', ['/engb', '/front_left'])
def test_a_policy_for_each_wheel(namespace):
    for enclave in policy(namespace).iter('enclave'):
        assert enclave.get('path').startswith(f'{namespace}/')


def test_a_node_that_cannot_be_secured_does_not_start_and_says_so_in_one_line(tmp_path):
    """Without its keys, or with a DDS that was built without security."""
    (tmp_path / 'enclaves').mkdir()
    ran = subprocess.run(
        [sys.executable, '-m', 'engb_ros.start', 'controller'], capture_output=True,
        text=True, check=False, timeout=60.0, env={
            **os.environ, 'ROS_SECURITY_ENABLE': 'true', 'ROS_SECURITY_STRATEGY': 'Enforce',
            'ROS_SECURITY_KEYSTORE': str(tmp_path)})
    told = [line for line in ran.stderr.splitlines() if 'could not be created' in line]
    assert (ran.returncode, len(told)) == (2, 1), ran.stderr
    assert 'Traceback' not in ran.stderr
