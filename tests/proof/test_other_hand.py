# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Cases from another hand are read, run and scored by the same tables."""
from __future__ import annotations

import json
from pathlib import Path
import shutil

import numpy as np
import pytest

from engb_ros.commands.main import main
from tests.proof.other_hand import _on_grid, cases_in, other_truth
from tests.proof.score import score

ROOT = Path(__file__).resolve().parents[2]
DEV = ROOT.parent / 'shared' / 'dev'

pytestmark = pytest.mark.skipif(not DEV.is_dir(), reason='../shared/dev is not there')


@pytest.fixture(scope='module')
def kinds() -> dict[str, Path]:
    """One case of each kind."""
    found: dict[str, Path] = {}
    for case in cases_in(DEV):
        found.setdefault(json.loads((case / 'truth.json').read_text('utf8'))['kind'], case)
    return found


def answer(folder: Path, diagnosis: dict, effort: np.ndarray | None = None) -> Path:
    """Results as the runner leaves them."""
    folder.mkdir()
    (folder / 'diagnosis.json').write_text(json.dumps(diagnosis), 'utf8')
    (folder / 'run.json').write_text(json.dumps({'seconds': 1.0, 'failure': None}), 'utf8')
    if effort is not None:
        np.savez(folder / 'corrected.npz', time=np.arange(effort.size) * 1e-3, effort=effort)
    return folder


def test_truth_as_an_answer_gets_full_marks(kinds: dict[str, Path], tmp_path: Path) -> None:
    for kind in ('single', 'two', 'three'):
        truth = other_truth(kinds[kind])
        claims = [{'effect': name, 'probability': 0.99, 'parameters': {
            key: {'value': value, 'std': 0.1 * abs(value)}
            for effect, key, value, _ in truth.parameters if effect == name}}
            for name in truth.hidden]
        with np.load(kinds[kind] / 'truth.npz') as data:
            facts = json.loads((kinds[kind] / 'truth.json').read_text('utf8'))
            effort = data['test_effort'].astype(float) * facts['noise_floor']
        got = score(truth, answer(tmp_path / kind, {'effects': claims, 'verdict': 'explained'},
                                  effort))
        assert got.named_first and got.all_named
        assert got.removed == pytest.approx(1.0, abs=0.05)
        assert all(value == said for _, _, value, said, _ in got.parameters)
        assert len(got.parameters) == len(truth.parameters)


def test_silence_is_right_on_clean_recordings_only(kinds: dict[str, Path], tmp_path: Path
                                                   ) -> None:
    silent = {'effects': [], 'verdict': 'consistent'}
    got = score(other_truth(kinds['consistent']), answer(tmp_path / 'clean', silent))
    assert not got.alarm
    assert not score(other_truth(kinds['two']), answer(tmp_path / 'two', silent)).all_named


def test_outside_tells_variables(kinds: dict[str, Path], tmp_path: Path) -> None:
    truth = other_truth(kinds['oov'])
    told = {'depends_on': [group[0] for group in truth.depends_on], 'memory': truth.memory}
    got = score(truth, answer(tmp_path / 'oov', {
        'effects': [], 'verdict': 'unexplained', 'unexplained': told}))
    assert got.variables == (1.0, 0, True)
    assert got.outside and not got.confident_wrong


def test_damage_is_told_in_one_line(kinds: dict[str, Path], tmp_path: Path,
                                    capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(kinds['consistent'], tmp_path / 'set' / 'case_01')
    (tmp_path / 'set' / 'case_01' / 'truth.json').write_text('{', 'utf8')
    assert main(['prove', '--cases-from', str(tmp_path / 'set'), '--out',
                 str(tmp_path / 'out')]) == 2
    said = capsys.readouterr().err
    assert 'truth.json or truth.npz is damaged' in said
    assert said.count('\n') == 1
    assert not (tmp_path / 'out').exists()


@pytest.mark.slow
def test_a_case_runs_and_is_scored(tmp_path: Path) -> None:
    out = tmp_path / 'out'
    assert main(['prove', '--cases-from', str(DEV), '--only', '09', '--out', str(out)]) == 0
    scores = json.loads((out / 'scores.json').read_text('utf8'))
    assert scores['cases'] == 1
    assert not scores['failures']
    assert 'another hand' in (out / 'index.html').read_text('utf8')
    # What is left to do is nothing: the tool does not run again.
    before = (out / 'results' / 'case_09' / 'run.json').stat().st_mtime_ns
    assert main(['prove', '--cases-from', str(DEV), '--out', str(out), '--only', '09']) == 0
    assert (out / 'results' / 'case_09' / 'run.json').stat().st_mtime_ns == before
    # Nor where it was stopped before it wrote scores.
    for name in ('scores.json', 'scores.txt', 'index.html', 'column.md', 'cases.jsonl'):
        (out / name).unlink(missing_ok=True)
    assert main(['prove', '--cases-from', str(DEV), '--out', str(out), '--only', '09']) == 0
    assert (out / 'results' / 'case_09' / 'run.json').stat().st_mtime_ns == before


@pytest.mark.slow
def test_a_case_is_diagnosed_on_its_other_motion(tmp_path: Path,
                                                 capsys: pytest.CaptureFixture) -> None:
    """Names alone are scored: what is fitted is what was to be predicted."""
    asked = ['prove', '--cases-from', str(DEV), '--only', '13', '--out', str(tmp_path / 'out')]
    assert main([*asked, '--other-motion']) == 0
    scores = json.loads((tmp_path / 'out' / 'scores.json').read_text('utf8'))
    assert scores['cases'] == 1 and not scores['failures']
    results = tmp_path / 'out' / 'results' / 'case_13'
    said = json.loads((results / 'diagnosis.json').read_text('utf8'))
    assert {entry['recording'] for entry in said['fit']['held_out']} == {'test'}
    assert not (results / 'corrected.npz').exists()
    capsys.readouterr()
    assert main(asked) == 2
    assert 'holds the proof of other cases' in capsys.readouterr().err
    assert main(['prove', '--other-motion', '--out', str(tmp_path / 'new')]) == 2
    assert '--other-motion belongs to --cases-from' in capsys.readouterr().err


@pytest.mark.parametrize('rate', [125.0, 250.0, 400.0])
def test_what_the_nominal_model_misses_is_told_at_any_rate(rate: float) -> None:
    # 400 Hz does not divide the grid of 1 ms.
    time = np.arange(4000) * 1e-3
    motion = 3.0 * np.sin(2.0 * np.pi * 0.7 * time)
    model = {'motor': {'inertia': 1e-3, 'viscous_friction': 0.0},
             'load_torque': {'coefficients': [0.0, 0.1], 'contact_angle': None},
             'friction': {'coulomb': 0.0, 'load_gain': 0.0, 'saturation_velocity': 1.0}}
    needed = (0.1 - 1e-3 * (2.0 * np.pi * 0.7) ** 2) * motion
    told = _on_grid(model, motion, rate)
    np.testing.assert_allclose(told[200:-200], needed[200:-200], atol=0.01 * np.ptp(needed))
