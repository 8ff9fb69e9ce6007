# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Does a machine's recording say again what another one said, as nearly as deviations claim?

The numbers of the corrected model are fitted anew to each recording that may be fitted. Whole
recordings are the folds; where they are few, each is cut into its motions there and back, since
one direction alone tells neither an offset nor an asymmetry.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from .nominal import low_pass
from .real_numbers import acting, effort_left, Fitted, Number, numbers_of, Piece, refit
from .signals import RATE, read_signals

__all__ = ['folds_of', 'spread', 'there_and_back']

# So many recordings are folds enough; fewer are cut, into so many parts at most.
_ENOUGH, _MOST = 4, 12
# The shaft moves above this part of its highest speed.
_MOVES = 0.05
# A part takes at least this long [s].
_SHORTEST = 0.5


def there_and_back(path: Path, band: float) -> list[Piece]:
    """A recording cut where the shaft begins again in the direction in which it began."""
    run = read_signals(path)
    velocity = low_pass(run.velocity, RATE, band)
    moves = np.flatnonzero(np.abs(velocity) > _MOVES * np.abs(velocity).max())
    direction = np.sign(velocity[moves])
    turns = np.flatnonzero((direction[1:] == direction[0]) & (direction[:-1] != direction[0])) + 1
    cuts = [float(run.time[moves[0]])]
    for turn in turns:
        at = float(run.time[moves[turn]])
        if at - cuts[-1] >= _SHORTEST:
            cuts.append(at)
    # What is left behind the last turn is no whole motion, unless it goes back as well.
    behind = direction[run.time[moves] >= cuts[-1]]
    if len(cuts) == 1 or ((behind != direction[0]).any()
                          and run.time[moves[-1]] - cuts[-1] >= _SHORTEST):
        cuts.append(float(run.time[-1]))
    return [Piece(path, begin, end) for begin, end in zip(cuts[:-1], cuts[1:], strict=True)]


def folds_of(recordings: Sequence[Path], band: float) -> tuple[list[list[Piece]], str]:
    """The folds that recordings give, each as pieces, and what they are called."""
    if len(recordings) >= _ENOUGH:
        return [[Piece(path)] for path in recordings], 'recordings'
    pieces = [piece for path in recordings for piece in there_and_back(path, band)]
    parts = min(len(pieces), _MOST)
    joined = [[pieces[place] for place in group]
              for group in np.array_split(np.arange(len(pieces)), parts)]
    return joined, 'motions there and back'


def spread(model: dict, nominal: dict, claims: list[dict], recordings: Sequence[Path],
           band: float) -> dict:
    """How far a machine's numbers lie apart over its recordings.

    Returns:
        `folds`: how many; `kind`: of what; `rows`: for each number its `value` and deviation
        `told` (by the tool, from all recordings), its `refitted` value from all with deviation
        `refitted_std`, `telling`: how many folds tell it from nothing by their own deviation, and
        of these `spread` (their standard deviation), `own` (the root mean square of their own
        deviations), `ratio` of both, and `scatter`, the standard deviation that their scatter
        gives to their weighted `mean`; `values` and `stds` of each fold. `idle`: numbers that
        were told, and change nothing in these recordings.
    """
    folds, kind = folds_of(recordings, band)
    told, left = numbers_of(model, nominal, claims), effort_left(
        [Piece(path) for path in recordings], band)
    numbers = acting(model, told, left)
    idle = [number.name for number in told if number not in numbers]
    if not numbers:
        return {'folds': len(folds), 'kind': kind, 'rows': [], 'idle': idle}
    whole = refit(model, numbers, left)
    fits = [refit(whole.model, _begun(numbers, whole), effort_left(fold, band))
            for fold in folds] if len(folds) > 1 else []
    return {'folds': len(folds), 'kind': kind, 'idle': idle,
            'rows': [_row(number, place, whole, fits) for place, number in enumerate(numbers)]}


def _begun(numbers: Sequence[Number], whole: Fitted) -> list[Number]:
    return [replace(number, value=float(value))
            for number, value in zip(numbers, whole.values, strict=True)]


def _row(number: Number, place: int, whole: Fitted, fits: Sequence[Fitted]) -> dict:
    values = np.array([fit.values[place] for fit in fits])
    stds = np.array([fit.deviations[place] for fit in fits])
    tell = stds < np.abs(values)
    row = {'number': number.name, 'effect': number.effect, 'value': number.value,
           'told': number.told, 'refitted': float(whole.values[place]),
           'refitted_std': _finite(whole.deviations[place]), 'telling': int(tell.sum()),
           'spread': None, 'own': None, 'ratio': None, 'mean': None, 'scatter': None,
           'values': values.tolist(), 'stds': [_finite(std) for std in stds]}
    if tell.sum() < 2:
        return row
    apart = float(np.std(values[tell], ddof=1))
    own = float(np.sqrt(np.mean(stds[tell] ** 2)))
    weight = stds[tell] ** -2.0 / np.sum(stds[tell] ** -2.0)
    mean = float(weight @ values[tell])
    # Each fold's own distance counts, whatever its deviation claims.
    count = int(tell.sum())
    scatter = float(np.sqrt(np.sum((weight * (values[tell] - mean)) ** 2) * count / (count - 1)))
    return row | {'spread': apart, 'own': own, 'ratio': apart / own, 'mean': mean,
                  'scatter': scatter}


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
