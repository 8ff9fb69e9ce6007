# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Sets of causes: how often they hold the true one, and the calibration that makes them.

Of each claim the diagnosis tells a set of causes, which may hold `another` cause (any that is not
listed, or none). A set holds the truth if it holds a name that is right for the claim: one of
`accepted` that no other claim gives; or, where none of the claim and its alternatives is right, if
it holds another cause. A case holds if all its sets do; one without claims excludes nothing, and
holds.

The calibration takes of each case the largest nonconformity of its claims' true causes (0 without
claims), in groups that cases of any hand have. Cases of another hand are a yardstick, never a
source: they can be checked, not calibrated on.
"""
from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime, UTC
import json
import math
from pathlib import Path

from engb_core.diagnose.cause_sets import (
    ANOTHER,
    Calibration,
    cause_set,
    FORMAT,
    names_a_cause,
    nonconformity,
    ranked,
)
from engb_core.errors import InputError

__all__ = ['as_lines', 'calibrate', 'CauseSetScore', 'GROUPS', 'set_scores', 'totals_of']

# Claim, whether its set holds the truth, how many causes it holds, whether another one.
CauseSetScore = tuple[str, bool, int, bool]
GROUPS = {'clean': 'clean', 'strong': 'strong', 'subtle': 'subtle', 'pair': 'several',
          'triple': 'several', 'described': 'outside', 'undescribed': 'outside',
          'outside': 'outside'}
# Decimals of a nonconformity in the file, rounded up: no set gets smaller by it.
_DECIMALS = 6


def _ranking(claim: dict) -> list[tuple[str, float]]:
    return ranked(claim['effect'], float(claim['probability']),
                  [(str(one['effect']), float(one['probability']))
                   for one in claim.get('alternatives') or []])


def _right(claim: dict, claims: Sequence[dict], accepted: Iterable[str]) -> set[str]:
    """The names that are right for a claim: what another claim gives is not open any more."""
    return set(accepted) - {one['effect'] for one in claims if one is not claim}


def _score(effect: str, held: Sequence[str], another: bool, listed: set[str], right: set[str]
           ) -> CauseSetScore:
    truth_in = bool(right & set(held)) if right & listed else another
    return effect, truth_in, len(held) + another, another


def set_scores(claims: Sequence[dict], accepted: Iterable[str]
               ) -> tuple[CauseSetScore, ...] | None:
    """Score the sets that a diagnosis tells of its claims; None where it claims and tells none."""
    told = [one for one in claims if isinstance(one.get('causes'), dict)]
    if not told:
        return None if any(names_a_cause(one['effect']) for one in claims) else ()
    return tuple(_score(one['effect'], one['causes']['effects'], bool(one['causes']['another']),
                        {name for name, _ in _ranking(one)}, _right(one, claims, accepted))
                 for one in told)


def totals_of(cases: Iterable[tuple[str, tuple[CauseSetScore, ...] | None]]) -> dict[str, dict]:
    """How often sets hold the truth and how large they are, by stratum and in `all`.

    Args:
        cases: stratum and scores of each case.
    """
    rows: dict[str, dict] = {}
    for stratum, sets in cases:
        if sets is None:
            continue
        for name in (stratum, 'all'):
            row = rows.setdefault(name, {'cases': 0, 'held': 0, 'claiming': 0, 'claiming_held': 0,
                                         'sets': 0, 'causes': 0, 'single': 0, 'another': 0})
            held = all(one[1] for one in sets)
            row['cases'] += 1
            row['held'] += held
            row['claiming'] += bool(sets)
            row['claiming_held'] += bool(sets) and held
            row['sets'] += len(sets)
            row['causes'] += sum(size for _, _, size, _ in sets)
            row['single'] += sum(size == 1 for _, _, size, _ in sets)
            row['another'] += sum(another for *_, another in sets)
    for row in rows.values():
        row['size'] = row['causes'] / row['sets'] if row['sets'] else None
    return {name: rows[name] for name in (*GROUPS, 'all') if name in rows}


def as_lines(totals: dict[str, dict]) -> list[str]:
    """The totals as text, a line per stratum."""
    return [f'sets of causes, {name}: {row["held"]} of {row["cases"]} cases hold the truth '
            f'({row["claiming_held"]} of {row["claiming"]} with claims); ' + (
                'no set' if row['size'] is None else
                f'{row["size"]:.2f} causes on average, {row["single"]} of {row["sets"]} sets hold '
                f'one, {row["another"]} another cause')
            for name, row in totals.items()]


def _cases_of(folder: Path) -> list[tuple[dict, list[dict]]]:
    """Each case that a proof has scored: its row of cases.jsonl, its claims as they were said."""
    try:
        found = []
        for line in (folder / 'cases.jsonl').read_text('utf8').splitlines():
            row = json.loads(line)
            path = folder / 'results' / row['name'] / 'diagnosis.json'
            said = json.loads(path.read_text('utf8'))['effects'] if path.exists() else []
            kept = {name for name, _ in row['claims']}
            found.append((row, [one for one in said if one['effect'] in kept]))
        if not found or not all(row['stratum'] in GROUPS for row, _ in found):
            raise ValueError('no case of a known stratum')
        return found
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f'{folder}: holds no scored cases ({error}); name the --out of an '
                         'earlier engb prove') from error


def _nonconformity(row: dict, claims: list[dict]) -> float:
    return max((nonconformity(_ranking(one), _right(one, claims, row['accepted']))
                for one in claims if names_a_cause(one['effect'])), default=0.0)


def _sets_at(row: dict, claims: list[dict], threshold: float, level: float
             ) -> tuple[CauseSetScore, ...]:
    """What the diagnosis of a case would tell with another calibration, scored."""
    found = []
    for one in claims:
        if names_a_cause(one['effect']):
            ranking = _ranking(one)
            causes = cause_set(ranking, threshold, level)
            found.append(_score(one['effect'], causes.effects, causes.another,
                                {name for name, _ in ranking if name != ANOTHER},
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
    scores: dict[str, list[float]] = {}
    made = [_provenance(folder) for folder in folders]
    for folder in folders:
        for row, claims in _cases_of(folder):
            value = math.ceil(_nonconformity(row, claims) * 10 ** _DECIMALS) / 10 ** _DECIMALS
            scores.setdefault(GROUPS[row['stratum']], []).append(min(value, 1.0))
    threshold = Calibration({group: tuple(values) for group, values in scores.items()}
                            ).threshold(level)
    names = [name for name in dict.fromkeys(GROUPS.values()) if name in scores]
    head = json.dumps({'format': FORMAT, 'made': datetime.now(UTC).date().isoformat(),
                       'command': 'engb prove --calibrate', 'of': made,
                       'cases': {name: len(scores[name]) for name in names}}, indent=1)
    rows = ',\n'.join(f'  "{name}": {json.dumps(sorted(scores[name]))}' for name in names)
    lines = [f'{sum(map(len, scores.values()))} cases; at level {level:g} a set holds causes of a '
             f'nonconformity up to {threshold:.3f}']
    for name in names:
        one = Calibration({name: tuple(scores[name])}).threshold(level)
        lines.append(f'  {name}: {len(scores[name])} cases alone give {one:.3f}')
    for folder in (*folders, *checks):
        lines.append(f'{folder.name} ({"checked" if folder in checks else "calibrated on"}):')
        lines += ['  ' + line for line in as_lines(totals_of(
            (row['stratum'], _sets_at(row, claims, threshold, level))
            for row, claims in _cases_of(folder)))]
    out.write_text(f'{head[:-2]},\n "scores": {{\n{rows}\n }}\n}}\n', 'utf8')
    return '\n'.join(lines)
