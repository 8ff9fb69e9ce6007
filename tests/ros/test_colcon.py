# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The package builds with colcon, and its nodes start as `ros2 run` would start them."""

import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys

import pytest

from engb_ros.interface import EFFORT_COMMAND

ROOT = Path(__file__).resolve().parents[2]
COLCON = Path(sys.executable).parent / 'colcon'
CARRIED = ('engb_core', 'engb_ros', 'tests/proof', 'package.xml', 'setup.py', 'README.md',
           'LICENSE')

pytestmark = pytest.mark.skipif(not COLCON.exists(), reason='colcon is not installed')


def workspace(folder):
    """Make a workspace with a copy of the package, as a fresh clone would be."""
    package = folder / 'src' / 'engb_ros'
    package.mkdir(parents=True)
    for name in CARRIED:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, package / name,
                            ignore=shutil.ignore_patterns('__pycache__', '*.nb[ci]'))
        else:
            shutil.copy(source, package / name)
    return folder


@pytest.mark.parametrize('options', [[], ['--symlink-install']], ids=['plain', 'symlink'])
def test_it_builds_and_runs(tmp_path, runner, probe, options):
    folder = workspace(tmp_path)
    environment = {**os.environ, 'PATH': f'{COLCON.parent}:{os.environ["PATH"]}',
                   'PYTHONWARNINGS': 'ignore'}
    environment.pop('PYTHONPATH', None)
    built = subprocess.run(
        [COLCON, 'build', *options, '--event-handlers', 'console_direct+'], cwd=folder,
        env=environment, capture_output=True, text=True, timeout=200)
    assert built.returncode == 0, built.stdout + built.stderr
    share = folder / 'install/engb_ros/share'
    assert (share / 'ament_index/resource_index/packages/engb_ros').exists()
    for name in ('package.xml', 'launch/one_wheel.launch.xml', 'launch/four_wheels.launch.xml',
                 'config/one_wheel.yaml', 'config/brake.yaml', 'config/vehicle.yaml',
                 'config/diagnostics.yaml', 'config/foxglove_layout.json'):
        assert (share / 'engb_ros' / name).exists(), name
    programs = {path.name for path in (folder / 'install/engb_ros/lib/engb_ros').iterdir()}
    assert {'controller', 'plant', 'disturbance_observer', 'identifier', 'recorder',
            'engb'} <= programs

    # What `ros2 run engb_ros controller` does, from elsewhere, in a sourced shell.
    process = runner.start_command('controller', [
        'bash', '-c', f'source {folder}/install/setup.bash && cd / && exec '
        f'{folder}/install/engb_ros/lib/engb_ros/controller --ros-args -r __ns:=/engb'])
    runner.wait_until(lambda: probe.publishers(EFFORT_COMMAND), 'the controller',
                      pause=probe.spin)
    process.signal(signal.SIGINT)
    assert process.wait() == 0
    shown = subprocess.run(
        ['bash', '-c', f'source {folder}/install/setup.bash && cd / && '
         f'{folder}/install/engb_ros/lib/engb_ros/engb --help'],
        env=environment, capture_output=True, text=True, timeout=60)
    assert shown.returncode == 0, shown.stderr
    assert 'diagnose' in shown.stdout
