# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Sets of causes are scored by what they hold, and calibrated on drawn cases only."""
from __future__ import annotations

import json
from pathlib import Path

import pytest

from engb_core.diagnose.cause_sets import Calibration
from engb_ros.commands.main import main
from tests.proof.cause_sets import as_lines, GROUPS, set_scores, totals_of
from tests.proof.generate import DEFAULT_STRATA
from tests.proof.score import OUTSIDE


def claim(effect: str, probability: float, *alternatives: tuple[str, float],
          causes: tuple[list[str], bool] | None = None) -> dict:
    said = {'effect': effect, 'probability': probability,
            'alternatives': [{'effect': name, 'probability': p} for name, p in alternatives]}
    if causes is not None:
        said['causes'] = {'level': 0.9, 'effects': causes[0], 'another': causes[1]}
    return said


def left(folder: Path, cases: list[tuple[str, list[str], list[dict]]],
         other: bool = False) -> Path:
    """A folder as a proof leaves it: stratum, accepted names and claims of each case."""
    rows = []
    for number, (stratum, accepted, claims) in enumerate(cases):
        name = f'case_{number:04d}'
        (folder / 'results' / name).mkdir(parents=True)
        (folder / 'results' / name / 'diagnosis.json').write_text(
            json.dumps({'effects': claims}), 'utf8')
        rows.append({'name': name, 'stratum': stratum, 'accepted': accepted,
                     'claims': [[one['effect'], one['probability']] for one in claims]})
    (folder / 'cases.jsonl').write_text('\n'.join(map(json.dumps, rows)), 'utf8')
    (folder / 'proof.json').write_text(json.dumps(
        {'cases_from': 'x', 'command': 'x'} if other else
        {'cases': len(cases), 'seed': 3, 'strata': '', 'effects': '', 'brief': True}), 'utf8')
    (folder / 'scores.json').write_text(json.dumps(
        {'digest': 'd', 'commits': ['abc'], 'date': '2026-11-27', 'cases': len(cases)}), 'utf8')
    return folder


def test_every_stratum_has_a_group() -> None:
    assert set(GROUPS) == {*DEFAULT_STRATA, *OUTSIDE}


def test_a_set_holds_what_is_right_and_open() -> None:
    rivals = ('pad_creep', 0.3)
    assert set_scores([claim('backlash', 0.6, rivals, causes=(['backlash'], False))],
                      ['backlash']) == (('backlash', 'leading', True, 1, False),)
    assert set_scores([claim('backlash', 0.6, rivals, causes=(['backlash'], False))],
                      ['pad_creep']) == (('backlash', 'leading', False, 1, False),)
    # None of those listed is right: only another cause is.
    assert set_scores([claim('backlash', 0.6, rivals, causes=(['backlash', 'pad_creep'], True))],
                      ['torque_offset']) == (('backlash', 'leading', True, 3, True),)
    # One that is listed is right, and not in the set: another cause is not it.
    assert set_scores([claim('backlash', 0.6, rivals, causes=(['backlash'], True))],
                      ['pad_creep']) == (('backlash', 'leading', False, 2, True),)


def test_what_another_claim_gives_is_not_open() -> None:
    claims = [claim('pad_creep', 0.9, causes=(['pad_creep'], False)),
              claim('backlash', 0.6, ('pad_creep', 0.3),
                    causes=(['backlash', 'pad_creep'], False))]
    assert set_scores(claims, ['pad_creep']) == (
        ('pad_creep', 'leading', True, 1, False), ('backlash', 'further', False, 2, False))


def test_a_silent_diagnosis_excludes_nothing_and_an_older_one_is_not_scored() -> None:
    assert set_scores([], ['backlash']) == ()
    assert set_scores([claim('load_curve_shape', 0.9)], []) == ()
    assert set_scores([claim('backlash', 0.9)], []) is None
    # What only describes the mismatch is no claim of a cause, and leads nothing.
    assert set_scores([claim('load_curve_shape', 0.9),
                       claim('backlash', 0.9, causes=(['backlash'], False))], ['backlash']) == (
        ('backlash', 'leading', True, 1, False),)


def test_totals_tell_places_apart() -> None:
    totals = totals_of([('clean', ()), ('strong', None), (
        'pair', (('a', 'leading', True, 1, False), ('b', 'further', False, 3, True),
                 ('c', 'further', True, 2, True)))])
    assert set(totals['leading']) == set(totals['further']) == {'clean', 'pair', 'all'}
    assert totals['leading']['all'] == {
        'cases': 2, 'held': 2, 'claiming': 1, 'claiming_held': 1, 'sets': 1, 'causes': 1,
        'single': 1, 'another': 0, 'size': 1.0}
    assert totals['further']['all'] == {
        'cases': 2, 'held': 1, 'claiming': 1, 'claiming_held': 0, 'sets': 2, 'causes': 5,
        'single': 0, 'another': 2, 'size': 2.5}
    assert 'leading claims, clean: 1 of 1 cases' in as_lines(totals)[0]


def test_it_is_calibrated_on_drawn_cases_and_checked_on_others(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    right, wrong = ['backlash'], ['torque_offset']
    cases = [(stratum, right, [claim('backlash', 0.9)]) for stratum in DEFAULT_STRATA
             for _ in range(12)]
    # Two of twelve subtle ones are wrong: at 0.9 that makes the set, the others alone would not.
    cases[24:26] = [('subtle', wrong, [claim('backlash', 0.3)]),
                       ('subtle', ['pad_creep'], [claim('backlash', 0.4, ('pad_creep', 0.5)),
                                               claim('torque_offset', 0.0)])]
    own = left(tmp_path / 'own', cases)
    other = left(tmp_path / 'other', [('outside', [], [claim('backlash', 0.9)]),
                                      ('strong', right, [claim('backlash', 0.89)])], other=True)
    out = tmp_path / 'cause_sets.json'
    assert main(['prove', '--calibrate', str(own), '--check', str(other), '--out', str(out)]) == 0
    told = capsys.readouterr().out
    assert '0.400 for leading claims (groups alone: clean 0.000 of 12' in told
    assert 'subtle 0.400 of 12' in told
    assert '0.000 for further claims' in told
    assert 'other (checked):' in told
    assert ('sets of causes, leading claims, all: 1 of 2 cases hold the truth (1 of 2 with such '
            'claims); 1.00 causes on average, 2 of 2 sets hold one') in told
    held = json.loads(out.read_text('utf8'))
    assert held['of'] == [{'drawn': 'engb prove --cases 84 --seed 3 --brief', 'digest': 'd',
                           'commits': ['abc'], 'date': '2026-11-27', 'cases': 84}]
    assert held['cases'] == {'clean': 12, 'strong': 12, 'subtle': 12, 'several': 24, 'outside': 24}
    assert held['scores']['leading']['subtle'] == [0.0] * 10 + [0.3, 0.4]
    assert Calibration.read(out).thresholds(0.9) == {'leading': 0.4, 'further': 0.0}


@pytest.mark.parametrize(('arguments', 'told'), [
    (['--calibrate', 'own'], '--out FILE is needed'),
    (['--calibrate', 'own', '--out', 'own'], 'is a folder; name a file'),
    (['--calibrate', 'own', 'own', '--out', 'x'], 'a folder is given twice'),
    (['--calibrate', 'own', '--check', 'own', '--out', 'x'], 'a folder is given twice'),
    (['--calibrate', 'other', '--out', 'x'], 'cases of another hand'),
    (['--calibrate', 'nowhere', '--out', 'x'], 'holds no finished proof'),
    (['--calibrate', 'own', '--check', 'nowhere', '--out', 'x'], 'holds no scored cases'),
    (['--check', 'own', '--out', 'x'], 'belongs to --calibrate'),
])
def test_wrong_calls_end_in_one_line(arguments: list[str], told: str, tmp_path: Path,
                                     monkeypatch: pytest.MonkeyPatch,
                                     capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    left(tmp_path / 'own', [('clean', [], [])])
    left(tmp_path / 'other', [('clean', [], [])], other=True)
    assert main(['prove', *arguments]) == 2
    said = capsys.readouterr().err
    assert said.startswith('engb: ') and told in said
    assert said.count('\n') == 1
    assert not (tmp_path / 'x').exists()
