"""The scorer gives a perfect answer full marks, and a silent one what it deserves."""
from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.proof.locate import in_zones, true_bins
from tests.proof.score import score_case
from tests.proof.sealing import BIN
from tests.proof.summary import as_text
from tests.proof.totals import clopper_pearson, summarise

FLOOR = 4e-4
HIDDEN = {'strong': ['cogging_torque'], 'subtle': ['backlash'],
          'pair': ['pad_creep', 'inertia_error'], 'outside': ['outside_dent'], 'clean': []}
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
    for number, (stratum, effects) in enumerate(HIDDEN.items()):
        name = f'case_{number:04d}'
        facts = {'stratum': stratum, 'motion': 'rich', 'refitted': True, 'test_floor': FLOOR,
                 'cutoff': 20.0,
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
    where = np.flatnonzero(true_bins(arrays_of(stratum)['train_energy']))
    spans = [{'recording': 'train', 'from': float(where[0] * BIN),
              'to': float((where[-1] + 1) * BIN), 'share': 1.0}] if where.size else []
    diagnosis = {'effects': [claim(e) for e in known] if perfect else [],
                 'mismatch': {'time': spans if perfect else [], 'where': []},
                 'verdict': 'explained' if perfect else 'consistent'}
    (folder / 'diagnosis.json').write_text(json.dumps(diagnosis), 'utf8')
    (folder / 'run.json').write_text(json.dumps({'seconds': 2.0, 'failure': None}), 'utf8')
    arrays = arrays_of(stratum)
    effort = arrays['test_effort'] if perfect else arrays['test_nominal']
    np.savez(folder / 'corrected.npz', time=np.arange(effort.size) * 1e-3, effort=effort)


def summary_of(tmp_path: Path, perfect: bool) -> dict:
    names = write_truth(tmp_path)
    scores = []
    for name, stratum in zip(names, HIDDEN, strict=True):
        write_answer(tmp_path / 'out' / name, stratum, perfect)
        scores.append(score_case(name, tmp_path / f'{name}.npz', tmp_path / 'out' / name))
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
    for stratum in ('strong', 'subtle', 'pair', 'outside'):
        assert summary['held_out_removed'][stratum] == pytest.approx(1.0)


def test_silent_answer_scores_nothing_but_no_false_alarm(tmp_path: Path) -> None:
    summary = summary_of(tmp_path, perfect=False)
    for key in ('strong', 'subtle'):
        assert summary['named_first'][key]['share'] == 0.0
    assert summary['pairs_both']['share'] == 0.0
    assert summary['false_alarms']['hits'] == 0
    assert summary['confident_wrong_outside']['hits'] == 0
    assert summary['calibration']['claims'] == 0
    where = summary['localisation']
    assert (where['precision'], where['recall']) == (None, 0.0)
    assert summary['harm']['hits'] == 0
    assert summary['held_out_removed']['strong'] == pytest.approx(0.0, abs=1e-9)
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
        scores.append(score_case(name, tmp_path / f'{name}.npz', out))
    summary = summarise(scores)
    assert summary['false_alarms']['share'] == 1.0
    assert summary['confident_wrong_outside']['share'] == 1.0
    assert summary['harm']['share'] == 1.0
    assert summary['named_first']['subtle']['share'] == 1.0
    assert summary['named_first']['strong']['share'] == 0.0
    assert summary['calibration']['expected_error'] == pytest.approx(0.9 - 0.2)


def test_interval_of_nothing_in_three_hundred() -> None:
    low, high = clopper_pearson(0, 300)
    assert low == 0.0
    assert high == pytest.approx(0.01222, abs=1e-4)


def test_true_bins_hold_the_energy_and_close_small_holes() -> None:
    energy = np.zeros(500)
    energy[100:120], energy[125:140], energy[300:310] = 1.0, 1.0, 1.0
    bins = true_bins(energy)
    assert bins[105:135].all()
    assert not bins[200:290].any()
    assert energy[bins].sum() > 0.85 * energy.sum()
