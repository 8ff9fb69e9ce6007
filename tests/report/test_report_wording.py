# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Numbers and names as an engineer writes them."""

from __future__ import annotations

import pytest

from engb_core.diagnose.diagnosis import ParameterEstimate, Zone
from engb_core.report.text import clean, escape, shorten
from engb_core.report.wording import (
    effect_name,
    estimate,
    number,
    percent,
    probability,
    quantities,
    quantity,
    zone_range,
)


def plain(text: str) -> str:
    return text.replace('\u202f', ' ')


@pytest.mark.parametrize(('value', 'text'), [
    (0.0, '0'), (21.34, '21.3'), (-0.5, '−0.500'), (9.996, '10.0'), (123456, '123456'),
    (6.813e-5, '6.81 × 10⁻⁵'), (-1.5e7, '−1.50 × 10⁷'), (float('nan'), '–'),
    (5e-324, '4.94 × 10⁻³²⁴')])
def test_number(value, text):
    assert plain(number(value)) == text


@pytest.mark.parametrize(('value', 'unit', 'text'), [
    (0.0213, 'N·m', '21.3 mN·m'), (0.312, 'rad', '0.312 rad'), (2e-5, 's', '20.0 µs'),
    (1.42, '-', '1.42'), (0.001125, 'N·m·s/rad', '0.00112 N·m·s/rad')])
def test_quantity(value, unit, text):
    assert plain(quantity(value, unit)) == text


def test_quantities_share_unit_and_decimals():
    assert [plain(text) for text in quantities((0.0213, 0.0049), 'N·m')] == ['21.3', '4.9 mN·m']
    assert [plain(text) for text in quantities((0.312, 0.051), 'rad')] == ['0.312', '0.051 rad']
    assert [plain(text) for text in quantities((0.0, 0.0), 'rad')] == ['0.00', '0.00 rad']


@pytest.mark.parametrize(('value', 'std', 'unit', 'text'), [
    (1.42, 0.031, '-', '1.420 ± 0.031'), (0.81, 0.04, 'rad/s', '0.81 ± 0.04 rad/s'),
    (0.0108, 0.0002, 'N·m', '10.80 ± 0.20 mN·m'),
    (6.813e-5, 4.1e-7, 'kg·m²', '(6.81 ± 0.04) × 10⁻⁵ kg·m²'),
    (-12.0, 30.0, '-', '−12 ± 30'), (3.0, 0.0, 's', '3.000 s'),
    (0.05, None, 'rad', '50 mrad (not determined)')])
def test_estimate(value, std, unit, text):
    assert plain(estimate(ParameterEstimate(value, std, unit))) == text


def test_percent_never_claims_too_much():
    assert plain(percent(0.004)) == '< 1 %' and plain(percent(0)) == '0 %'
    assert plain(probability(0.999)) == '> 99 %' and plain(probability(0.0)) == '< 1 %'


def test_names():
    assert effect_name('stribeck_friction') == 'Stribeck friction'
    assert effect_name('coulomb_friction_error') == 'wrong Coulomb friction'
    assert effect_name('self_energizing', start=True) == 'Self-energizing'


def test_zone_range():
    assert plain(zone_range(Zone('velocity', -2, 2, 'rad/s', 1))) == 'velocity −2 to 2 rad/s'
    assert plain(zone_range(Zone('load', 0.02, 0.08, 'N·m', 1))) == 'load torque 20 to 80 mN·m'
    assert zone_range(Zone('direction', -1, 0, '-', 1)) == 'releasing'
    assert plain(zone_range(Zone('x', 3, float('inf'), 's', 1))) == 'x above 3 s'


def test_text():
    assert escape('<a href="x">&') == '&lt;a href=&quot;x&quot;&gt;&amp;'
    assert clean('a\u202eb\x00c\ud800') == 'a\ufffdb\ufffdc\ufffd'
    assert shorten('abcdefghij', 5) == 'ab…ij' and shorten('short') == 'short'
