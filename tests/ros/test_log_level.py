# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Nodes run at their default log level: rclpy raises where one call logs at two severities."""

import ast
import os
from pathlib import Path
import subprocess
import sys

import pytest

from engb_ros.processes.runner import node_command

ROOT = Path(__file__).resolve().parents[2]
SEVERITIES = {'debug', 'info', 'warning', 'warn', 'error', 'fatal'}
STARTERS = sorted([*(ROOT / 'engb_ros').rglob('*.py'), *(ROOT / 'benchmarks').glob('*.py'),
                   *(path for path in (ROOT / 'tests').rglob('*.py') if path != Path(__file__))])
NODES = sorted((ROOT / 'engb_ros').rglob('*.py'))


def of_a_logger(node):
    """Whether an attribute is a severity of `get_logger()`, or of a name that says it is one."""
    owner = node.value
    if isinstance(owner, ast.Call):
        owner = owner.func
    name = owner.attr if isinstance(owner, ast.Attribute) else getattr(owner, 'id', '')
    return node.attr in SEVERITIES and 'log' in name


@pytest.mark.parametrize('path', NODES, ids=lambda path: str(path.relative_to(ROOT)))
def test_each_call_of_a_logger_has_one_severity(path):
    tree = ast.parse(path.read_text(encoding='utf-8'))
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    chosen = [node.lineno for node in ast.walk(tree) if isinstance(node, ast.Attribute)
              and of_a_logger(node) and id(node) not in called]
    assert not chosen, f'{path}: line {chosen}: a logger\'s method is passed on, not called'


def test_nothing_starts_a_node_at_another_level():
    assert '--log-level' not in node_command('plant')
    for path in STARTERS:
        assert '--log-level' not in path.read_text(encoding='utf-8'), path


FIRST_LINE = '''
import sys, time
import rclpy
from engb_ros.nodes.controller import ControllerNode

rclpy.init()
node = ControllerNode()
begin = time.process_time()
node.get_logger().warning('a fault')
print(time.process_time() - begin)
'''


def test_the_first_line_of_a_log_does_not_stop_the_loop(domain):
    """It is that of a fault or of taking over; rclpy had spent 20 to 50 ms on it."""
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain)}
    took = min(float(subprocess.run([sys.executable, '-c', FIRST_LINE], env=environment,
                                    check=True, capture_output=True, text=True,
                                    timeout=60).stdout)
               for _ in range(3))
    assert took < 0.012
