# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Take terms out of the best model of a real machine: does the tool name just those?

`engb prove --real DIR` calls this. For each set in DIR the tool corrects the nominal
model (as a separate process, as all that follows); its corrected model is the best one. Then one
term at a time is taken out of it, and the tool is handed what is left, with the other numbers as
they were, and refitted to hide the gap; with `--pairs` two at a time as well. What it says of the
best model itself, nothing taken out, is what it would say anyway: a real machine holds more than
any model. What it says of the nominal model is held against what an expert expects.

Beside that stands how the numbers of the best model lie apart over the recordings
(real_spread.py), and, where a set holds another unit of a machine, how the first unit's model does
on it (real_transfer.py).
"""
from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import datetime, UTC
from functools import partial
import itertools
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
from .real_numbers import acting, driven, numbers_of, position_left, refit, UNEVEN
from .real_page import real_page
from .real_sets import Expected, RealSet, sets_in, with_loop
from .real_spread import spread
from .real_terms import (
    has_load,
    hidden_by_refit,
    on_the_command,
    Term,
    terms_of,
    without_descriptions,
)
from .real_text import LIKELY
from .real_transfer import transfer
from .run import call, commit, commits_in
from .signals import read_signals

__all__ = ['judged', 'met', 'prove_real']

_FEW = 3        # recordings on which a refit hides what was taken out
# Many recordings on a busy machine take long [s]; one that ends too early ends the whole test.
_PATIENCE = 3600.0
Say = Callable[[str], None]


@dataclass(frozen=True)
class _Diagnosis:
    """What one run of the tool gave."""

    claims: list[dict]
    held_out: list[dict]
    seconds: float
    model: dict
    timing: dict | None = None
    nearest: tuple[str, ...] = ()


# The terms that are taken out, whether the rest is refitted, and the model that is left.
_Task = tuple[tuple[Term, ...], bool, dict]


def prove_real(folder: Path, out: Path, jobs: int, again: bool, command: str, progress: Say,
               pairs: bool = False) -> dict:
    """Run the test on every set below `folder`; writes real.json and index.html into `out`.

    With `pairs` two terms at a time are taken out, too.

    Raises:
        InputError: no such folder, no set in it, or the tool gave no diagnosis.
    """
    begin = time.monotonic()
    found = sets_in(folder)
    if again:
        shutil.rmtree(out / 'real', ignore_errors=True)
    out.mkdir(parents=True, exist_ok=True)
    result = {'date': datetime.now(UTC).isoformat(timespec='seconds'), 'command': command,
              'sets': [_prove_set(one, found, out / 'real', jobs, progress, pairs)
                       for one in found]}
    result['wall_seconds'] = time.monotonic() - begin
    result['commits'] = commits_in(out / 'real')
    (out / 'real.json').write_text(json.dumps(result, indent=1), 'utf8')
    (out / 'column.md').write_text(as_markdown([column_of(result)]) + '\n', 'utf8')
    real_page(result).write(out / 'index.html')
    return result


def _prove_set(one: RealSet, among: list[RealSet], out: Path, jobs: int, progress: Say,
               pairs: bool) -> dict:
    at = out / one.name
    progress(f'{one.name}: the best model')
    first = _diagnosed(one, one.nominal, at / 'best')
    best = first.model
    terms = terms_of(best)
    few = one.train[::max(1, len(one.train) // _FEW)][:_FEW]
    tasks: list[_Task] = [((), False, best)]
    whole = _predicted(one, best, few, jobs)
    for term in terms:
        progress(f'{one.name}: without {term.text}')
        left = term.removed(best)
        gap = [a.effort - b.effort for a, b in zip(whole, _predicted(one, left, few, jobs),
                                                   strict=True)]
        runs = [(run := read_signals(path), np.interp(run.time, said.time, torque))
                for path, said, torque in zip(few, whole, gap, strict=True)]
        tasks += [((term,), False, left), ((term,), True, hidden_by_refit(left, term, runs))]
    if pairs:
        tasks += [((first_of_two, second), False, second.removed(first_of_two.removed(best)))
                  for first_of_two, second in itertools.combinations(terms, 2)]

    def done(task: _Task) -> _Diagnosis:
        name = _folder_of(*task[:2])
        said = _diagnosed(one, task[2], at / name)
        progress(f'{one.name}: {name} done')
        return said

    with ThreadPoolExecutor(jobs) as pool:
        answers = list(pool.map(done, tasks))
    control = answers[0]
    least = _rms(control.held_out, 'rms_before')
    rows = [_row(task, said, control, least) for task, said in zip(tasks, answers, strict=True)]
    progress(f'{one.name}: the held-out ladder')
    ladder = _ladder(one, first, jobs)
    progress(f'{one.name}: its numbers on each recording')
    apart = spread(best, one.nominal, first.claims, one.train, one.band)
    moved = None
    if one.machine_of:
        progress(f'{one.name}: the model of {one.machine_of}')
        moved = _transfer(one, next(other for other in among if other.name == one.machine_of),
                          best, out, jobs)
    return {'name': one.name, 'train': len(one.train), 'holdout': len(one.holdout),
            'nominal_claims': first.claims, 'best_effects': best['effects'],
            'expected': met(one.expected, first.claims, first.timing, first.nearest),
            'ladder': ladder, 'rows': rows, 'spread': apart, 'transfer': moved,
            'band': one.band, 'published': [vars(entry) for entry in one.published]}


def _folder_of(terms: tuple[Term, ...], refitted: bool) -> str:
    """Where the diagnosis of a model without these terms is kept."""
    return ('_and_'.join(term.effect for term in terms) or 'nothing') + (
        '_refitted' if refitted else '')


def judged(terms: list[str], claims: list[str], anyway: list[str]) -> str:
    """What a list of names is worth; `anyway`: what is named with nothing taken out.

    Of one term: 'just it', 'first' (others beside it), 'not first', 'another', 'nothing', or
    'cannot tell' where the term is named with nothing taken out, too. Of two: 'just both', 'both',
    'one of both', 'another', 'nothing', or 'cannot tell'.
    """
    if set(terms) & set(anyway):
        return 'cannot tell' if set(terms) & set(claims) else 'another'
    new = [name for name in claims if name not in anyway]
    if not new:
        return 'nothing'
    named = [name for name in terms if name in new]
    if not named:
        return 'another'
    if len(terms) > 1:
        both = len(named) == len(terms)
        return 'one of both' if not both else 'just both' if len(new) == len(terms) else 'both'
    if len(new) == 1:
        return 'just it'
    return 'first' if new[0] == named[0] else 'not first'


def met(expected: tuple[Expected, ...], claims: list[dict], timing: dict | None = None,
        nearest: Sequence[str] = ()) -> list[dict]:
    """How a machine's claims meet what an expert expects: the surest claim of each expectation,
    and whether its number lies where it should, or the causes that it is told among: those of
    `timing`, or the known effects that are `nearest` to what has no name; last, what is claimed
    beside, at 0.5 and more."""
    found = []
    for one in expected:
        said = max((claim for claim in claims if claim['effect'] in one.names),
                   key=lambda claim: claim['probability'], default=None)
        number = None if said is None or not one.parameter else \
            said['parameters'].get(one.parameter)
        sets = [] if said is not None else [
            causes for causes in ((timing or {}).get('causes', ()), nearest)
            if set(causes) & set(one.names)]
        found.append({
            'names': one.names, 'sure': one.sure,
            'said': None if said is None else said['effect'],
            'probability': 0.0 if said is None else said['probability'],
            'in_set': list(sets[0]) if sets else [],
            'parameter': one.parameter, 'low': one.low, 'high': one.high,
            'value': None if number is None else number['value'],
            'std': None if number is None else number['std'],
            'inside': None if number is None else one.low <= number['value'] <= one.high})
    names = {name for one in expected for name in one.names}
    beside = [(claim['effect'], claim['probability']) for claim in claims
              if claim['effect'] not in names and claim['probability'] >= LIKELY]
    return [*found, {'beside': beside}] if expected else []


def _row(task: _Task, said: _Diagnosis, control: _Diagnosis, least: float) -> dict:
    terms, refitted, _ = task
    before, after = (_rms(said.held_out, key) for key in ('rms_before', 'rms_after'))
    names = [claim['effect'] for claim in said.claims]
    row = {'taken': [term.effect for term in terms], 'folder': _folder_of(terms, refitted),
           'text': ' and '.join(term.text for term in terms) or 'nothing', 'refitted': refitted,
           'claims': [(claim['effect'], claim['probability']) for claim in said.claims],
           'times_best': before / least, 'after_times_best': after / least,
           'seconds': said.seconds, 'verdict': None, 'value': None, 'said': None, 'std': None,
           'parameter': None}
    if not terms:
        return row
    row['verdict'] = judged(row['taken'], names, [claim['effect'] for claim in control.claims])
    if len(terms) > 1:
        return row
    (term,) = terms
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
                        '--out', _absolute(at)], patience=_PATIENCE)
        if failure is not None:
            raise InputError(f'{one.name}: {failure}')
        (at / 'run.json').write_text(json.dumps(
            {'seconds': time.monotonic() - start, 'commit': commit()}), 'utf8')
    content = json.loads((at / 'diagnosis.json').read_text('utf8'))
    seconds = json.loads((at / 'run.json').read_text('utf8'))['seconds']
    claims = sorted(content['effects'], key=lambda claim: -claim['share'])
    return _Diagnosis(claims, content['fit']['held_out'], seconds,
                      yaml.safe_load((at / 'model.yaml').read_text('utf8')),
                      content.get('timing'), tuple(
                          entry['effect'] for entry in
                          (content.get('unexplained') or {}).get('nearest', ())))


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
    named = without_descriptions(first.model)
    free = not on_the_command(first.model)
    models = [('nominal', one.nominal), ('named effects only', named), (CORRECTED, first.model)]
    # A pendulum that swings over its top goes its own way from the smallest difference.
    if free and not has_load(named):
        left = position_left(one.train)
        numbers = acting(named, numbers_of(named, one.nominal, first.claims), left)
        label = f'named effects only, {len(numbers)} numbers fitted driven'
        models.insert(2, (label, refit(named, numbers, left, descent=UNEVEN).model))
    tool = [_rung(label, parts, {part: _predicted(one, model, parts[part], jobs)
                                 for part in parts}, one.band, model if free else None)
            for label, model in models]
    parts['train'] = one.train
    fitted = plain_rungs(one.nominal, one.train)
    plain = {name: _rung(label, parts, {part: [fitted[name].predicted(path)
                                               for path in parts[part]] for part in parts},
                         one.band, fitted[name].model if free else None)
             for name, label in (('refitted', 'nominal refitted'),
                                 ('offset', 'nominal refitted, with an offset'),
                                 ('flexible', 'flexible regressor'))}
    return [tool[0], plain['refitted'], plain['offset'], *tool[1:], plain['flexible']]


def _transfer(unit: RealSet, first: RealSet, own: dict, out: Path, jobs: int) -> dict:
    said = _diagnosed(first, first.nominal, out / first.name / 'best')
    parts = {'holdout': unit.holdout}

    def rung(label: str, model: dict) -> dict:
        return _rung(label, parts, {'holdout': _predicted(unit, model, unit.holdout, jobs)},
                     unit.band, None)

    return transfer(unit, first, said.model, said.claims, own, rung)


def _rung(label: str, parts: dict[str, tuple[Path, ...]], said: dict[str, list[Prediction]],
          band: float, model: dict | None) -> dict:
    """The errors of what was `said` of the recordings, and of `model` (None: of none) driven by
    their effort."""
    def over(measure: Callable) -> dict[str, float | None]:
        return {part: measure(parts[part], said[part]) if part in said else None
                for part in ('train', 'holdout')}

    def alone(paths: Sequence[Path]) -> float | None:
        runs = [None if model is None else driven(path, model) for path in paths]
        return None if None in runs else position_error(paths, runs)

    return {'rung': label, 'force': over(force_error), 'position': over(position_error),
            'moving': over(partial(moving_error, band=band)),
            'driven': {part: alone(parts[part]) if part in parts else None
                       for part in ('train', 'holdout')}}
