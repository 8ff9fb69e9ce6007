# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Fleets of many effects, of one unit that stands out, and of numbers without a deviation."""

import math

import numpy as np
import pytest

from engb_core.effects.catalogue import catalogue
from engb_core.fleet import survey_page as page_module
from engb_core.fleet.pooling import pool
from engb_core.fleet.rows import measures_of
from engb_core.fleet.survey_page import survey_page
from engb_core.fleet.trends import _slope
from engb_ros.fleet.find import find_recordings, Found
from engb_ros.fleet.store import Store

from .test_statistics import entry


def test_an_effect_on_one_unit_alone_is_told_with_the_unit():
    effect = [('backlash', 0.9, {'gap': 0.01})]
    entries = [entry(f'u{unit}', number, effects=effect if unit == 1 else ())
               for unit in range(4) for number in range(2)]
    text = survey_page(entries).html()
    assert '<b>u1</b> only: look at that unit.' in text


def test_one_unit_differs_from_no_other():
    text = survey_page([entry('u1', 0, effects=[('backlash', 0.9, {'gap': 0.01})])]).html()
    assert 'differs from unit to unit' not in text
    assert 'on u1: the model lacks it' in text


def test_every_effect_of_the_page_is_told_on_the_terminal(capsys):
    from engb_ros.commands.survey import _summary
    effect = [('backlash', 0.9, {'gap': 0.01})]
    entries = [entry('u1', number, effects=effect if number == 0 else ()) for number in range(3)]
    assert 'backlash: 1 of 3 recordings' in _summary(entries, 0)


def test_more_effects_than_columns_are_listed():
    names = sorted(name for name in catalogue() if not name.startswith('unexplained'))[:10]
    effects = [(name, 0.9, {}) for name in names]
    text = survey_page([entry(f'u{unit}', 0, effects=effects) for unit in range(2)]).html()
    assert 'Also found: ' in text


def test_a_unit_out_of_line_stands_in_the_headline_and_in_a_table():
    rng = np.random.default_rng(4)
    entries = [entry(f'u{unit}', number, 6.8e-5 * (1.5 if unit == 3 else 1.0)
                     + 1e-7 * rng.standard_normal())
               for unit in range(8) for number in range(3)]
    text = survey_page(entries).html()
    assert 'Out of line: u3.' in text
    assert 'No unit and no recording lies further' not in text


def test_more_recordings_than_a_page_lists_are_counted(monkeypatch):
    monkeypatch.setattr(page_module, '_RECORDINGS', 3)
    text = survey_page([entry('u', number) for number in range(5)]).html()
    assert '2 more in survey.csv.' in text


def test_numbers_without_deviation_are_pooled_by_what_is_usual():
    entries = [entry(f'u{unit}', number, 7e-5 * (1.0 + 0.001 * number), std=None)
               for unit in range(2) for number in range(3)]
    pooled, = pool(measures_of(entries))
    assert pooled.mean == pytest.approx(7e-5, rel=0.01)
    assert [unit.distance for unit in pooled.units] == [None, None]     # two tell no outlier


def test_a_number_that_is_none_is_no_measure():
    entries = [entry('u', number, value) for number, value in enumerate((7e-5, math.nan, None))]
    assert [measure.value for measure in measures_of(entries)] == [7e-5]


def test_a_straight_line_is_sure():
    x = np.arange(6.0)
    slope, std, chance = _slope(x, 2.0 * x, np.zeros(6, int))
    assert slope == pytest.approx(2.0) and std < 1e-9 and chance == 0.0
    assert _slope(x, 0.0 * x, np.zeros(6, int)) is None


def test_two_folders_of_one_name_are_told_apart(tmp_path):
    for place in ('one', 'two'):
        folder = tmp_path / place / 'data' / 'unit'
        folder.mkdir(parents=True)
        (folder / 'run.mcap').write_bytes(b'x')
    found = find_recordings([str(tmp_path / 'one' / 'data'), str(tmp_path / 'two' / 'data')])
    assert len({recording.key for recording in found}) == 2


def test_numpy_s_numbers_are_kept_as_numbers(tmp_path):
    (tmp_path / 'a.mcap').write_bytes(b'x')
    recording = Found('a.mcap', tmp_path / 'a.mcap', 'a')
    kept = Store(tmp_path / 'out', {}).save(recording, [{
        'status': 'ok', 'value': np.float64(2.5), 'count': np.int64(3), 'lost': np.float32('nan'),
        'list': (np.float64(1.0),)}])
    assert kept == [{'status': 'ok', 'value': 2.5, 'count': 3, 'lost': None, 'list': [1.0]}]
