# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a refit held, the machine and the load curve's form tell nothing of what is hidden."""
from __future__ import annotations

import numpy as np
import pytest

from tests.proof.cases import Case, draw_case, Request
from tests.proof.generate import parse_strata, plan
from tests.proof.held_numbers import GROUPS
from tests.proof.nominal import moving, residual, rms, torque_of
from tests.proof.sizing import joined


def test_held_numbers_are_drawn_without_regard_to_what_is_hidden() -> None:
    requests = plan(4000, parse_strata(''), np.random.default_rng(11))
    refitted = [one for one in requests if one.refitted]
    assert len(refitted) / len(requests) == pytest.approx(0.6, abs=0.05)
    assert all(set(one.held) == set(GROUPS) for one in requests if not one.refitted)
    for group in GROUPS:
        held = [group in one.held for one in refitted]
        share = np.mean(held)
        for stratum in {one.stratum for one in refitted}:
            of = [group in one.held for one in refitted if one.stratum == stratum]
            # Five standard deviations of a share: chance alone almost never goes so far.
            assert abs(np.mean(of) - share) < 5.0 * np.sqrt(share * (1 - share) / len(of))
        for effect in ('inertia_error', 'torque_offset', 'asymmetric_friction', 'contact_shift'):
            of = [group in one.held for one in refitted if effect in one.effects]
            assert abs(np.mean(of) - share) < 5.0 * np.sqrt(share * (1 - share) / len(of))


def test_the_plan_has_all_that_makes_recordings_differ() -> None:
    requests = plan(1000, parse_strata(''), np.random.default_rng(3))
    assert {one.machine for one in requests} == {'brake', 'joint', 'axis'}
    assert {one.recordings for one in requests} == {1, 2, 3, 4}
    assert np.mean([one.shaped for one in requests]) == pytest.approx(0.25, abs=0.06)
    assert {len(one.effects) for one in requests} == {0, 1, 2, 3}


@pytest.fixture(scope='module')
def clean() -> Case:
    request = Request('clean', (), 'brief', True, ('load', 'inertia'), 'brake', shaped=True)
    return draw_case(request, np.random.default_rng(2))


def test_a_clean_recording_misses_less_than_its_noise(clean: Case) -> None:
    run = joined([one.run for one in clean.trains])
    floor = clean.trains[0].recorded.floor(run, clean.base)
    assert rms(residual(clean.nominal, run, run.effort)) < 0.7 * floor
    assert clean.accepted == ()


def test_what_was_held_is_off(clean: Case) -> None:
    assert set(clean.calibration) == {'load', 'inertia'}
    assert all(0.0 < abs(share) <= 0.03 for share in clean.calibration.values())
    off = clean.nominal.inertia / clean.lacking.inertia - 1.0
    assert off == pytest.approx(clean.calibration['inertia'])


def test_an_effect_that_begins_does_nothing_before() -> None:
    request = Request('strong', ('torque_offset',), 'brief', False, tuple(GROUPS), 'joint',
                      begins=True)
    case = draw_case(request, np.random.default_rng(4))
    assert case.onset is not None
    index, tick = case.onset
    run = case.trains[index].run
    error = run.effort - torque_of(case.base, run)
    offset = float(case.plant['offset'][0])
    move = moving(run.velocity)
    before, after = move.copy(), move.copy()
    before[tick - 5:], after[:tick + 5] = False, False
    assert abs(np.median(error[before])) < 0.1 * abs(offset)
    assert np.median(error[after]) == pytest.approx(offset, rel=0.1)
