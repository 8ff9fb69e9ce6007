# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""`engb prove` end to end on three fixed cases, and opening a seal."""
from __future__ import annotations

import json
import os
from pathlib import Path
import subprocess
import sys

import pytest

from engb_core.errors import InputError
from engb_ros.commands.main import main
from tests.proof.prove import _run_all, chosen, strict_failures
from tests.proof.symbolic import is_there

ROOT = Path(__file__).resolve().parents[2]
SEAL = ROOT / 'bags' / 'brake_1' / 'truth.sealed'

pytestmark = pytest.mark.timeout(900)


def engb(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the program in `folder`, as a user would."""
    path = os.pathsep.join([str(ROOT), os.environ.get('PYTHONPATH', '')]).rstrip(os.pathsep)
    return subprocess.run([sys.executable, '-m', 'engb_ros.commands.main', *arguments],
                          cwd=folder, env={**os.environ, 'PYTHONPATH': path},
                          capture_output=True, text=True)


@pytest.fixture(scope='module')
def proof(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, subprocess.CompletedProcess]:
    """A clean case, a strong one, and one outside the library."""
    folder = tmp_path_factory.mktemp('proof')
    done = engb(folder, 'prove', '--cases', '3', '--seed', '1', '--strata',
                'clean=1,strong=1,undescribed=1', '--brief', '--out', 'out', '--jobs', '2')
    return folder / 'out', done


def test_no_crash(proof: tuple[Path, subprocess.CompletedProcess]) -> None:
    # What was found, and what not, is a score: the frozen list of .ci/run watches its rates.
    _, done = proof
    assert done.returncode == 0, done.stderr
    assert done.stderr == ''


def test_scores_and_page_are_written(proof: tuple[Path, subprocess.CompletedProcess]) -> None:
    out, done = proof
    scores = json.loads((out / 'scores.json').read_text('utf8'))
    assert scores['cases'] == 3
    assert scores['false_alarms']['of'] == 1
    lines = done.stdout.splitlines()
    assert lines[1] == f'truth sealed: sha256 {scores["digest"]}'
    page = (out / 'index.html').read_text('utf8')
    assert scores['digest'] in page
    assert 'own development generator' in (out / 'column.md').read_text('utf8')
    for miss in scores['misses']:
        assert f'results/{miss["case"]}/report.html' in page
        assert (out / 'results' / miss['case'] / 'report.html').exists()


def test_second_start_runs_nothing_and_a_changed_truth_is_refused(
        proof: tuple[Path, subprocess.CompletedProcess]) -> None:
    out, _ = proof
    before = {p: p.stat().st_mtime_ns for p in out.glob('results/*/run.json')}
    done = engb(out.parent, 'prove', '--out', 'out')
    assert done.returncode == 0, done.stderr
    assert {p: p.stat().st_mtime_ns for p in out.glob('results/*/run.json')} == before
    other = engb(out.parent, 'prove', '--out', 'out', '--seed', '2')
    assert other.returncode == 2
    assert '--seed 1' in other.stderr
    sealed = sorted((out / 'truth').glob('case_*.npz'))[0]
    content = sealed.read_bytes()
    sealed.write_bytes(content + b' ')
    changed = engb(out.parent, 'prove', '--out', 'out')
    sealed.write_bytes(content)
    assert changed.returncode == 2
    assert 'not what was sealed' in changed.stderr


def test_a_part_that_was_run_is_scored(proof: tuple[Path, subprocess.CompletedProcess]) -> None:
    out, _ = proof
    note = out / 'results' / 'case_0002' / 'run.json'
    kept = note.read_bytes()
    note.unlink()
    part = engb(out.parent, 'prove', '--out', 'out', '--score')
    scores = json.loads((out / 'scores.json').read_text('utf8'))
    assert part.returncode == 0, part.stderr
    assert not note.exists()
    assert scores['cases'] == 2
    # The column tells how the cases were drawn, not how they were scored.
    assert '--brief' in scores['command'] and '--score' not in scores['command']
    note.write_bytes(kept)


def test_baselines_are_scored_on_the_same_cases(
        proof: tuple[Path, subprocess.CompletedProcess]) -> None:
    out, _ = proof
    done = engb(out.parent, 'prove', '--reuse', 'out', '--out', 'out', '--baselines')
    assert done.returncode == 0, done.stderr
    scores = json.loads((out / 'scores.json').read_text('utf8'))
    assert [one['name'] for one in scores['baselines']] == [
        'refit', 'bic', 'sparse', 'flexible', *(['symbolic'] if is_there() else []), 'oracle']
    assert not [one for one in scores['baselines'] if one['failures']]
    assert 'Beside plain methods' in (out / 'index.html').read_text('utf8')


def test_open_shows_the_truth_beside_a_diagnosis(tmp_path: Path) -> None:
    from engb_core.io.sealed import opened
    truth = opened(SEAL.read_text('ascii'))
    claim = {'effect': truth['effect'], 'probability': 0.9,
             'parameters': {name: {'value': 2.0, 'std': None, 'unit': '-'}
                            for name in truth['parameters']}}
    other = {'effect': 'no_such', 'probability': 0.1, 'parameters': {}}
    path = tmp_path / 'diagnosis.json'
    path.write_text(json.dumps({'effects': [other, claim]}), 'utf8')
    done = engb(tmp_path, 'prove', '--open', str(SEAL), '--diagnosis', str(path))
    assert done.returncode == 0, done.stderr
    assert f'concealed: {truth["effect"]}' in done.stdout
    assert f'2. {truth["effect"]} (probability 0.90) ← concealed' in done.stdout
    assert 'found 2' in done.stdout
    digest = done.stdout.splitlines()[0].removeprefix('sha256 ')
    assert digest in (ROOT / 'bags' / 'README.md').read_text('utf8')


@pytest.mark.parametrize(('arguments', 'told'), [
    (['--open', 'nothing.sealed'], 'No such file'),
    (['--open', 'noise.sealed'], 'not a sealed truth'),
    (['--cases', '3'], '--out DIR is needed'),
    (['--out', 'x', '--cases', '0'], '--cases 0'),
    (['--out', 'x', '--strata', 'odd=1'], "no stratum 'odd'"),
    (['--out', 'x', '--strata', 'clean=many'], 'clean=1'),
    (['--out', 'x', '--frozen', '--seed', '1'], 'leave --seed away'),
    (['--out', 'x', '--effects', 'odd'], "no effect 'odd'"),
    (['--out', 'x', '--reuse', 'y'], 'holds no cases'),
    (['--out', '.'], 'holds something else'),
    (['--out', 'x', '--cases-from', 'nowhere'], 'no such folder'),
    (['--out', 'x', '--cases-from', 'empty'], 'holds no folder case_'),
    (['--out', 'x', '--cases-from', 'empty', '--seed', '1'], 'leave --seed away'),
    (['--out', 'x', '--only', '3'], 'belongs to --cases-from'),
    (['--out', 'x', '--score'], 'holds nothing that was run'),
    (['--out', 'x', '--score', '--again'], 'leave --again away'),
    (['--diagnosis', 'noise.sealed'], 'belongs to --open'),
])
def test_wrong_calls_end_in_one_line(arguments: list[str], told: str, tmp_path: Path,
                                     monkeypatch: pytest.MonkeyPatch,
                                     capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'empty').mkdir()
    (tmp_path / 'noise.sealed').write_bytes(b'\xff\x00noise')
    assert main(['prove', *arguments]) == 2
    said = capsys.readouterr().err
    assert said.startswith('engb: ')
    assert told in said
    assert said.count('\n') == 1


def test_a_stopped_run_is_done_again(tmp_path: Path) -> None:
    def ended(at: Path, failure: str | None) -> str | None:
        at.mkdir(exist_ok=True)
        (at / 'run.json').write_text('{}', 'utf8')
        return failure

    good, stopped = tmp_path / 'good', tmp_path / 'stopped'
    with pytest.raises(KeyboardInterrupt):
        _run_all([(lambda: ended(good, None), good),
                  (lambda: ended(stopped, 'diagnose: exit 130: engb: interrupted'), stopped)],
                 1, lambda text: None)
    assert (good / 'run.json').exists()
    assert not (stopped / 'run.json').exists()
    told: list[str] = []
    _run_all([(lambda: ended(good, 'never called'), good),
              (lambda: ended(stopped, None), stopped)], 1, told.append)
    assert told == [f'1/1 {tmp_path.name} stopped: done; about 0 min left']


def test_strict_fails_on_crashes_and_false_alarms_only() -> None:
    misses = [{'case': 'case_0001', 'hidden': [], 'claims': [('backlash', 0.6)]},
              {'case': 'case_0002', 'hidden': ['backlash'], 'claims': []}]
    found = strict_failures({'failures': [{'case': 'case_0003', 'failure': 'exit 70'}],
                             'misses': misses})
    assert found == ['case_0003 failed: exit 70', 'case_0001: false alarm: backlash']


def test_a_case_is_named_by_its_number() -> None:
    cases = [Path(f'given/case_{name}') for name in ('03', '12', 'clean')]
    assert chosen(cases, '3,clean') == [cases[0], cases[2]]
    assert chosen(cases, '03') == cases[:1]
    with pytest.raises(InputError, match='--only 4: given holds no case_4'):
        chosen(cases, '4')
