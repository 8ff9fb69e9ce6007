# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Plain methods on the same sealed cases, for comparison; they share nothing with the tool.

- `refit`: the nominal's numbers by linear least squares. It names nothing.
- `bic`: forward selection of up to two effects by the Bayesian information criterion. Effects are
  textbook regressors; effort and regressors go through the same 20 Hz filter. A wrong number is
  one column of its own; any other effect comes with all numbers fitted beside it.
- `sparse`: naive sparse regression on smoothed derivatives, unfiltered (sparse.py).
- `flexible`: a regressor of many random features that names nothing (flexible.py).
- `symbolic`: free symbolic regression of what a refit leaves, where pyoperon is installed
  (symbolic.py).
- `oracle`: knows the true form of what is hidden, and fits the numbers (flexible.py). It reads the
  truth, so it runs after the tool, once the digest has been checked.

Each writes diagnosis.json, corrected.npz (what it predicts of `test`) and nominal.npz, as the
scorer reads them. The name behind a column is the effect whose textbook form it is.
"""
from __future__ import annotations

from collections.abc import Callable
import json
from pathlib import Path
import shutil
import time as clock

import numpy as np

from .columns import Answer, candidates, Columns, number_columns, seen, solve
from .flexible import fitted_oracle, flexible
from .nominal import Nominal, torque_of
from .run import recordings_of
from .sealing import open_truth
from .signals import (
    at_full_speed,
    in_units,
    model_in_units,
    read_nominal,
    read_signals,
    Signals,
)
from .sparse import sparse
from .symbolic import is_there, symbolic

__all__ = ['BASELINES', 'NAMING', 'ORACLE', 'run_baseline', 'run_oracle']

_NUMBERS = ('inertia_error', 'viscous_friction_error', 'coulomb_friction_error',
            'load_stiffness_error', 'contact_shift', 'torque_offset', 'load_dependent_friction')
_MOST = 2


def _refit_only(model: Nominal, run: Signals) -> Answer:
    columns, _ = number_columns(model, run)
    target = seen([run.effort - torque_of(model, run)], run)[:, 0]
    numbers = solve(seen(columns, run), target)
    return Answer([], lambda other: np.stack(number_columns(model, other)[0], axis=1) @ numbers)


def _columns_of(chosen: list[str], model: Nominal, run: Signals, found: Columns
                ) -> list[np.ndarray]:
    """All columns of the chosen: with the model's numbers, unless all of them are numbers."""
    columns = [column for name in chosen if name in found for column in found[name]]
    if all(name in _NUMBERS for name in chosen):
        return columns
    return number_columns(model, run)[0] + [
        column for name in chosen if name not in _NUMBERS and name in found
        for column in found[name]]


def _bic(model: Nominal, run: Signals) -> Answer:
    found = candidates(model, run, 40)
    names, sizes = list(found), [len(columns) for columns in found.values()]
    base = number_columns(model, run)[0]
    everything = seen([run.effort - torque_of(model, run), *base,
                       *(column for columns in found.values() for column in columns)], run)
    target, numbers = everything[:, 0], everything[:, 1:1 + len(base)]
    ends = 1 + len(base) + np.cumsum(sizes)
    of = {name: everything[:, end - size:end]
            for name, size, end in zip(names, sizes, ends, strict=True)}

    def criterion(chosen: list[str]) -> float:
        plain = all(name in _NUMBERS for name in chosen)
        parts = [of[name] for name in chosen if plain or name not in _NUMBERS]
        matrix = np.hstack(parts if plain else [numbers, *parts])
        left = target - matrix @ solve(matrix, target)
        # A constant that was searched for is one more parameter.
        count = matrix.shape[1] + sum(':' in name for name in chosen)
        return target.size * np.log(np.mean(left ** 2)) + count * np.log(target.size)

    chosen: list[str] = []
    claims: list[tuple[str, float]] = []
    best = target.size * np.log(np.mean(target ** 2))
    while len(chosen) < _MOST:
        taken = {name.partition(':')[0] for name in chosen}
        # The numbers are all fitted beside another effect: naming one then means nothing.
        open_names = [name for name in names if name.partition(':')[0] not in taken
                      and not (chosen and name in _NUMBERS and not taken <= set(_NUMBERS))]
        values = [criterion([*chosen, name]) for name in open_names]
        at = int(np.argmin(values))
        if values[at] >= best:
            break
        gain = best - values[at]
        chosen.append(open_names[at])
        claims.append((open_names[at].partition(':')[0], float(1 / (1 + np.exp(-gain / 2)))))
        best = values[at]
    if not chosen:
        return Answer([], lambda other: np.zeros_like(other.time))
    fitted = solve(seen(_columns_of(chosen, model, run, found), run), target)

    def added(other: Signals) -> np.ndarray:
        columns = _columns_of(chosen, model, other, candidates(model, other, 40))
        if len(columns) != fitted.size:     # a disc that this recording lacks
            return np.zeros_like(other.time)
        return np.stack(columns, axis=1) @ fitted

    return Answer(claims, added)


BASELINES: dict[str, tuple[str, Callable[[Nominal, Signals], Answer]]] = {
    'refit': ('refit only', _refit_only),
    'bic': ('filtered OMP/BIC', _bic),
    'sparse': ('naive sparse regression', sparse),
    'flexible': ('flexible regressor', flexible),
}
if is_there():
    BASELINES['symbolic'] = ('free symbolic regression', symbolic)
NAMING = ('bic', 'sparse')
ORACLE = ('oracle', 'oracle: true form, numbers fitted')


def run_baseline(name: str, case: Path, results: Path) -> str | None:
    """Run a baseline on a case's folder; returns what failed, or None."""
    return _run(name, case, results, BASELINES[name][1])


def run_oracle(case: Path, truth: Path, results: Path) -> str | None:
    """Run the oracle on a case's folder and its opened truth; returns what failed, or None."""
    _, arrays = open_truth(truth)
    if 'train_1_added' in arrays:   # like the other plain methods it reads the first recording
        arrays = arrays | {'train_added': arrays['train_1_added']}
    if 'train_added' not in arrays:
        return _told(results, 0.0, 'oracle: the truth was sealed before it held what was added')
    train, test = arrays['train_added'], arrays['test_added']
    return _run(ORACLE[0], case, results,
                lambda model, run: fitted_oracle(model, run, train, test))


def _run(name: str, case: Path, results: Path, method: Callable[[Nominal, Signals], Answer]
         ) -> str | None:
    if results.exists():
        shutil.rmtree(results)
    start, failure = clock.monotonic(), None
    try:
        _answer(case, results, method)
    except (ArithmeticError, LookupError, ValueError) as error:
        failure = f'{name}: {type(error).__name__}: {error}'
    return _told(results, clock.monotonic() - start, failure)


def _told(results: Path, seconds: float, failure: str | None) -> str | None:
    results.mkdir(parents=True, exist_ok=True)
    (results / 'run.json').write_text(json.dumps({'seconds': seconds, 'failure': failure}), 'utf8')
    return failure


def _answer(case: Path, results: Path, method: Callable[[Nominal, Signals], Answer]) -> None:
    model = read_nominal(case / 'nominal.yaml')
    train, test = (read_signals(recordings_of(case, part)[0]) for part in ('train', 'test'))
    unit = at_full_speed(train)
    model, train, test = model_in_units(model, unit), in_units(train, unit), in_units(test, unit)
    answer = method(model, train)
    nominal = torque_of(model, test)
    corrected = nominal + answer.added(test)
    results.mkdir(parents=True)
    content = {'effects': [{'effect': effect, 'probability': p, 'parameters': {}}
                           for effect, p in answer.claims],
               'mismatch': {'time': []},
               'verdict': 'explained' if answer.claims else 'consistent'}
    (results / 'diagnosis.json').write_text(json.dumps(content), 'utf8')
    np.savez(results / 'nominal.npz', time=test.time, effort=nominal)
    np.savez(results / 'corrected.npz', time=test.time, effort=corrected)
