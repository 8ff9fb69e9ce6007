# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Sets of causes: how often they hold the true one, and the calibration that makes them.

Of each claim the diagnosis tells a set of causes, which may hold `another` cause (any that is not
listed, or none). A set holds the truth if it holds a name that is right for the claim: one of
`accepted` that no other claim gives; or, where none of the claim and its alternatives is right, if
it holds another cause. The claim that leads in share and those after it are scored apart: a case
holds in a place if all its sets there do; one without a claim there excludes nothing, and holds.

The calibration takes of each case and place the largest nonconformity of its claims' true causes
(0 without claims), in groups that cases of any hand have. Cases of another hand are a yardstick,
never a source: they can be checked, not calibrated on.
"""
from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime, UTC
import json
import math
from pathlib import Path

from engb_core.diagnose.cause_sets import (
    Calibration,
    cause_set,
    conformal_quantile,
    FORMAT,
    FURTHER,
    LEADING,
    names_a_cause,
    nonconformity,
    PLACES,
    ranked,
)
from engb_core.errors import InputError

__all__ = ['as_lines', 'calibrate', 'CauseSetScore', 'GROUPS', 'set_scores', 'totals_of']

# Claim, its place, whether its set holds the truth, how many causes it holds, whether another one.
CauseSetScore = tuple[str, str, bool, int, bool]
GROUPS = {'clean': 'clean', 'strong': 'strong', 'subtle': 'subtle', 'pair': 'several',
          'triple': 'several', 'described': 'outside', 'undescribed': 'outside',
          'outside': 'outside'}
# Decimals of a nonconformity in the file, rounded up: no set gets smaller by it.
_DECIMALS = 6


def _ranking(claim: dict) -> list[tuple[str, float]]:
    return ranked(claim['effect'], float(claim['probability']),
                  [(str(one['effect']), float(one['probability']))
                   for one in claim.get('alternatives') or []])


def _placed(claims: Sequence[dict]) -> list[tuple[str, dict]]:
    """The claims that name a cause, each with its place; they come in order of share."""
    named = [one for one in claims if names_a_cause(one['effect'])]
    return [(LEADING if number == 0 else FURTHER, one) for number, one in enumerate(named)]


def _right(claim: dict, claims: Sequence[dict], accepted: Iterable[str]) -> set[str]:
    """The names that are right for a claim: what another claim gives is not open any more."""
    return set(accepted) - {one['effect'] for one in claims if one is not claim}


def _score(claim: dict, place: str, held: Sequence[str], another: bool, right: set[str]
           ) -> CauseSetScore:
    listed = {name for name, _ in _ranking(claim)}
    truth_in = bool(right & set(held)) if right & listed else another
    return claim['effect'], place, truth_in, len(held) + another, another


def set_scores(claims: Sequence[dict], accepted: Iterable[str]
               ) -> tuple[CauseSetScore, ...] | None:
    """Score the sets that a diagnosis tells of its claims; None where it claims and tells none."""
    placed = _placed(claims)
    if not all(isinstance(one.get('causes'), dict) for _, one in placed):
        return None
    return tuple(_score(one, place, one['causes']['effects'], bool(one['causes']['another']),
                        _right(one, claims, accepted)) for place, one in placed)


def totals_of(cases: Iterable[tuple[str, tuple[CauseSetScore, ...] | None]]
              ) -> dict[str, dict[str, dict]]:
    """How often sets hold the truth and how large they are, by place, by stratum and in `all`.

    Args:
        cases: stratum and scores of each case.
    """
    found: dict[str, dict[str, dict]] = {place: {} for place in PLACES}
    for stratum, sets in cases:
        if sets is None:
            continue
        for place, rows in found.items():
            there = [one for one in sets if one[1] == place]
            held = all(one[2] for one in there)
            for name in (stratum, 'all'):
                row = rows.setdefault(name, {
                    'cases': 0, 'held': 0, 'claiming': 0, 'claiming_held': 0, 'sets': 0,
                    'causes': 0, 'single': 0, 'another': 0})
                row['cases'] += 1
                row['held'] += held
                row['claiming'] += bool(there)
                row['claiming_held'] += bool(there) and held
                row['sets'] += len(there)
                row['causes'] += sum(size for *_, size, _ in there)
                row['single'] += sum(size == 1 for *_, size, _ in there)
                row['another'] += sum(another for *_, another in there)
    for rows in found.values():
        for row in rows.values():
            row['size'] = row['causes'] / row['sets'] if row['sets'] else None
    return {place: {name: rows[name] for name in (*GROUPS, 'all') if name in rows}
            for place, rows in found.items()}


def as_lines(totals: dict[str, dict[str, dict]]) -> list[str]:
    """The totals as text, a line per place and stratum."""
    return [f'sets of causes, {place} claims, {name}: {row["held"]} of {row["cases"]} cases hold '
            f'the truth ({row["claiming_held"]} of {row["claiming"]} with such claims); ' + (
                'no set' if row['size'] is None else
                f'{row["size"]:.2f} causes on average, {row["single"]} of {row["sets"]} sets hold '
                f'one, {row["another"]} another cause')
            for place, rows in totals.items() for name, row in rows.items()]


def _cases_of(folder: Path) -> list[tuple[dict, list[dict]]]:
    """Each case that a proof has scored: its row of cases.jsonl, its claims as they were said."""
    try:
        found = []
        for line in (folder / 'cases.jsonl').read_text('utf8').splitlines():
            row = json.loads(line)
            path = folder / 'results' / row['name'] / 'diagnosis.json'
            found.append((row, json.loads(path.read_text('utf8'))['effects']
                          if path.exists() else []))
        if not found or not all(row['stratum'] in GROUPS for row, _ in found):
            raise ValueError('no case of a known stratum')
        return found
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f'{folder}: holds no scored cases ({error}); name the --out of an '
                         'earlier engb prove') from error


def _nonconformity(row: dict, claims: list[dict], place: str) -> float:
    """The largest of the claims in a place, rounded up."""
    value = max((nonconformity(_ranking(one), _right(one, claims, row['accepted']))
                 for where, one in _placed(claims) if where == place), default=0.0)
    return min(math.ceil(value * 10 ** _DECIMALS) / 10 ** _DECIMALS, 1.0)


def _sets_at(row: dict, claims: list[dict], thresholds: dict[str, float], level: float
             ) -> tuple[CauseSetScore, ...]:
    """What the diagnosis of a case would tell with another calibration, scored."""
    found = []
    for place, one in _placed(claims):
        causes = cause_set(_ranking(one), thresholds[place], level)
        found.append(_score(one, place, causes.effects, causes.another,
                            _right(one, claims, row['accepted'])))
    return tuple(found)


def _provenance(folder: Path) -> dict:
    """How the cases of a folder were drawn, and by which commits they were diagnosed."""
    try:
        plan = json.loads((folder / 'proof.json').read_text('utf8'))
        scores = json.loads((folder / 'scores.json').read_text('utf8'))
        if 'cases_from' in plan:
            raise InputError(f'--calibrate {folder}: holds cases of another hand, which are a '
                             'yardstick; give it to --check')
        drawn = f'engb prove --cases {plan["cases"]} --seed {plan["seed"]}'
        drawn += f' --strata {plan["strata"]}' if plan['strata'] else ''
        drawn += f' --effects {plan["effects"]}' if plan['effects'] else ''
        return {'drawn': drawn + (' --brief' if plan.get('brief') else ''),
                'digest': scores['digest'], 'commits': scores['commits'],
                'date': scores['date'], 'cases': scores['cases']}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f'--calibrate {folder}: holds no finished proof ({error}); name the '
                         '--out of an earlier engb prove') from error


def calibrate(folders: Sequence[Path], checks: Sequence[Path], out: Path, level: float) -> str:
    """Write the calibration of the sets of causes; returns what it gives, as text.

    Args:
        folders: of proofs on drawn cases.
        checks: of proofs on other cases, on which it is checked.
        out: the file to write.
        level: at which it is checked [-].

    Raises:
        InputError: a folder holds no scored cases, those of another hand, or is given twice.
    """
    given = [folder.resolve() for folder in (*folders, *checks)]
    if len(set(given)) < len(given):
        raise InputError('--calibrate, --check: a folder is given twice; check on other cases')
    made = [_provenance(folder) for folder in folders]
    cases = [case for folder in folders for case in _cases_of(folder)]
    names = [name for name in dict.fromkeys(GROUPS.values())
             if any(GROUPS[row['stratum']] == name for row, _ in cases)]
    scores = {place: {name: tuple(sorted(
        _nonconformity(row, claims, place) for row, claims in cases
        if GROUPS[row['stratum']] == name)) for name in names} for place in PLACES}
    thresholds = Calibration(scores).thresholds(level)
    lines = [f'{len(cases)} cases; at level {level:g} a set holds causes of a nonconformity up to']
    for place, groups in scores.items():
        alone = ', '.join(f'{name} {conformal_quantile(values, level):.3f} of {len(values)}'
                          for name, values in groups.items())
        lines.append(f'  {thresholds[place]:.3f} for {place} claims (groups alone: {alone})')
    for folder in (*folders, *checks):
        lines.append(f'{folder.name} ({"checked" if folder in checks else "calibrated on"}):')
        lines += ['  ' + line for line in as_lines(totals_of(
            (row['stratum'], _sets_at(row, claims, thresholds, level))
            for row, claims in _cases_of(folder)))]
    head = json.dumps({'format': FORMAT, 'made': datetime.now(UTC).date().isoformat(),
                       'command': 'engb prove --calibrate', 'of': made,
                       'cases': {name: len(scores[LEADING][name]) for name in names}}, indent=1)
    tables = ',\n'.join(f'  "{place}": {{\n' + ',\n'.join(
        f'   "{name}": {json.dumps(values)}' for name, values in groups.items()) + '\n  }'
        for place, groups in scores.items())
    out.write_text(f'{head[:-2]},\n "scores": {{\n{tables}\n }}\n}}\n', 'utf8')
    return '\n'.join(lines)
