# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The README's table: a column per kind of evidence, made of what `engb prove` left in a folder.

Three kinds, never mixed: cases of the own generator and cases from another hand (scores.json), and
real machines (real.json), where a case is one term taken out of a model. A cell without a meaning
for its column is a dash.
"""
from __future__ import annotations

from collections.abc import Callable, Sequence
import json
from pathlib import Path

from engb_core.errors import InputError

from .real_ladder import CORRECTED

__all__ = ['as_markdown', 'column_of', 'ROWS', 'table']

_NOTHING = '–'
_TITLES = {'own': 'own development generator', 'other': 'cases from another hand',
           'real': 'real machines'}
_WORSE = 1.05       # times the held-out error before: made worse


def _of(entry: dict | None) -> str:
    return _NOTHING if entry is None else f'{entry["hits"]} of {entry["of"]}'


def _percent(value: float | None, digits: int = 0) -> str:
    return _NOTHING if value is None else f'{100.0 * value:.{digits}f} %'


def _number(value: float | None, digits: int) -> str:
    return _NOTHING if value is None else f'{value:.{digits}f}'


def _both(*cells: str) -> str:
    return _NOTHING if set(cells) == {_NOTHING} else ' / '.join(cells)


def _outside(summary: dict, tell: Callable[[str], str]) -> str:
    """The undescribed stratum, the described one in brackets; of another hand all in one."""
    if 'outside' in summary['strata_of']:
        return tell('outside')
    inner = tell('described')
    return tell('undescribed') + ('' if inner == _NOTHING else f' ({inner})')


def _variables(summary: dict) -> str:
    def tell(stratum: str) -> str:
        told = summary['variables'].get(stratum)
        return _NOTHING if not told else f'{_percent(told["told"])} / {_percent(told["memory"])}'
    return _outside(summary, tell)


def _bands(summary: dict) -> str:
    bands = {round(band['from'], 2): f'{band["right"]} of {band["claims"]}'
             for band in summary['calibration']['bands']}
    return f'{bands.get(0.9, _NOTHING)} ({bands.get(0.97, _NOTHING)})'


def _sets(summary: dict, place: str) -> str:
    """Of all cases how many hold the truth, of those with such claims, the worst stratum of these;
    and how many causes a set has on average."""
    rows = dict(summary['cause_sets'][place])
    every = rows.pop('all', None)
    if every is None or not every['sets']:
        return _NOTHING
    claiming = {name: row for name, row in rows.items() if row['claiming']}
    worst = min(claiming, key=lambda name: (
        claiming[name]['claiming_held'] / claiming[name]['claiming'], -claiming[name]['claiming']))
    row = claiming[worst]
    return (f'{every["held"]} of {every["cases"]} / {every["claiming_held"]} of '
            f'{every["claiming"]} ({worst} {row["claiming_held"]} of {row["claiming"]}); '
            f'{every["size"]:.2f}')


def _onset(summary: dict) -> str:
    begun = summary['onset']
    if not begun['begins']:
        return _NOTHING
    off = begun['median_error']
    return (f'{begun["told"]} of {begun["begins"]}' + ('' if off is None else f', {off:.2f} s')
            + f'; {begun["invented"]} of {begun["throughout"]}')


def _conditions(summary: dict, *tags: str) -> str:
    return _both(*(_of(summary['by_tag'].get(tag)) for tag in tags))


def _seconds(summary: dict) -> str:
    return _both(*(_number(summary['seconds'][key], 0) for key in ('median', 'p95', 'max')))


def _where(summary: dict) -> str:
    one = summary['localisation']
    return (f'{_number(one["precision"], 2)} / {_number(one["recall"], 2)} '
            f'({_number(one["chance"], 2)})')


def _by_set(result: dict, tell: Callable[[dict], str]) -> str:
    return '; '.join(f'{one["name"]} {tell(one)}' for one in result['sets'])


def _taken(one: dict) -> list[dict]:
    return [row for row in one['rows'] if row['taken'] and row['verdict'] != 'cannot tell']


def _named(one: dict) -> str:
    rows = _taken(one)
    return f'{sum(row["verdict"] in ("just it", "first") for row in rows)} of {len(rows)}'


def _anyway(one: dict) -> str:
    claims = next((row['claims'] for row in one['rows'] if not row['taken']), [])
    return ', '.join(f'{name} {p:.2f}' for name, p in claims) or 'nothing'


def _worse(one: dict) -> str:
    rows = one['rows']
    worse = sum(row['after_times_best'] > _WORSE * row['times_best'] for row in rows)
    return f'{worse} of {len(rows)}'


def _inside(one: dict) -> str:
    rows = [row for row in one['rows'] if row['said'] is not None and row['std']
            and row['value'] is not None]
    good = sum(abs(row['said'] - row['value']) <= 2.0 * row['std'] for row in rows)
    return f'{good} of {len(rows)}'


def _force(one: dict) -> str:
    rungs = {rung['rung']: rung['force']['holdout'] for rung in one['ladder']}
    return (f'{_percent(rungs["nominal"], 1)} → '
            f'{_percent(rungs[CORRECTED], 1)}')


def _time(one: dict) -> str:
    took = sorted(row['seconds'] for row in one['rows'])
    return f'{took[len(took) // 2]:.0f} / – / {took[-1]:.0f}'


# Label; the cell of drawn cases; that of real machines, told for each of them.
_Tell = Callable[[dict], str]
ROWS: tuple[tuple[str, _Tell | None, _Tell | None], ...] = (
    ('cases (real: terms taken out)', lambda s: str(s['cases']),
     lambda one: str(len([row for row in one['rows'] if row['taken']]))),
    ('right, all kinds', lambda s: _of(s['right']), None),
    ('first of singles, strong / subtle',
     lambda s: _both(_of(s['named_first'].get('strong')), _of(s['named_first'].get('subtle'))),
     _named),
    ('both of a pair / all of three',
     lambda s: _both(_of(s['pairs_both']), _of(s['triples_all'])), None),
    ('something said on a clean recording (real: nothing taken out)',
     lambda s: _of(s['false_alarms']), _anyway),
    ('confident wrong name outside the library: undescribed (described)',
     lambda s: _outside(s, lambda stratum: _of(s['confident_wrong'].get(stratum))), None),
    ('right variables / memory outside: undescribed (described)', _variables, None),
    ('held-out error removed, single / pair',
     lambda s: _both(*(_percent(s['held_out_removed'].get(kind)) for kind in ('single', 'pair'))),
     None),
    ('… outside: undescribed (described)',
     lambda s: _outside(s, lambda stratum: _percent(s['held_out_removed'].get(stratum))), None),
    ('held-out force error, model file → corrected model', None, _force),
    ('held-out made worse by 2 % or more of what could be removed',
     lambda s: _of(s['worse']), None),
    ('harm: held-out error 5 % and 0.2 floors larger (real: 5 %), all cases',
     lambda s: _of(s['harm']), _worse),
    ('claims said with 0.9 to 0.97 that are right (0.97 and more)', _bands, None),
    ('calibration, expected error: as it is / by chance alone (Brier score)',
     lambda s: (f'{_number(s["calibration"]["expected_error"], 3)} / '
                f'{_number(s["calibration"].get("by_chance"), 3)} '
                f'({_number(s["calibration"]["brier"], 3)})'), None),
    ('truth in the set of the leading claim at level 0.9, all cases / with a claim (worst '
     'stratum); causes in a set', lambda s: _sets(s, 'leading'), None),
    ('… in the sets of further claims', lambda s: _sets(s, 'further'), None),
    ('truth inside two deviations', lambda s: _percent(s['parameters']['coverage']), _inside),
    ('time intervals, precision / recall (chance)', _where, None),
    ('onset in mid-recording told, error; told where there is none', _onset, None),
    ('right: begins in the middle / load curve of another form / several recordings',
     lambda s: _conditions(s, 'mid_onset', 'load_shape' if s['source'] == 'own'
                           else 'wrong_load_shape', 'several_recordings'), None),
    ('right: other machines / 250 Hz and less / coarse position / sensor faults',
     lambda s: _conditions(s, 'other_machine', 'low_rate', 'coarse_counts'
                           if s['source'] == 'own' else 'coarse_position', 'sensor_fault'), None),
    ('seconds, median / 95th percentile / worst', _seconds, _time))


def column_of(result: dict) -> dict[str, object]:
    """Title, cells, command and commits of what scores.json or real.json holds."""
    real = 'sets' in result
    cells = []
    for _, drawn, machine in ROWS:
        if real:
            cells.append(_NOTHING if machine is None else _by_set(result, machine))
        else:
            cells.append(_NOTHING if drawn is None else drawn(result))
    return {'title': _TITLES['real' if real else result['source']], 'cells': cells,
            'command': result['command'], 'date': result['date'][:10],
            'commits': result['commits'], 'seed': result.get('seed')}


def as_markdown(columns: Sequence[dict]) -> str:
    """The columns side by side, and under them what printed each."""
    lines = ['| score | ' + ' | '.join(str(one['title']) for one in columns) + ' |',
             '|---' * (len(columns) + 1) + '|']
    for number, (label, *_) in enumerate(ROWS):
        cells = [one['cells'][number] for one in columns]
        if set(cells) != {_NOTHING}:
            lines.append('| ' + ' | '.join([label, *cells]) + ' |')
    lines.append('')
    for one in columns:
        seed = '' if one['seed'] is None else f', seed {one["seed"]}'
        commits = ', '.join(one['commits']) or 'unknown'
        lines.append(f'- {one["title"]}: `{one["command"]}`, {one["date"]}, commit '
                     f'{commits}{seed}')
    return '\n'.join(lines)


def table(folders: Sequence[Path]) -> str:
    """The README's table of what `engb prove` left in these folders.

    Raises:
        InputError: a folder holds no scores, or those of another version.
    """
    columns = []
    for folder in folders:
        path = next((folder / name for name in ('scores.json', 'real.json')
                     if (folder / name).exists()), None)
        if path is None:
            raise InputError(f'--table {folder}: holds no scores.json or real.json; name the '
                             '--out of an earlier engb prove')
        try:
            columns.append(column_of(json.loads(path.read_text('utf8'))))
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(f'{path}: was not written by this version ({error!r}); start engb '
                             'prove again with the same --out, which scores anew') from error
    return as_markdown(columns)
