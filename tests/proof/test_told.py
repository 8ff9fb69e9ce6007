# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What `engb prove` prints of scores that are there, and with which status it ends."""
from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from engb_core.errors import InputError
from engb_ros.commands import prove as command
from engb_ros.commands.main import main
from tests.proof.prove import Proof, strict_failures

SUMMARY: dict[str, Any] = {'wall_seconds': 3.0, 'failures': [], 'misses': []}
BASELINE = {'label': 'refit', 'gives_names': True, 'named_first': {'strong': {'hits': 3, 'of': 4}},
            'pairs_both': None, 'false_alarms': {'hits': 1, 'of': 9},
            'confident_wrong_outside': None, 'harm': {'hits': 0, 'of': 9},
            'held_out_removed': {'singles': 0.75, 'pairs': None, 'named_singles': 0.5}}


@pytest.fixture
def scored(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Any]:
    """Put `summary[0]` in the place of a run; the jobs that were given follow it."""
    summary: list[Any] = [SUMMARY]

    def prove(job: Proof, *rest: Any) -> dict[str, Any]:
        summary.append(job)
        job.out.mkdir(exist_ok=True)
        (job.out / 'scores.txt').write_text('named first 3/4\n')
        rest[-1]('case 1 of 1')
        return dict(summary[0])

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(command, '_proof', lambda name: SimpleNamespace(
        Proof=Proof, prove=prove, prove_other=prove, strict_failures=strict_failures))
    return summary


def test_scores_and_methods_beside_are_printed(scored: list[Any],
                                               capsys: pytest.CaptureFixture[str]) -> None:
    scored[0] = SUMMARY | {'baselines': [BASELINE, BASELINE | {'gives_names': False}],
                           'thresholding': 'PySINDy'}
    assert main(['prove', '--out', 'out', '--cases', '3']) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == ['case 1 of 1', 'named first 3/4']
    assert lines[2] == ('baseline refit: strong 3/4, false alarms 1/9, harm 0/9, error removed, '
                        'singles 75%')
    assert lines[3] == 'baseline refit: harm 0/9, error removed, singles 75%'
    assert lines[4:] == ['sparse regression by PySINDy', '3 s in all', 'scores: out/index.html']
    assert scored[1].cases == 3 and not scored[1].frozen


@pytest.mark.parametrize(('hits', 'status'), [(7, 0), (6, 1)])
def test_a_rate_of_the_frozen_list_that_fell_is_told_and_ends_in_1(
        scored: list[Any], capsys: pytest.CaptureFixture[str], hits: int, status: int) -> None:
    scored[0] = SUMMARY | {'frozen': {'named first': {
        'hits': hits, 'of': 9, 'measured': 8, 'least': 7}}}
    assert main(['prove', '--out', 'out', '--frozen']) == status
    told = f'named first: {hits} of 9 (measured before 8, at least 7)'
    caught = capsys.readouterr()
    assert f'frozen list, {told}' in caught.out
    assert caught.err == (f'engb: the rate fell: {told}\n' if status else '')


def test_a_crash_on_the_frozen_list_or_a_false_alarm_under_strict_ends_in_1(
        scored: list[Any], capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    scored[0] = SUMMARY | {'failures': [{'case': 'case_0003', 'failure': 'exit 70'}]}
    assert main(['prove', '--out', 'out', '--frozen']) == 1
    assert capsys.readouterr().err == 'engb: case_0003 failed: exit 70\n'
    scored[0] = SUMMARY | {'misses': [{'case': 'case_0001', 'hidden': [],
                                       'claims': [('backlash', 0.6)]}]}
    (tmp_path / 'given').mkdir()
    assert main(['prove', '--out', 'new', '--cases-from', 'given', '--strict']) == 1
    assert capsys.readouterr().err == 'engb: case_0001: false alarm: backlash\n'


@pytest.mark.parametrize(('arguments', 'told'), [
    (['--out', 'x', '--real', '.', '--cases-from', '.'], '--real and --cases-from: give one'),
    (['--out', 'x', '--seed', '-1'], '--seed -1: must not be below 0'),
    (['--out', 'x', '--jobs', '0'], '--jobs 0: must be at least 1'),
    (['--out', 'file'], '--out file: is a file; name a folder'),
    (['--out', 'x', '--pairs'], '--pairs belongs to --real'),
    (['--out', 'odd'], '--out odd: holds something else'),
])
def test_wrong_calls_are_told(scored: list[Any], capsys: pytest.CaptureFixture[str],
                              tmp_path: Path, arguments: list[str], told: str) -> None:
    (tmp_path / 'file').write_text('')
    (tmp_path / 'odd').mkdir()
    (tmp_path / 'odd' / 'scores.json').write_text('{"other": 1}')
    assert main(['prove', *arguments]) == 2
    assert told in capsys.readouterr().err


@pytest.mark.parametrize(('name', 'key'), [('proof.json', 'digest'), ('real.json', 'sets')])
def test_a_folder_of_an_earlier_proof_is_used_again(scored: list[Any], tmp_path: Path, name: str,
                                                    key: str) -> None:
    (tmp_path / 'out' / 'results' / 'case_0001').mkdir(parents=True)
    (tmp_path / 'out' / 'other').mkdir()
    (tmp_path / 'out' / 'results' / 'case_0001' / 'run.json').write_text('{}')
    assert main(['prove', '--out', 'out', '--score']) == 2
    (tmp_path / 'out' / name).write_text(json.dumps({key: 'x'}))
    assert main(['prove', '--out', 'out', '--score']) == 0


def test_without_numba_the_proof_says_what_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    from engb_core.physics import compiled
    monkeypatch.setattr(compiled, 'WHY_NOT', 'numba is not installed')
    with pytest.raises(InputError, match='engb prove needs numba: numba is not installed; pip'):
        command._proof('prove')


def test_a_seal_beside_a_diagnosis_that_says_nothing(tmp_path: Path,
                                                     capsys: pytest.CaptureFixture[str]) -> None:
    seal = Path(__file__).resolve().parents[2] / 'bags' / 'brake_1' / 'truth.sealed'
    said = tmp_path / 'diagnosis.json'
    said.write_text('{"effects": []}')
    assert main(['prove', '--open', str(seal), '--diagnosis', str(said)]) == 0
    printed = capsys.readouterr().out
    assert printed.endswith('said:\n   nothing\n') and 'found' not in printed
    said.write_text('{"effects": [{}]}')
    assert main(['prove', '--open', str(seal), '--diagnosis', str(said)]) == 2
