# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The scorer gives a perfect answer full marks, and a silent one what it deserves."""
from __future__ import annotations

import json
from math import comb
from pathlib import Path

import numpy as np
import pytest

from tests.proof.locate import (
    BIN,
    in_time,
    in_zones,
    onset_told,
    OnsetScore,
    Stretch,
    true_samples,
)
from tests.proof.own_truth import truth_of
from tests.proof.page import proof_page
from tests.proof.score import CaseScore, score
from tests.proof.summary import as_text
from tests.proof.totals import clopper_pearson, summarise

FLOOR = 4e-4
HIDDEN = {'strong': ['cogging_torque'], 'subtle': ['backlash'],
          'pair': ['pad_creep', 'inertia_error'], 'undescribed': ['outside_dent'], 'clean': []}
PARAMETERS = {'cogging_torque': {'order': 4.0, 'amplitude': 0.005}, 'backlash': {'gap': 0.3},
              'pad_creep': {'relaxed_fraction': 0.1, 'time_constant': 2.0},
              'inertia_error': {'inertia': 7e-5}, 'outside_dent': {}}


def arrays_of(stratum: str) -> dict[str, np.ndarray]:
    """A sealed case's arrays, invented: 20 s of motion, a mismatch between 4 and 8 s."""
    time = np.arange(20000) * 1e-3
    effort = 0.1 * np.sin(2.0 * np.pi * 0.3 * time)
    off = 0.0 if stratum == 'clean' else 0.003
    energy = np.zeros(int(20 / BIN))
    if stratum != 'clean':
        energy[200:400] = np.hanning(200)
    return {'train_energy': energy, 'test_effort': effort,
            'test_velocity': np.full(time.size, 5.0), 'test_nominal': effort + off,
            'test_oracle': effort}


def test_zones_hold_what_was_added_in_them() -> None:
    energy, velocity = np.zeros(100), np.zeros(200)
    energy[20:40], velocity[20:120] = 1.0, 5.0
    velocity[40:80] = -5.0
    arrays = {'train_energy': energy, 'train_velocity': velocity, 'train_position': velocity}
    zone = {'variable': 'velocity', 'from': -6.0, 'to': -1.0, 'share': 0.9}
    other = {'variable': 'load', 'from': 0.0, 'to': 1.0, 'share': 0.9}
    row, = in_zones({'mismatch': {'where': [zone, other]}}, arrays)
    assert row == ('velocity', 0.9, 1.0, pytest.approx(0.4))


def write_truth(folder: Path) -> list[str]:
    """One sealed case per stratum; returns their names."""
    names = []
    folder.mkdir(parents=True, exist_ok=True)
    for number, (stratum, effects) in enumerate(HIDDEN.items()):
        name = f'case_{number:04d}'
        facts = {'stratum': stratum, 'motion': 'rich', 'refitted': True, 'test_floor': FLOOR,
                 'cutoff': 20.0, 'depends_on': [['position', 'motor_angle'], ['load']],
                 'memory': True, 'fair': ['torque_ripple'], 'tags': ['low_rate'],
                 'effects': [{'effect': e, 'formulation': 'x', 'parameters': PARAMETERS[e]}
                             for e in effects]}
        np.savez(folder / f'{name}.npz', truth=np.array(json.dumps(facts)), **arrays_of(stratum))
        names.append(name)
    return names


def claim(effect: str) -> dict:
    values = {k: {'value': v, 'std': 0.01 * v, 'unit': '-'} for k, v in PARAMETERS[effect].items()}
    return {'effect': effect, 'probability': 1.0, 'parameters': values, 'share': 1.0,
            'alternatives': [], 'statement': 'x'}


def write_answer(folder: Path, stratum: str, perfect: bool) -> None:
    """A fake tool's output: all that is true, or nothing."""
    folder.mkdir(parents=True)
    known = [e for e in HIDDEN[stratum] if not e.startswith('outside_')]
    where = np.flatnonzero(true_samples(arrays_of(stratum)['train_energy']))
    spans = [{'recording': 'train', 'from': float(where[0] * BIN),
              'to': float((where[-1] + 1) * BIN), 'share': 1.0}] if where.size else []
    diagnosis = {'effects': [claim(e) for e in known] if perfect else [],
                 'mismatch': {'time': spans if perfect else [], 'where': []},
                 'unexplained': {'depends_on': ['motor_angle', 'load'] if perfect else [],
                                 'memory': perfect},
                 'verdict': 'explained' if perfect and stratum != 'clean' else 'consistent'}
    (folder / 'diagnosis.json').write_text(json.dumps(diagnosis), 'utf8')
    (folder / 'run.json').write_text(json.dumps({'seconds': 2.0, 'failure': None}), 'utf8')
    arrays = arrays_of(stratum)
    effort = arrays['test_effort'] if perfect else arrays['test_nominal']
    np.savez(folder / 'corrected.npz', time=np.arange(effort.size) * 1e-3, effort=effort)


def scored(name: str, truth: Path, results: Path) -> CaseScore:
    return score(truth_of(name, truth / f'{name}.npz'), results)


def summary_of(tmp_path: Path, perfect: bool) -> dict:
    names = write_truth(tmp_path)
    scores = []
    for name, stratum in zip(names, HIDDEN, strict=True):
        write_answer(tmp_path / 'out' / name, stratum, perfect)
        scores.append(scored(name, tmp_path, tmp_path / 'out' / name))
    return summarise(scores)


def test_perfect_answer_scores_full_marks(tmp_path: Path) -> None:
    summary = summary_of(tmp_path, perfect=True)
    for key in ('strong', 'subtle'):
        assert summary['named_first'][key]['share'] == 1.0
    assert summary['pairs_both']['share'] == 1.0
    assert summary['false_alarms']['hits'] == 0
    assert summary['confident_wrong_outside']['hits'] == 0
    assert summary['calibration']['expected_error'] == 0.0
    for key in ('precision', 'recall'):
        assert summary['localisation'][key] == pytest.approx(1.0, abs=0.02)
    assert summary['parameters']['median_error'] == 0.0
    assert summary['parameters']['coverage'] == 1.0
    assert summary['harm']['hits'] == 0
    for kind in ('single', 'pair', 'undescribed'):
        assert summary['held_out_removed'][kind] == pytest.approx(1.0)
    assert summary['worse']['hits'] == 0
    assert summary['variables']['undescribed'] == {
        'cases': 1, 'told': 1.0, 'beside': 0.0, 'memory': 1.0}
    assert summary['right']['hits'] == summary['by_tag']['low_rate']['of'] == 5
    assert summary['localisation']['chance'] < 0.2


def test_the_page_tells_what_the_scores_hold(tmp_path: Path) -> None:
    names = write_truth(tmp_path)
    scores = []
    for name, stratum in zip(names, HIDDEN, strict=True):
        write_answer(tmp_path / 'out' / name, stratum, perfect=True)
        scores.append(scored(name, tmp_path, tmp_path / 'out' / name))
    summary = {**summarise(scores), 'source': 'other', 'command': 'x', 'date': '2026'}
    proof_page(summary, scores).write(tmp_path / 'index.html')
    page = (tmp_path / 'index.html').read_text('utf8')
    for text in ('confident wrong name, undescribed', 'right variables', 'harm: materially worse',
                 'low rate', 'another hand'):
        assert text in page


def test_silent_answer_scores_nothing_but_no_false_alarm(tmp_path: Path) -> None:
    summary = summary_of(tmp_path, perfect=False)
    for key in ('strong', 'subtle'):
        assert summary['named_first'][key]['share'] == 0.0
    assert summary['pairs_both']['share'] == 0.0
    assert summary['false_alarms']['hits'] == 0
    assert summary['confident_wrong_outside']['hits'] == 0
    assert summary['calibration']['claims'] == 0
    where = summary['localisation']
    assert (where['precision'], where['recall']) == (0.0, 0.0)
    assert summary['harm']['hits'] == 0
    assert summary['held_out_removed']['single'] == pytest.approx(0.0, abs=1e-9)
    assert summary['variables']['undescribed']['told'] == 0.0
    assert summary['confusion']['cogging_torque'] == {'nothing': 1}
    assert '5 cases' in as_text(summary)


def test_wrong_name_outside_and_false_alarm_and_harm_are_counted(tmp_path: Path) -> None:
    names = write_truth(tmp_path)
    scores = []
    for name, stratum in zip(names, HIDDEN, strict=True):
        out = tmp_path / 'out' / name
        write_answer(out, stratum, perfect=True)
        text = json.loads((out / 'diagnosis.json').read_text('utf8'))
        text['effects'] = [{**claim('backlash'), 'probability': 0.9}]
        (out / 'diagnosis.json').write_text(json.dumps(text), 'utf8')
        arrays = arrays_of(stratum)
        np.savez(out / 'corrected.npz', time=np.arange(arrays['test_effort'].size) * 1e-3,
                 effort=arrays['test_effort'] + 0.01)
        scores.append(scored(name, tmp_path, out))
    summary = summarise(scores)
    assert summary['false_alarms']['share'] == 1.0
    assert summary['confident_wrong_outside']['share'] == 1.0
    assert summary['harm']['share'] == 1.0
    assert summary['worse']['share'] == 1.0
    assert summary['calibration']['bands'] == [
        {'from': 0.9, 'to': 0.97, 'claims': 5, 'said': pytest.approx(0.9), 'right': 1}]
    assert summary['named_first']['subtle']['share'] == 1.0
    assert summary['named_first']['strong']['share'] == 0.0
    assert summary['calibration']['expected_error'] == pytest.approx(0.9 - 0.2)
    # Of five claims with 0.9 that are right so often four are by chance, or three.
    assert summary['calibration']['by_chance'] == pytest.approx(sum(
        comb(5, right) * 0.9 ** right * 0.1 ** (5 - right) * abs(right / 5 - 0.9)
        for right in range(6)))


def test_interval_of_nothing_in_three_hundred() -> None:
    low, high = clopper_pearson(0, 300)
    assert low == 0.0
    assert high == pytest.approx(0.01222, abs=1e-4)


def test_a_fair_name_outside_the_library_is_not_held_against_it(tmp_path: Path) -> None:
    write_truth(tmp_path)
    name = next(f'case_{k:04d}' for k, one in enumerate(HIDDEN) if one == 'undescribed')
    out = tmp_path / 'out'
    write_answer(out, 'undescribed', perfect=True)
    for effect, wrong in (('torque_ripple', False), ('load_shape', False), ('backlash', True)):
        text = json.loads((out / 'diagnosis.json').read_text('utf8'))
        text['effects'] = [{**claim('backlash'), 'effect': effect, 'probability': 0.5}]
        (out / 'diagnosis.json').write_text(json.dumps(text), 'utf8')
        assert scored(name, tmp_path, out).confident_wrong is wrong, effect


def test_a_verdict_alone_on_a_clean_recording_is_an_alarm(tmp_path: Path) -> None:
    write_truth(tmp_path)
    name = next(f'case_{k:04d}' for k, one in enumerate(HIDDEN) if one == 'clean')
    out = tmp_path / 'out'
    write_answer(out, 'clean', perfect=False)
    text = json.loads((out / 'diagnosis.json').read_text('utf8'))
    (out / 'diagnosis.json').write_text(json.dumps({**text, 'verdict': 'unexplained'}), 'utf8')
    summary = summarise([scored(name, tmp_path, out)])
    assert summary['false_alarms']['hits'] == 1
    assert summary['claims_on_clean']['hits'] == 0


def test_true_samples_are_the_fewest_that_hold_the_energy() -> None:
    energy = np.zeros(500)
    energy[100:120], energy[300:310] = 1.0, 10.0
    true = true_samples(energy)
    assert true[300:310].all()
    assert energy[true].sum() >= 0.8 * energy.sum()
    assert energy[true].sum() - 1.0 < 0.8 * energy.sum() + 10.0
    assert not true_samples(np.zeros(5)).any()


def test_a_span_counts_in_its_own_recording() -> None:
    time, judged = np.arange(100) * BIN, np.ones(100, bool)
    energy = np.zeros(100)
    energy[10:20] = 1.0
    stretches = (Stretch('train_1', time, energy, judged),
                 Stretch('train_2', time, np.zeros(100), judged))
    span = {'from': 10 * BIN - 1e-6, 'to': 19 * BIN + 1e-6, 'share': 1.0}
    own = in_time({'mismatch': {'time': [{**span, 'recording': 'train_1'}]}}, stretches)
    other = in_time({'mismatch': {'time': [{**span, 'recording': 'train_2'}]}}, stretches)
    assert own is not None and other is not None
    assert own.precision == pytest.approx(0.8, abs=0.15)
    assert own.recall == 1.0
    assert (other.precision, other.recall) == (0.0, 0.0)
    assert own.chance == pytest.approx(0.04, abs=0.01)


@pytest.mark.parametrize(('told', 'expected'), [
    ([{'onset': {'recording': 'train_2.mcap', 'time': 12.5}}], OnsetScore(True, True, 0.5)),
    ([{'onset': {'recording': 'train_1', 'time': 12.0}}], OnsetScore(True, True, None)),
    ([{'onset': {'recording': 'train_2', 'time': None}}], OnsetScore(True, True, None)),
    ([{'onset': None}], OnsetScore(True, False, None)),
    ([{}], OnsetScore(True, False, None)),
    ([], OnsetScore(True, False, None)),
])
def test_an_onset_is_judged_by_its_time_in_its_recording(told: list[dict], expected: OnsetScore
                                                         ) -> None:
    assert onset_told(told, ('train_2', 12.0), 3) == expected


def test_an_onset_where_the_effect_acts_throughout_is_invented() -> None:
    assert onset_told([{'onset': {'recording': 'train', 'time': 3.0}}], None, 1) == OnsetScore(
        False, True, None)
    assert onset_told([{}], None, 1) == OnsetScore(False, False, None)
    assert onset_told([], None, 1) is None


def test_an_onset_is_summed_up_and_told(tmp_path: Path) -> None:
    write_truth(tmp_path)
    scores = []
    for name, time in (('case_0001', 9.0), ('case_0002', 4.2)):
        path = tmp_path / f'{name}.npz'
        with np.load(path) as data:
            facts = json.loads(str(data['truth']))
            arrays = {key: data[key] for key in data.files if key != 'truth'}
        facts['onset'] = {'recording': 'train', 'time': 4.0}
        np.savez(path, truth=np.array(json.dumps(facts)), **arrays)
        out = tmp_path / 'out' / name
        write_answer(out, 'strong', perfect=True)
        text = json.loads((out / 'diagnosis.json').read_text('utf8'))
        text['effects'] = [{**claim(facts['effects'][0]['effect']),
                            'onset': {'recording': 'train', 'time': time}}]
        (out / 'diagnosis.json').write_text(json.dumps(text), 'utf8')
        scores.append(scored(name, tmp_path, out))
    summary = summarise(scores)
    assert summary['onset']['begins'] == summary['onset']['told'] == 2
    assert summary['onset']['most_error'] == pytest.approx(5.0)
    assert summary['onset']['median_error'] == pytest.approx(2.6)
    assert 'onset in mid-recording: told in 2 of 2, off by 2.60 s' in as_text(summary)
