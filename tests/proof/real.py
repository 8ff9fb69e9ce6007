# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Take one term out of the best model of a real machine: does the tool name just that term?

`engb prove --real DIR` calls this. For each set in DIR the tool corrects the nominal
model (as a separate process, as all that follows); its corrected model is the best one. Then one
term at a time is taken out of it, and the tool is handed what is left, with the other numbers as
they were, and refitted to hide the gap. What it says of the best model itself, nothing taken out,
is what it would say anyway: a real machine holds more than any model.
"""
from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import datetime, UTC
from functools import partial
import json
from pathlib import Path
import shutil
import tempfile
import time

import numpy as np
import yaml

from engb_core.errors import InputError

from .readme_table import as_markdown, column_of
from .real_ladder import (
    CORRECTED,
    force_error,
    moving_error,
    plain_rungs,
    position_error,
    Prediction,
)
from .real_page import real_page
from .real_sets import RealSet, sets_in, with_loop
from .real_terms import hidden_by_refit, Term, terms_of, without_descriptions
from .run import call, commit, commits_in
from .signals import read_signals

__all__ = ['as_text', 'judged', 'prove_real']

_FEW = 3        # recordings on which a refit hides what was taken out
Say = Callable[[str], None]


@dataclass(frozen=True)
class _Diagnosis:
    """What one run of the tool gave."""

    claims: list[dict]
    held_out: list[dict]
    seconds: float
    model: dict


def prove_real(folder: Path, out: Path, jobs: int, again: bool, command: str, progress: Say
               ) -> dict:
    """Run the test on every set below `folder`; writes real.json and index.html into `out`.

    Raises:
        InputError: no such folder, no set in it, or the tool gave no diagnosis.
    """
    begin = time.monotonic()
    found = sets_in(folder)
    if again:
        shutil.rmtree(out / 'real', ignore_errors=True)
    out.mkdir(parents=True, exist_ok=True)
    result = {'date': datetime.now(UTC).isoformat(timespec='seconds'), 'command': command,
              'sets': [_prove_set(one, out / 'real' / one.name, jobs, progress) for one in found]}
    result['wall_seconds'] = time.monotonic() - begin
    result['commits'] = commits_in(out / 'real')
    (out / 'real.json').write_text(json.dumps(result, indent=1), 'utf8')
    (out / 'column.md').write_text(as_markdown([column_of(result)]) + '\n', 'utf8')
    real_page(result).write(out / 'index.html')
    return result


def _prove_set(one: RealSet, at: Path, jobs: int, progress: Say) -> dict:
    progress(f'{one.name}: the best model')
    first = _diagnosed(one, one.nominal, at / 'best')
    best = first.model
    terms = terms_of(best)
    few = one.train[::max(1, len(one.train) // _FEW)][:_FEW]
    tasks: list[tuple[Term | None, bool, dict]] = [(None, False, best)]
    whole = _predicted(one, best, few, jobs)
    for term in terms:
        progress(f'{one.name}: without {term.text}')
        left = term.removed(best)
        gap = [a.effort - b.effort for a, b in zip(whole, _predicted(one, left, few, jobs),
                                                   strict=True)]
        runs = [(run := read_signals(path), np.interp(run.time, said.time, torque))
                for path, said, torque in zip(few, whole, gap, strict=True)]
        tasks += [(term, False, left), (term, True, hidden_by_refit(left, term, runs))]

    def done(task: tuple[Term | None, bool, dict]) -> _Diagnosis:
        term, refitted, model = task
        name = 'nothing' if term is None else term.effect + ('_refitted' if refitted else '')
        said = _diagnosed(one, model, at / name)
        progress(f'{one.name}: {name} done')
        return said

    with ThreadPoolExecutor(jobs) as pool:
        answers = list(pool.map(done, tasks))
    control = answers[0]
    least = _rms(control.held_out, 'rms_before')
    rows = [_row(task, said, control, least) for task, said in zip(tasks, answers, strict=True)]
    progress(f'{one.name}: the held-out ladder')
    return {'name': one.name, 'train': len(one.train), 'holdout': len(one.holdout),
            'nominal_claims': first.claims, 'best_effects': best['effects'],
            'ladder': _ladder(one, first, jobs), 'rows': rows,
            'band': one.band, 'published': [vars(entry) for entry in one.published]}


def judged(term: str, claims: list[str], anyway: list[str]) -> str:
    """What a list of names is worth; `anyway`: what is named with nothing taken out.

    'just it', 'first' (others beside it), 'not first', 'another', 'nothing', or 'cannot tell'
    where the term is named with nothing taken out, too.
    """
    if term in anyway:
        return 'cannot tell' if term in claims else 'another'
    new = [name for name in claims if name not in anyway]
    if not new:
        return 'nothing'
    if term not in new:
        return 'another'
    if len(new) == 1:
        return 'just it'
    return 'first' if new[0] == term else 'not first'


def _row(task: tuple[Term | None, bool, dict], said: _Diagnosis, control: _Diagnosis, least: float
         ) -> dict:
    term, refitted, _ = task
    before, after = (_rms(said.held_out, key) for key in ('rms_before', 'rms_after'))
    names = [claim['effect'] for claim in said.claims]
    row = {'taken': None if term is None else term.effect,
           'text': 'nothing' if term is None else term.text, 'refitted': refitted,
           'claims': [(claim['effect'], claim['probability']) for claim in said.claims],
           'times_best': before / least, 'after_times_best': after / least,
           'seconds': said.seconds, 'verdict': None, 'value': None, 'said': None, 'std': None,
           'parameter': None}
    if term is None:
        return row
    row['verdict'] = judged(term.effect, names, [claim['effect'] for claim in control.claims])
    claim = next((claim for claim in said.claims if claim['effect'] == term.effect), None)
    if term.parameter is not None:
        row |= {'parameter': term.parameter, 'value': term.taken}
        if claim is not None and term.parameter in claim['parameters']:
            got = claim['parameters'][term.parameter]
            row |= {'said': got['value'], 'std': got['std']}
    return row


def _rms(held_out: list[dict], key: str) -> float:
    values = [entry[key] for entry in held_out if entry['quantity'] == 'effort']
    return float(np.sqrt(np.mean(np.square(values))))


def _diagnosed(one: RealSet, model: dict, at: Path) -> _Diagnosis:
    """Run the tool, unless an earlier start did; `at` keeps what it wrote."""
    if not (at / 'run.json').exists():
        at.mkdir(parents=True, exist_ok=True)
        (at / 'nominal.yaml').write_text(yaml.safe_dump(model, sort_keys=False), 'utf8')
        start = time.monotonic()
        failure = call(['diagnose', *map(_absolute, one.train), '--model',
                        _absolute(at / 'nominal.yaml'), '--holdout', *map(_absolute, one.holdout),
                        '--out', _absolute(at)])
        if failure is not None:
            raise InputError(f'{one.name}: {failure}')
        (at / 'run.json').write_text(json.dumps(
            {'seconds': time.monotonic() - start, 'commit': commit()}), 'utf8')
    content = json.loads((at / 'diagnosis.json').read_text('utf8'))
    seconds = json.loads((at / 'run.json').read_text('utf8'))['seconds']
    claims = sorted(content['effects'], key=lambda claim: -claim['share'])
    return _Diagnosis(claims, content['fit']['held_out'], seconds,
                      yaml.safe_load((at / 'model.yaml').read_text('utf8')))


def _absolute(path: Path) -> str:
    return str(path.resolve())


def _predicted(one: RealSet, model: dict, recordings: tuple[Path, ...], jobs: int
               ) -> list[Prediction]:
    """What the tool says of some recordings; a loop that it cannot simulate is left out."""
    def said(path: Path) -> Prediction:
        with tempfile.TemporaryDirectory() as scratch:
            file, out = Path(scratch) / 'model.yaml', Path(scratch) / 'out.npz'
            file.write_text(yaml.safe_dump(with_loop(one, model, path), sort_keys=False), 'utf8')
            failure = call(['predict', _absolute(path), '--model', str(file), '--out', str(out)])
            if failure is not None:
                raise InputError(f'{one.name}: {failure}')
            with np.load(out) as data:
                return Prediction(data['time'], data['effort'],
                                  data['position'] if 'position' in data.files else None)

    with ThreadPoolExecutor(jobs) as pool:
        return list(pool.map(said, recordings))


def _ladder(one: RealSet, first: _Diagnosis, jobs: int) -> list[dict]:
    # The tool's predictions are processes of their own: not for many recordings to fit.
    parts = {'holdout': one.holdout}
    if len(one.train) <= _FEW:
        parts['train'] = one.train
    models = [('nominal', one.nominal),
              ('named effects only', without_descriptions(first.model)),
              (CORRECTED, first.model)]
    tool = [_rung(label, parts, {part: _predicted(one, model, parts[part], jobs)
                                 for part in parts}, one.band) for label, model in models]
    parts['train'] = one.train
    fitted = plain_rungs(one.nominal, one.train)
    plain = {name: _rung(label, parts, {part: [fitted[name](path) for path in parts[part]]
                                        for part in parts}, one.band)
             for name, label in (('refitted', 'nominal refitted'),
                                 ('offset', 'nominal refitted, with an offset'),
                                 ('flexible', 'flexible regressor'))}
    return [tool[0], plain['refitted'], plain['offset'], *tool[1:], plain['flexible']]


def _rung(label: str, parts: dict[str, tuple[Path, ...]], said: dict[str, list[Prediction]],
          band: float) -> dict:
    def over(measure: Callable) -> dict[str, float | None]:
        return {part: measure(parts[part], said[part]) if part in said else None
                for part in ('train', 'holdout')}
    return {'rung': label, 'force': over(force_error), 'position': over(position_error),
            'moving': over(partial(moving_error, band=band))}


def as_text(result: dict) -> str:
    """A page of text."""
    lines = []
    for one in result['sets']:
        lines += [f'{one["name"]}: {one["train"]} recordings to fit, {one["holdout"]} held out',
                  f'{"relative force error":46s}{"fit":>9s}{"held out":>10s}{"moving":>10s}'
                  f'   position, held out (moving: held out, up to {one["band"]:.0f} Hz)']
        for rung in one['ladder']:
            force, place = rung['force'], rung['position']['holdout']
            fit = f'{"–":>9s}' if force['train'] is None else f'{100 * force["train"]:7.2f} %'
            lines.append(f'  {rung["rung"]:44s}{fit}{100 * force["holdout"]:8.2f} %'
                         f'{100 * rung["moving"]["holdout"]:8.2f} %'
                         + ('' if place is None else f'   {place:.3g} rms'))
        for entry in one['published']:
            numbers = [entry['train'], entry['holdout']]
            told = [f'{"–":>9s}' if n is None else f'{100 * n:7.2f} %'
                    if entry['measure'] == 'force' else f'   {n:.3g} rms' for n in numbers]
            lines.append(f'  published, {entry["who"]}: {" ".join(told)}')
        lines.append('taken out, and what was named:')
        for row in one['rows']:
            names = ', '.join(f'{name} {p:.2f}' for name, p in row['claims']) or 'nothing'
            kind = ', refitted' if row['refitted'] else ''
            found = '' if row['said'] is None or row['value'] is None else \
                f'; {row["parameter"]} {row["said"]:.4g} (taken: {row["value"]:.4g})'
            held = f'{row["times_best"]:.2f} → {row["after_times_best"]:.2f} times the best'
            lines.append(f'  {row["text"] + kind:44s}{row["verdict"] or "":12s}{names}{found}; '
                         f'held out {held}')
    return '\n'.join(lines)

