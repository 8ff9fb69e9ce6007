# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Pooling, trends, causes and the page, on fleets whose truth is known."""

import numpy as np
import pytest

from engb_core.fleet.common_causes import causes_of, outliers_of
from engb_core.fleet.pooling import pool, random_effects
from engb_core.fleet.rows import effect_rows, Entry, measures_of, recording_rows
from engb_core.fleet.survey_page import survey_page
from engb_core.fleet.trends import false_discovery, find_trends

DAY = 86400.0


def entry(unit, number, inertia=6.8e-5, effects=(), std=1e-7, mileage=None, rms=0.005):
    """Make one diagnosed recording; `effects` are (name, probability, parameters)."""
    return Entry(f'{unit}/run_{number}', unit, mileage, {
        'status': 'ok', 'message': '', 'namespace': None, 'start': 1.7e9 + number * DAY,
        'duration': 60.0, 'samples': 60000, 'seconds': 1.0, 'report': None,
        'nominal': [{'name': 'inertia', 'before': 7e-5, 'after': inertia, 'std': std,
                     'unit': 'kg·m²'}],
        'document': {
            'verdict': 'explained' if effects else 'consistent',
            'effects': [{'effect': name, 'probability': probability, 'share': 0.5,
                         'alternatives': [], 'statement': 'x', 'parameters': {
                             key: {'value': value, 'std': abs(value) / 50, 'unit': '-'}
                             for key, value in parameters.items()}}
                        for name, probability, parameters in effects],
            'fit': {'held_out': [{'recording': 'r', 'quantity': 'effort', 'rms_before': 0.02,
                                  'rms_after': rms, 'noise_floor': 0.005, 'unit': 'N·m'}]}}})


def bad(unit):
    """Make a recording that could not be diagnosed."""
    return Entry(f'{unit}/bad', unit, None, {
        'status': 'refused', 'message': '<script>alert(1)</script>', 'namespace': None,
        'seconds': 0.1})


def test_random_effects_finds_mean_and_spread():
    rng = np.random.default_rng(1)
    std = rng.uniform(0.05, 0.2, 400)
    value = 3 + 0.5 * rng.standard_normal(400) + std * rng.standard_normal(400)
    mean, error, between, chance = random_effects(value, std)
    assert abs(mean - 3) < 4 * error < 0.2
    assert between == pytest.approx(0.5, rel=0.15)
    assert chance < 1e-6
    same = random_effects(3 + std * rng.standard_normal(400), std)
    assert same[2] < 0.05
    assert same[3] > 1e-3
    assert random_effects([2.0], [0.5]) == (2.0, 0.5, 0.0, 1.0)


def fleet(spread, rng):
    """Eight units of four recordings; their inertia lies apart by `spread`."""
    return [entry(f'u{unit}', number, 6.8e-5 + offset + 3e-7 * rng.standard_normal(), std=3e-7)
            for unit, offset in enumerate(spread * rng.standard_normal(8)) for number in range(4)]


def test_units_that_differ_are_told_from_units_that_do_not():
    rng = np.random.default_rng(2)
    apart, = pool(measures_of(fleet(4e-6, rng)))
    assert apart.heterogeneous
    assert 1.5e-6 < apart.between < 8e-6
    assert len(apart.units) == 8 and apart.units[0].count == 4
    same = [pool(measures_of(fleet(0.0, rng)))[0].heterogeneous for _ in range(40)]
    assert sum(same) <= 4


def test_one_unit_out_of_line():
    rng = np.random.default_rng(3)
    entries = fleet(5e-7, rng) + [entry('odd', number, 9e-5, std=3e-7) for number in range(4)]
    outliers = outliers_of(entries, pool(measures_of(entries)))
    assert {outlier.unit for outlier in outliers} == {'odd'}
    assert 'above' in outliers[0].statement


def test_one_recording_out_of_line():
    entries = [entry('a', number) for number in range(8)] + [entry('a', 9, rms=0.2)]
    outlier, = outliers_of(entries, [])
    assert outlier.key == 'a/run_9' and outlier.quantity == 'residual'


def test_common_cause_and_single_one():
    stribeck = ('stribeck_friction', 0.9, {'breakaway_ratio': 1.4})
    gap = ('backlash', 0.95, {'gap': 0.3})
    weak = ('pad_creep', 0.3, {})
    entries = [entry(f'u{unit}', number, effects=[stribeck, weak] + ([gap] if unit == 2 else []))
               for unit in range(4) for number in range(3)]
    first, second = causes_of(entries)
    assert (first.effect, first.common, len(first.on)) == ('stribeck_friction', True, 4)
    assert (second.effect, second.common, second.on) == ('backlash', False, ('u2',))
    assert second.share == {'u0': 0.0, 'u1': 0.0, 'u2': 1.0, 'u3': 0.0}


def test_an_effect_that_appeared():
    creep = ('pad_creep', 0.9, {'relaxed_fraction': 0.2})
    seen = {'u0': (3, 4), 'u1': (1, 2, 4), 'u2': (4,), 'u3': range(5)}
    entries = [entry(unit, number, effects=[creep] if number in numbers else [])
               for unit, numbers in seen.items() for number in range(5)]
    cause, = causes_of(entries[::-1])
    assert cause.first == {'u0': 'u0/run_3'}
    assert not cause.common                             # on two of four: that is not most
    text = survey_page(entries, backend=None).html()
    assert 'in no recording before u0/run_3' in text


def test_wear_over_mileage_is_found_and_noise_is_not():
    rng = np.random.default_rng(4)

    def worn(slope):
        return [entry(f'u{unit}', number, inertia=6.8e-5 + 1e-7 * rng.standard_normal(),
                      mileage=1000.0 * number, effects=[('contact_shift', 0.9, {
                          'shift': unit + slope * number + 0.02 * rng.standard_normal()})])
                for unit in range(3) for number in range(6)]

    found = find_trends(measures_of(worn(0.1)))
    assert {trend.quantity for trend in found} == {'contact_shift.shift'}
    common = next(trend for trend in found if not trend.unit and trend.over == 'mileage')
    assert common.slope == pytest.approx(1e-4, abs=3 * common.std)
    assert {trend.unit for trend in found} >= {'', 'u0', 'u1', 'u2'}
    false = [bool(find_trends(measures_of(worn(0.0)))) for _ in range(40)]
    assert sum(false) <= 6      # one in twenty, and chance


def test_false_discovery():
    kept = false_discovery(np.array([0.5, 1e-6, 0.03, 0.04]), 0.05)
    assert kept.tolist() == [False, True, False, False]
    assert false_discovery(np.zeros(0), 0.05).size == 0


@pytest.mark.parametrize('backend', ['plotly', 'table'])
def test_page_and_rows(backend):
    rng = np.random.default_rng(5)
    entries = [entry(f'u<{unit}>', number, 6.8e-5 + unit * 3e-6, mileage=500.0 * number, effects=[
        ('stribeck_friction', 0.9, {'breakaway_ratio': 1.2 + 0.05 * number
                                    + 0.002 * rng.standard_normal()})])
        for unit in range(4) for number in range(5)] + [bad('u9')]
    html = survey_page(entries, backend=backend).html()
    assert '<script>alert' not in html
    for words in ('Stribeck friction', 'common cause', 'units differ', 'per 1000 km',
                  'Not diagnosed', 'u&lt;0&gt;'):
        assert words in html
    rows = recording_rows(entries)
    assert len(rows) == 21 and len({tuple(row) for row in rows}) == 1
    assert len({tuple(row) for row in effect_rows(entries)}) == 1
    assert len(effect_rows(entries)) == 40


@pytest.mark.parametrize('entries', [[], [bad('u')], [entry('u', 0)]])
def test_little_to_say(entries):
    assert '<h1>' in survey_page(entries, backend='table').html()
