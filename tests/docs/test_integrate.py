# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The page for integrators says what the code says."""

import json
from pathlib import Path
import re
import xml.etree.ElementTree as ElementTree

import pytest

pytest.importorskip('rclpy')

from benchmarks.faults import FAULTS, UNTIMED  # noqa: E402
from docs.make_integration_tables import filled, PAGE, tables  # noqa: E402
from engb_core.control.causes import Cause, CAUSES, Severity  # noqa: E402
from engb_ros.files import config_file  # noqa: E402
from engb_ros.interface import DIAGNOSTICS, TOPICS  # noqa: E402

TEXT = PAGE.read_text(encoding='utf-8')


def test_the_tables_are_up_to_date():
    assert filled(TEXT) == TEXT, 'run docs/make_integration_tables.py again'
    assert set(re.findall(r'<!-- table (.+?) -->', TEXT)) == set(tables())


def test_the_table_of_faults_is_that_of_the_measurement():
    for fault in FAULTS:
        assert f'| {fault.name} | {fault.bound} |' in TEXT
        assert fault.limit > 0.0   # the promise is a number too
        assert f'| {fault.reaction} | `{fault.test}` |' in TEXT
    for name, bound, reaction, test in UNTIMED:
        assert f'| {name} | {bound} | - | - | {reaction} | `{test}` |' in TEXT


def test_every_test_named_in_the_table_of_faults_exists():
    sources = ''.join(path.read_text(encoding='utf-8')
                      for path in Path(__file__).parents[1].glob('*/test_*.py'))
    named = set(re.findall(r'`(test_\w+)`', TEXT))
    assert len(named) > 8
    assert all(f'def {name}(' in sources for name in named)


def test_the_plot_layout_names_topics_that_exist():
    known = {topic.name for topic in (*TOPICS, DIAGNOSTICS)}
    curves = ElementTree.parse(config_file('plotjuggler_layout.xml')).iter('curve')
    assert all(curve.get('name').split('/')[2] in known for curve in curves)
    layout = json.loads(config_file('foxglove_layout.json').read_text(encoding='utf-8'))
    named = set(re.findall(r'/engb/(\w+)', json.dumps(layout['configById'])))
    assert len(named) > 6
    assert named <= known
    panels = set(re.findall(r'"(\w+!\w+)"', json.dumps(layout['layout'])))
    assert panels == set(layout['configById'])


def test_every_test_named_in_the_table_of_hazards_exists_where_it_says():
    text = (PAGE.parent / 'hazards.md').read_text(encoding='utf-8')
    tests = Path(__file__).parents[1]
    rows = [line for line in text.splitlines() if line.startswith('| ') and '`test_' in line]
    assert len(rows) > 30
    core = ''.join(path.read_text(encoding='utf-8')
                   for path in (tests / 'control').glob('test_*.py'))
    real = ''.join(path.read_text(encoding='utf-8') for path in (tests / 'ros').glob('test_*.py'))
    for row in rows:
        for name, where in re.findall(r'`(test_\w+)`( \(core\))?', row):
            assert f'def {name}(' in (core if where else real), name


def test_the_table_of_hazards_names_causes_and_stops_that_exist():
    text = (PAGE.parent / 'hazards.md').read_text(encoding='utf-8')
    words = {cause.word for cause in Cause}
    named = {word for word in re.findall(r'`(\w+)`', text) if word in words}
    # Each fault and each degradation is a way in which torque could be wrong.
    serious = {cause.word for cause in Cause if CAUSES[cause].severity is not Severity.NOTICE}
    assert serious - named == set()
