"""Launch and parameter files name nothing that isn't there."""

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
OTHERS = {'controller_manager', 'robot_state_publisher'}   # of ros2_control's example
WHEELS = sorted(path for path in (PACKAGE / 'config').glob('*.yaml')
                if 'ros__parameters' in path.read_text(encoding='utf-8'))


def node_class(name):
    """Return the node class behind an executable."""
    module = EntryPoint(name, EXECUTABLES[name].split(':')[0], 'console_scripts').load()
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
                if entry.get('name')} <= declared | {'autostart'}
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
        if pattern.rpartition('/')[2] not in EXECUTABLES:   # ros2_control's
            continue
        specs = {spec.name: spec for spec in node_class(pattern.rpartition('/')[2]).parameters}
        for name, value in entry['ros__parameters'].items():
            assert type(value) is type(specs[name].default), name
            specs[name].check(value)
