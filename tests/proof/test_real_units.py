# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Numbers of a real machine over its recordings and over its units, and driven with no loop.

No two units of one machine are among the recordings of others: two units of a simulated machine
that differ in friction stand for them.
"""
from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
import yaml

from engb_core.errors import InputError
from tests.proof import real_spread
from tests.proof.real_ladder import plain_rungs, position_error, Prediction
from tests.proof.real_numbers import driven, effort_left, numbers_of, Piece, position_left, refit
from tests.proof.real_page import real_page
from tests.proof.real_sets import RealSet, sets_in
from tests.proof.real_spread import folds_of, spread
from tests.proof.real_text import as_text, sums_of
from tests.proof.real_transfer import transfer
from tests.proof.recorded_unit import recorded
from tests.proof.signals import RATE, Signals

SHARED = Path(__file__).resolve().parents[3] / 'shared' / 'real'

# Of the simulated machine, by its own numbers: friction turns within 1 rad/s.
FILE = {
    'format': 'engb-model/1', 'joint': {'name': 'motor'},
    'motor': {'torque_constant': 1.0, 'inertia': 7e-5, 'viscous_friction': 1.5e-3},
    'load_torque': {'form': 'polynomial', 'coefficients': [0.0]},
    'friction': {'coulomb': 0.016, 'load_gain': 0.0, 'saturation_velocity': 0.5}}
BEST = {**FILE, 'motor': {**FILE['motor'], 'viscous_friction': 1e-3},
        'friction': {**FILE['friction'], 'coulomb': 0.012},
        'effects': [{'effect': 'torque_offset', 'parameters': {'offset': -0.01}}]}
CLAIMS = [{'effect': 'torque_offset', 'probability': 0.9,
           'parameters': {'offset': {'value': -0.01, 'std': 2e-4, 'unit': 'N·m'}}}]


@pytest.fixture(scope='module')
def units(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of two sets: unit_b has twice the friction of unit_a."""
    home = tmp_path_factory.mktemp('units')
    for number, (unit, coulomb) in enumerate((('unit_a', 0.012), ('unit_b', 0.024))):
        folder = home / unit
        folder.mkdir()
        (folder / 'nominal.yaml').write_text(yaml.safe_dump(FILE), 'utf8')
        for seed, name in enumerate(('train', 'holdout')):
            recorded(folder, name, 10 * number + seed, 5.0, rate=250.0, coulomb=coulomb)
    (home / 'unit_b' / 'set.yaml').write_text('machine_of: unit_a\n', 'utf8')
    return home


@pytest.fixture(scope='module')
def apart(units: Path) -> dict:
    """The spread over motions of unit_a; beside its true causes stands one without influence."""
    best = deepcopy(BEST)
    best['effects'].append({'effect': 'asymmetric_friction', 'parameters': {
        'asymmetry': 1e-3, 'growth': 0.4, 'of_drag': 1.0}})
    claims = [*CLAIMS, {'effect': 'asymmetric_friction', 'probability': 0.5, 'parameters': {
        'growth': {'value': 0.4, 'std': 0.01, 'unit': '-'}}}]
    first, _ = sets_in(units)
    return spread(best, FILE, claims, first.train, first.band)


def _rung(unit: RealSet) -> Callable[[str, dict], dict]:
    def rung(label: str, model: dict) -> dict:
        left = effort_left([Piece(path) for path in unit.holdout], unit.band)(model)
        error = {'train': None, 'holdout': float(np.sqrt(np.mean(left ** 2)))}
        return {'rung': label, 'force': error, 'moving': error,
                'position': dict.fromkeys(error), 'driven': dict.fromkeys(error)}
    return rung


def test_a_set_says_of_which_machine_it_is_another_unit(units: Path) -> None:
    assert [(one.name, one.machine_of) for one in sets_in(units)] == [
        ('unit_a', ''), ('unit_b', 'unit_a')]


@pytest.mark.parametrize(('text', 'told'), [
    ('machine_of: unit_c\n', 'no other set here'),
    ('machine_of: unit_b\n', 'no other set here'),
    ('machine: unit_a\n', 'may hold only machine_of'),
    ('machine_of: [unit_a\n', 'cannot be read as YAML'),
])
def test_a_description_that_says_something_else_is_refused(text: str, told: str, tmp_path: Path,
                                                          ) -> None:
    for unit in ('unit_a', 'unit_b'):
        (tmp_path / unit).mkdir()
        (tmp_path / unit / 'nominal.yaml').write_text(yaml.safe_dump(FILE), 'utf8')
        for name in ('train.mcap', 'holdout.mcap'):
            (tmp_path / unit / name).write_bytes(b'')
    (tmp_path / 'unit_b' / 'set.yaml').write_text(text, 'utf8')
    with pytest.raises(InputError, match=told):
        sets_in(tmp_path)


def test_a_model_of_one_unit_holds_for_another_but_for_its_friction(units: Path) -> None:
    first, unit = sets_in(units)
    own = deepcopy(BEST)
    own['friction']['coulomb'] = 0.024
    found = transfer(unit, first, BEST, CLAIMS, own, _rung(unit))
    file, as_it_is, refitted, best = (rung['force']['holdout'] for rung in found['rungs'])
    assert refitted < 0.4 * as_it_is
    assert refitted < 0.6 * file
    assert refitted == pytest.approx(best, rel=0.2)
    numbers = {entry['number']: entry for entry in found['numbers']}
    assert numbers['coulomb']['here'] == pytest.approx(0.024, rel=0.06)
    assert numbers['inertia']['here'] == pytest.approx(7e-5, rel=0.06)
    assert numbers['offset']['here'] == pytest.approx(-0.01, rel=0.06)


def test_numbers_lie_apart_as_their_own_deviations_say(apart: dict) -> None:
    assert apart['folds'] >= 2
    assert apart['kind'] == 'motions there and back'
    rows = {row['number']: row for row in apart['rows']}
    # What the file has right already is not refitted; nor is what changes nothing.
    assert apart['idle'] == ['growth']
    assert set(rows) == {'viscous_friction', 'coulomb', 'offset'}
    assert rows['offset']['told'] == 2e-4
    for row in rows.values():
        assert row['telling'] == apart['folds']
        assert row['mean'] == pytest.approx(row['value'], rel=0.06)
        assert row['ratio'] == pytest.approx(row['spread'] / row['own'])


def test_a_number_that_changes_between_recordings_lies_apart_by_more(units: Path) -> None:
    paths = [path for one in sets_in(units) for path in one.train]
    claims: list[dict] = []
    file = {**FILE, 'motor': BEST['motor']}
    found = spread(BEST, file, claims, [*paths, *paths], 20.0)
    assert (found['folds'], found['kind']) == (4, 'recordings')
    coulomb, = (row for row in found['rows'] if row['number'] == 'coulomb')
    assert coulomb['spread'] == pytest.approx(0.012 / np.sqrt(3.0), rel=0.1)
    assert coulomb['ratio'] > 5.0


def test_recordings_are_cut_where_the_shaft_turns_back_again(monkeypatch: pytest.MonkeyPatch,
                                                             ) -> None:
    time = np.arange(0.0, 12.0, 1.0 / RATE)
    velocity = np.where(time < 1.0, 0.0, np.sin(0.5 * np.pi * (time - 1.0)))
    run = Signals(time, np.cumsum(velocity) / RATE, velocity, np.gradient(velocity) * RATE,
                  np.zeros(time.size), None, None)
    monkeypatch.setattr(real_spread, 'read_signals', lambda path: run)
    folds, kind = folds_of([Path('one')], 20.0)
    assert kind == 'motions there and back'
    # From 1 s on it takes 4 s there and back; after 9 s it goes there, and hardly back.
    assert [(round(piece.begin), round(piece.end)) for (piece,) in folds] == [(1, 5), (5, 9),
                                                                             (9, 12)]
    velocity[time > 9.0] = 0.0
    folds, _ = folds_of([Path('one')], 20.0)
    assert len(folds) == 2
    assert len(folds_of([Path('one')] * 4, 20.0)[0]) == 4


def test_a_file_s_other_numbers_are_refitted_where_that_is_asked_for() -> None:
    names = [number.name for number in numbers_of(BEST, FILE, CLAIMS)]
    assert names == ['viscous_friction', 'coulomb', 'offset']
    names = [number.name for number in numbers_of(BEST, FILE, CLAIMS, all_of_file=True)]
    assert names == ['inertia', 'viscous_friction', 'coulomb', 'offset']


def test_recorded_effort_drives_the_right_model_along_the_recorded_motion(units: Path) -> None:
    first, _ = sets_in(units)
    path, = first.holdout
    errors = [position_error([path], [driven(path, model)]) for model in (BEST, FILE)]
    assert errors[0] < 0.1 * errors[1]
    wrong = deepcopy(BEST)
    wrong['friction']['coulomb'] = 0.013
    numbers = numbers_of(wrong, FILE, CLAIMS)
    # Friction that is off by 8 % is found by a fit to where the effort drives the model.
    fitted = refit(wrong, numbers, position_left(first.train)).model
    again = position_error([path], [driven(path, fitted)])
    assert again < 0.5 * position_error([path], [driven(path, wrong)])


def test_a_plain_fit_is_a_model_that_can_be_driven(units: Path) -> None:
    first, _ = sets_in(units)
    rungs = plain_rungs(FILE, first.train)
    assert rungs['flexible'].model is None
    model = rungs['offset'].model
    assert model['friction']['coulomb'] == pytest.approx(0.012, rel=0.1)
    assert model['effects'][0]['parameters']['offset'] == pytest.approx(-0.01, rel=0.1)
    path, = first.holdout
    assert driven(path, model).position is not None


def test_page_and_text_say_what_was_found(units: Path, apart: dict) -> None:
    first, unit = sets_in(units)
    result = {'date': '2026-11-27T00:00:00', 'command': 'engb prove', 'wall_seconds': 1.0}
    sets = []
    moved = {'of': 'unit_a', 'rungs': [_rung(unit)('numbers refitted here', BEST)],
             'numbers': [{'number': 'coulomb', 'effect': '', 'first': 0.012, 'here': 0.0241}]}
    for one, other in ((first, None), (unit, moved)):
        sets.append({'name': one.name, 'train': 1, 'holdout': 1, 'band': one.band, 'rows': [],
                     'published': [{'who': 'others', 'measure': 'driven', 'train': None,
                                    'holdout': 0.0123}],
                     'ladder': [_rung(one)('nominal', one.nominal)], 'expected': [],
                     'spread': dict(apart), 'transfer': other})
    result['sets'] = sets
    text = as_text(result)
    page = real_page(result, backend='table').html()
    for said in (text, page):
        assert '0.0241' in said
        assert 'numbers refitted here' in said
        assert '0.0123' in said
        assert 'motions there and back' in said
    assert 'another unit of the machine of unit_a' in text
    sets[0]['spread'] |= {'folds': 1}
    sets[1]['spread'] |= {'rows': []}
    assert 'one recording has no spread' in as_text(result)
    assert 'the tool changed none' in as_text(result)


def test_verdicts_are_summed_for_one_term_and_for_two() -> None:
    rows = [{'taken': taken, 'verdict': verdict} for taken, verdict in (
        ([], None), (['a'], 'just it'), (['b'], 'just it'), (['c'], 'nothing'),
        (['a', 'b'], 'just both'))]
    assert sums_of(rows) == ['one term taken out, 3 models: just it 2, nothing 1',
                             'two terms taken out, 1 models: just both 1']


@pytest.mark.skipif(not (SHARED / 'emps').is_dir(),
                    reason='../shared/real is not there: recordings of others')
def test_the_recorded_force_drives_a_ball_screw_s_file_far_off() -> None:
    one, = sets_in(SHARED / 'emps')
    path, = one.holdout
    said = driven(path, one.nominal)
    assert isinstance(said, Prediction)
    # The file has no offset: over 25 s that is 0.18 m, of 0.25 m of stroke.
    assert position_error([path], [said]) == pytest.approx(0.184, abs=0.005)
