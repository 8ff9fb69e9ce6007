# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The conceal-one-term test: what it takes out, what it counts, what it measures."""
from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from engb_core.errors import InputError
from engb_ros.commands.main import main
from tests.proof.real import judged, met
from tests.proof.real_ladder import force_error, moving_error, plain_rungs, Prediction
from tests.proof.real_sets import Expected, sets_in, with_loop
from tests.proof.real_terms import hidden_by_refit, terms_of
from tests.proof.recorded_unit import recorded
from tests.proof.signals import read_samples, Signals

MODEL = {
    'motor': {'torque_constant': 1.0, 'inertia': 7e-5, 'viscous_friction': 1e-3},
    'load_torque': {'form': 'polynomial', 'coefficients': [0.0, 2e-3], 'contact_angle': None},
    'friction': {'coulomb': 0.012, 'load_gain': 0.0, 'saturation_velocity': 0.05},
    'effects': [{'effect': 'torque_offset', 'parameters': {'offset': 0.01}},
                {'effect': 'unexplained_surface', 'parameters': {'value_00': 1.0}}]}


@pytest.mark.parametrize(('claims', 'anyway', 'verdict'), [
    (['backlash'], [], 'just it'),
    (['pad_creep', 'backlash'], ['pad_creep'], 'just it'),
    (['backlash', 'pad_creep'], [], 'first'),
    (['pad_creep', 'backlash'], [], 'not first'),
    (['pad_creep'], [], 'another'),
    (['pad_creep'], ['pad_creep'], 'nothing'),
    ([], [], 'nothing'),
    (['backlash'], ['backlash'], 'cannot tell'),
])
def test_what_a_list_of_names_is_worth(claims: list, anyway: list, verdict: str) -> None:
    assert judged(['backlash'], claims, anyway) == verdict


@pytest.mark.parametrize(('claims', 'anyway', 'verdict'), [
    (['backlash', 'pad_creep'], [], 'just both'),
    (['torque_offset', 'pad_creep', 'backlash'], [], 'both'),
    (['torque_offset', 'pad_creep', 'backlash'], ['torque_offset'], 'just both'),
    (['torque_offset', 'backlash'], [], 'one of both'),
    (['torque_offset'], [], 'another'),
    ([], [], 'nothing'),
    (['backlash', 'pad_creep'], ['backlash'], 'cannot tell'),
])
def test_what_names_are_worth_where_two_terms_are_gone(claims: list, anyway: list, verdict: str,
                                                       ) -> None:
    assert judged(['backlash', 'pad_creep'], claims, anyway) == verdict


def test_what_an_expert_expects_is_held_against_what_was_said() -> None:
    expected = (Expected(('command_rate_limit',), True, 'speed', 4.5, 5.5),
                Expected(('actuation_lag', 'command_delay'), False))
    claims = [{'effect': 'command_rate_limit', 'probability': 0.7,
               'parameters': {'speed': {'value': 5.8, 'std': 0.1}}},
              {'effect': 'backlash', 'probability': 0.6, 'parameters': {}},
              {'effect': 'pad_creep', 'probability': 0.2, 'parameters': {}}]
    limit, lag, beside = met(expected, claims)
    assert limit['probability'] == 0.7
    assert limit['inside'] is False
    assert lag['said'] is None
    assert lag['in_set'] == []
    timing = {'causes': ['actuation_lag', 'sampling_delay']}
    assert met(expected, claims, timing)[1]['in_set'] == timing['causes']
    assert met(expected, claims, timing)[0]['in_set'] == []
    nearest = ('cogging_torque', 'command_delay')
    assert met(expected, claims, None, nearest)[1]['in_set'] == list(nearest)
    assert met(expected, claims, timing, nearest)[1]['in_set'] == timing['causes']
    assert beside == {'beside': [('backlash', 0.6)]}
    assert met((), claims) == []


def test_every_term_of_a_model_can_be_taken_out() -> None:
    terms = {term.effect: term for term in terms_of(MODEL)}
    assert set(terms) == {'inertia_error', 'viscous_friction_error', 'coulomb_friction_error',
                          'load_stiffness_error', 'torque_offset'}
    assert terms['viscous_friction_error'].removed(MODEL)['motor']['viscous_friction'] == 0.0
    assert terms['load_stiffness_error'].removed(MODEL)['load_torque']['coefficients'][1] == 1e-3
    left = terms['torque_offset'].removed(MODEL)['effects']
    assert [one['effect'] for one in left] == ['unexplained_surface']
    assert MODEL['motor']['viscous_friction'] == 1e-3


def test_a_refit_hides_what_the_other_numbers_can_take_over() -> None:
    time = np.arange(0.0, 10.0, 2e-3)
    velocity = 20.0 * np.sin(2.0 * np.pi * 0.5 * time)
    run = Signals(time, np.cumsum(velocity) * 2e-3, velocity, np.gradient(velocity, 2e-3),
                  np.zeros(time.size), None, None)
    term = next(one for one in terms_of(MODEL) if one.effect == 'coulomb_friction_error')
    gap = 0.012 * np.sign(velocity)
    hidden = hidden_by_refit(term.removed(MODEL), term, [(run, gap)])
    assert hidden['friction']['coulomb'] == 0.0
    added = hidden['motor']['viscous_friction'] - 1e-3
    # Least squares of a square wave by its own sine: 4/π of its height.
    assert added * 20.0 == pytest.approx(0.012 * 4.0 / np.pi, rel=0.1)


def test_ladder_of_plain_models_finds_the_offset(tmp_path: Path) -> None:
    train, holdout = (recorded(tmp_path, name, seed) for name, seed in (('train', 1),
                                                                        ('holdout', 2)))
    nominal = {**MODEL, 'load_torque': {'form': 'polynomial', 'coefficients': [0.0]}}
    rungs = plain_rungs(nominal, [train])
    error = {name: force_error([holdout], [rung.predicted(holdout)])
             for name, rung in rungs.items()}
    samples = read_samples(holdout)
    perfect = Prediction(samples.time, samples.effort, None)
    assert force_error([holdout], [perfect]) == 0.0
    assert moving_error([holdout], [perfect], 20.0) < 0.02
    half = Prediction(samples.time, 0.5 * samples.effort, None)
    assert moving_error([holdout], [half], 20.0) == pytest.approx(0.5, abs=0.02)
    assert error['offset'] < 0.7 * error['refitted']
    assert error['flexible'] < 0.8 * error['refitted']


def test_sets_are_found_and_a_servo_gets_its_gain(tmp_path: Path) -> None:
    home = tmp_path / 'servo_sts3215'
    home.mkdir()
    (home / 'nominal.yaml').write_text(yaml.safe_dump(MODEL), 'utf8')
    with pytest.raises(InputError, match='train… and holdout…'):
        sets_in(tmp_path)
    for name in ('train_kp08_a.mcap', 'holdout_kp16_a.mcap'):
        (home / name).write_bytes(b'')
    one, = sets_in(tmp_path)
    assert one.published
    loop = with_loop(one, one.nominal, one.holdout[0])['controller']
    assert loop['proportional'] == pytest.approx(16 * 1.12489)


@pytest.mark.parametrize(('arguments', 'told'), [
    (['--real', 'nowhere', '--out', 'x'], 'no such folder'),
    (['--real', '.', '--out', 'x'], 'no nominal.yaml'),
    (['--real', '.', '--out', 'x', '--cases', '3'], 'leave --cases away'),
    (['--real', '.'], '--out DIR is needed'),
    (['--pairs', '--out', 'x'], '--pairs belongs to --real'),
])
def test_wrong_calls_end_in_one_line(arguments: list[str], told: str, tmp_path: Path,
                                     monkeypatch: pytest.MonkeyPatch,
                                     capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(['prove', *arguments]) == 2
    said = capsys.readouterr().err
    assert told in said
    assert said.count('\n') == 1
