# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Launch and parameter files name nothing that isn't there."""

from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path
import re
import xml.etree.ElementTree as ElementTree

import pytest
import yaml

import engb_ros

PACKAGE = Path(engb_ros.__file__).parent
SETUP = (PACKAGE.parent / 'setup.py').read_text(encoding='utf-8')
EXECUTABLES = dict(re.findall(r"'(\w+) = (engb_ros\.[\w.]+:\w+)'", SETUP))
LAUNCH = sorted((PACKAGE / 'launch').glob('*.xml'))
# Packages of others: ros2_control's example, the aggregator of diagnostics.
OTHERS = {'controller_manager', 'robot_state_publisher', 'diagnostic_aggregator'}
WHEELS = sorted(path for path in (PACKAGE / 'config').glob('*.yaml')
                if '/**/' in path.read_text(encoding='utf-8'))
# Nodes that are named otherwise than their executable.
ALIASES = {'standby': 'controller'}


def node_class(name):
    """Return the node class behind an executable."""
    assert callable(EntryPoint(name, EXECUTABLES[name], 'console_scripts').load())
    module = import_module(f'engb_ros.nodes.{name}')
    return next(value for value in vars(module).values()
                if getattr(value, 'node_name', None) == name)


@pytest.mark.parametrize('path', LAUNCH, ids=lambda path: path.stem)
def test_launch_files_fit_the_package(path):
    root = ElementTree.parse(path).getroot()
    arguments = {entry.get('name') for entry in root.findall('arg')}
    for used in re.findall(r'\$\(var (\w+)\)', path.read_text(encoding='utf-8')):
        assert used in arguments
    for node in root.iter('node'):
        if node.get('pkg') in OTHERS:
            continue
        declared = {spec.name for spec in node_class(node.get('exec')).parameters}
        assert node.get('pkg') == 'engb_ros'
        assert {entry.get('name') for entry in node.findall('param')
                if entry.get('name')} <= declared | {'autostart', 'use_sim_time'}
    for include in root.iter('include'):
        other = PACKAGE / 'launch' / Path(include.get('file')).name
        known = {entry.get('name') for entry in ElementTree.parse(other).getroot().findall('arg')}
        assert {entry.get('name') for entry in include.findall('arg')} <= known
    for name in re.findall(r'\$\(find-pkg-share engb_ros\)/([\w./]+)',
                           path.read_text(encoding='utf-8')):
        assert (PACKAGE / name).exists()


@pytest.mark.parametrize('path', WHEELS, ids=lambda path: path.stem)
def test_parameter_files_hold_known_parameters_of_the_right_type(path):
    for pattern, entry in yaml.safe_load(path.read_text(encoding='utf-8')).items():
        name = pattern.rpartition('/')[2]
        if ALIASES.get(name, name) not in EXECUTABLES:   # ros2_control's
            continue
        specs = {spec.name: spec for spec in node_class(ALIASES.get(name, name)).parameters}
        for name, value in entry['ros__parameters'].items():
            assert type(value) is type(specs[name].default), name
            specs[name].check(value)


@pytest.mark.parametrize('path', WHEELS, ids=lambda path: path.stem)
def test_a_standby_is_set_up_as_its_primary_is(path):
    sections = yaml.safe_load(path.read_text(encoding='utf-8'))
    assert sections.get('/**/standby') == sections.get('/**/controller')


def test_each_wheel_has_names_of_its_own():
    wheels = [path for path in WHEELS if path.stem.startswith(('front_', 'rear_'))]
    assert len(wheels) == 4
    told = [yaml.safe_load(path.read_text(encoding='utf-8')) for path in wheels]
    for name in ('joint', 'hardware_id'):
        assert len({entry['/**/controller']['ros__parameters'][name] for entry in told}) == 4
    for entry in told:   # one brake, one joint, whoever speaks of it
        assert len({values['ros__parameters']['joint'] for values in entry.values()}) == 1


def test_the_aggregator_sorts_what_the_nodes_of_each_wheel_say():
    analyzers = yaml.safe_load((PACKAGE / 'config' / 'diagnostics.yaml').read_text(
        encoding='utf-8'))['analyzers']['ros__parameters']
    begins = [entry['startswith'] for entry in analyzers.values() if isinstance(entry, dict)]
    assert sorted(begins) == [[f'{path.stem}: '] for path in WHEELS
                              if path.stem.startswith(('front_', 'rear_'))]


def test_the_launch_can_command_forces():
    root = ElementTree.parse(PACKAGE / 'launch' / 'one_wheel.launch.xml').getroot()
    arguments = {entry.get('name'): entry.get('default') for entry in root.findall('arg')}
    assert {'mechanism', 'model', 'use_sim_time', 'log_level', 'can_interface', 'can_channel',
            'respawn', 'standby', 'autostart'} <= set(arguments)
    assert arguments['mechanism'].endswith('/mechanism.yaml')
    assert arguments['model'].endswith('/brake.yaml')   # a force needs an identified model
