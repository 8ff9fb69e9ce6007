# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The README's table is made of what the proofs left, a column per kind of evidence."""
from __future__ import annotations

import json
from pathlib import Path

import pytest

from engb_ros.commands.main import main
from tests.proof.readme_table import column_of, ROWS
from tests.proof.real_ladder import CORRECTED
from tests.proof.test_score import summary_of

TOLD = {'command': 'engb prove --out x', 'date': '2026-11-23T23:00:00+00:00', 'commits': ['abc']}


def row(taken: str | None, verdict: str | None, after: float, said: float | None = None) -> dict:
    return {'taken': taken, 'verdict': verdict, 'times_best': 2.0, 'after_times_best': after,
            'said': said, 'value': None if said is None else 1.0, 'std': 0.1, 'seconds': 5.0,
            'claims': [] if taken else [('backlash', 0.3)]}


REAL = {**TOLD, 'sets': [{
    'name': 'axis', 'ladder': [{'rung': 'nominal', 'force': {'holdout': 0.08}},
                               {'rung': CORRECTED, 'force': {'holdout': 0.03}}],
    'rows': [row(None, None, 1.0), row('inertia_error', 'just it', 1.1, said=1.1),
             row('coulomb_friction_error', 'another', 2.5, said=1.9),
             row('asymmetric_friction', 'cannot tell', 1.0)]}]}


def left(folder: Path, name: str, result: dict) -> str:
    """A folder as a proof leaves it."""
    folder.mkdir()
    (folder / name).write_text(json.dumps(result), 'utf8')
    return str(folder)


def test_three_columns_stand_side_by_side(tmp_path: Path, capsys: pytest.CaptureFixture[str]
                                          ) -> None:
    (tmp_path / 'truth').mkdir()
    summary = {**TOLD, 'seed': 7, **summary_of(tmp_path / 'truth', perfect=True)}
    own = left(tmp_path / 'own', 'scores.json', {**summary, 'source': 'own'})
    other = left(tmp_path / 'other', 'scores.json', {**summary, 'source': 'other', 'seed': None})
    real = left(tmp_path / 'real', 'real.json', REAL)
    assert main(['prove', '--table', own, other, real]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == ('| score | own development generator | cases from another hand | '
                        'real machines |')
    cells = {line.split(' | ')[0].strip('| '): [cell.strip(' |') for cell in line.split(' | ')[1:]]
             for line in lines if line.startswith('| ')}
    assert cells['first of singles, strong / subtle'] == [
        '1 of 1 / 1 of 1', '1 of 1 / 1 of 1', 'axis 1 of 2']
    assert cells['something said on a clean recording (real: nothing taken out)'] == [
        '0 of 1', '0 of 1', 'axis backlash 0.30']
    assert cells['harm: held-out error 5 % and 0.2 floors larger (real: 5 %), all cases'] == [
        '0 of 5', '0 of 5', 'axis 1 of 4']
    assert cells['truth inside two deviations'] == ['100 %', '100 %', 'axis 1 of 2']
    assert cells['held-out force error, model file → corrected model'] == [
        '–', '–', 'axis 8.0 % → 3.0 %']
    assert cells['right variables / memory outside: undescribed (described)'][0] == '100 % / 100 %'
    assert 'seed 7' in lines[-3] and 'commit abc' in lines[-3]


def test_every_row_has_a_cell_of_each_kind(tmp_path: Path) -> None:
    summary = {**TOLD, 'source': 'own', **summary_of(tmp_path, perfect=False)}
    assert len(column_of(summary)['cells']) == len(column_of(REAL)['cells'])


@pytest.mark.parametrize(('name', 'content', 'told'), [
    (None, '', 'holds no scores.json or real.json'),
    ('scores.json', '{', 'was not written by this version'),
    ('scores.json', '{"cases": 3}', 'was not written by this version'),
])
def test_a_folder_without_scores_is_told(name: str | None, content: str, told: str, tmp_path: Path,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    if name:
        (tmp_path / name).write_text(content, 'utf8')
    assert main(['prove', '--table', str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert told in said
    assert said.count('\n') == 1


def test_the_table_in_the_readme_has_these_rows() -> None:
    text = (Path(__file__).resolve().parents[2] / 'README.md').read_text('utf8')
    told = [line.split(' | ')[0].strip('| ') for line in text.splitlines()
            if line.startswith('| ')]
    labels = [label for label, *_ in ROWS]
    begin = told.index(labels[0])
    assert told[begin:begin + len(labels)] == labels
