# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Does a model that was made on one unit hold for another unit of the same machine?

What is missing from a machine's model is missing in each unit of it; how large it is may differ.
So on the held-out recordings of the other unit stand side by side: the file that it came with,
the first unit's corrected model as it is, the same with its numbers fitted to what may be fitted
of the other unit, and the model that the tool makes of the other unit's own recordings.
"""
from __future__ import annotations

from collections.abc import Callable

from .real_numbers import effort_left, numbers_of, Piece, refit
from .real_sets import RealSet

__all__ = ['installed', 'transfer']

# How far the first unit's numbers are believed of the other, as a part of their value.
_UNITS_DIFFER = 0.5


def installed(model: dict, unit: RealSet) -> dict:
    """The model of another unit in this one: its joint's name, and its loop."""
    kept = {key: value for key, value in model.items() if key not in ('controller', 'joint')}
    own = {key: unit.nominal[key] for key in ('controller', 'joint') if key in unit.nominal}
    return {**kept, **own}


def transfer(unit: RealSet, first: RealSet, model: dict, claims: list[dict], own: dict,
             rung: Callable[[str, dict], dict]) -> dict:
    """Judge the corrected model of `first` on another unit.

    Args:
        unit: whose recordings judge.
        first: whose recordings made the model.
        model: the corrected model of `first`.
        claims: of the diagnosis that it comes from.
        own: the corrected model of `unit`.
        rung: gives the errors of a model, under a label, on the recordings of `unit`.

    Returns:
        `of`: the name of `first`; `rungs`; `numbers`: each refitted one on both units.
    """
    moved = installed(model, unit)
    numbers = numbers_of(moved, first.nominal, claims, all_of_file=True)
    fitted = refit(moved, numbers, effort_left([Piece(path) for path in unit.train], unit.band),
                   held=_UNITS_DIFFER)
    rungs = [rung('the file that this unit came with', unit.nominal),
             rung(f'corrected model of {first.name}, its numbers', moved),
             rung(f'corrected model of {first.name}, numbers refitted here', fitted.model),
             rung('corrected model of this unit', own)]
    return {'of': first.name, 'rungs': rungs,
            'numbers': [{'number': number.name, 'effect': number.effect, 'first': number.value,
                         'here': float(value)}
                        for number, value in zip(numbers, fitted.values, strict=True)]}
