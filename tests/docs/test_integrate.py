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


def hazards():
    """Return the rows of the tables of hazards: how it comes about, detected by, reaction, within,
    test."""
    text = (PAGE.parent / 'hazards.md').read_text(encoding='utf-8')
    rows = []
    for section in re.split(r'\n##+ ', text):
        lines = [line for line in section.splitlines() if line.startswith('| ')]
        if lines and lines[0] == '| how it comes about | detected by | reaction | within | test |':
            rows += [re.split(r' \| ', line.strip('| ')) for line in lines[1:]]
    return rows


def test_every_hazard_has_a_test_that_exists_where_it_says():
    tests = Path(__file__).parents[1]
    sources = {where: ''.join(path.read_text(encoding='utf-8')
                              for path in (tests / folder).glob('test_*.py'))
               for where, folder in (('core', 'control'), ('bus', 'can_bus'), ('', 'ros'))}
    rows = hazards()
    assert len(rows) > 60
    for row in rows:
        assert len(row) == 5, row
        named = re.findall(r'`(test_\w+)`(?: \((core|bus)\))?', row[4])
        assert named, f'no test: {row[0]}'
        for name, where in named:
            assert f'def {name}(' in sources[where], (name, where)


def test_the_table_of_hazards_names_causes_and_stops_that_exist():
    text = (PAGE.parent / 'hazards.md').read_text(encoding='utf-8')
    words = {cause.word for cause in Cause}
    named = {word for word in re.findall(r'`(\w+)`', text) if word in words}
    # Each fault and each degradation is a way in which torque could be wrong.
    serious = {cause.word for cause in Cause if CAUSES[cause].severity is not Severity.NOTICE}
    assert serious - named == set()
