# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which effect lies on which unit: common causes, single ones, and recordings out of line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from engb_core.fleet.pooling import Pooled
from engb_core.fleet.rows import Entry
from engb_core.signals.spread import robust_deviation

__all__ = ['Cause', 'Outlier', 'causes_of', 'outliers_of']

# An effect is on a unit if it was found in at least this share of the unit's recordings.
PRESENT = 0.5
COMMON = 0.5        # share of the units above which a cause is common
_APPEARED = 2       # recordings without an effect, then with it, from which on it appeared
_FAR = 3.5          # standard deviations from the others
_FEW = 5            # recordings below which nothing is out of line


@dataclass(frozen=True)
class Cause:
    """One effect over the fleet.

    Attributes:
        effect: its name.
        share: unit → share of its recordings in which the effect was found, for every unit.
        probability: unit → mean probability of the effect there.
        on: the units that have it.
        common: whether it is on most units: then it belongs into the model, not to a unit.
        first: unit → key of the recording from which on it is there, where none before had it.
    """

    effect: str
    share: dict[str, float]
    probability: dict[str, float]
    on: tuple[str, ...]
    common: bool
    first: dict[str, str]


@dataclass(frozen=True)
class Outlier:
    """A unit or recording that doesn't fit in: what it is, by how much, and why it counts."""

    unit: str
    key: str        # '' where the whole unit is meant
    quantity: str
    distance: float
    statement: str


def causes_of(entries: Sequence[Entry]) -> list[Cause]:
    """Return every effect that was found anywhere, the most widespread first."""
    good = [entry for entry in entries if entry.good]
    units = sorted({entry.unit for entry in good})
    found = []
    for effect in dict.fromkeys(name for entry in good for name in entry.claimed):
        share, probability, first = {}, {}, {}
        for unit in units:
            mine = [entry for entry in good if entry.unit == unit]
            given = [next((item['probability'] for item in entry.effects
                           if item['effect'] == effect), 0.0) for entry in mine]
            share[unit] = float(np.mean([effect in entry.claimed for entry in mine]))
            probability[unit] = float(np.mean(given))
            since = _first(mine, effect)
            if since is not None:
                first[unit] = since
        on = tuple(unit for unit in units if share[unit] >= PRESENT)
        found.append(Cause(effect, share, probability, on,
                           len(on) >= 2 and len(on) > COMMON * len(units), first))
    return sorted(found, key=lambda cause: (-sum(cause.share.values()), cause.effect))


def _first(entries: Sequence[Entry], effect: str) -> str | None:
    """Return the key of the recording of one unit from which on, in time, it has an effect."""
    dated = sorted((entry.start, entry.key, effect in entry.claimed) for entry in entries
                   if entry.start is not None)
    there = [found for *_, found in dated]
    absent = there.index(True) if True in there else 0
    if absent < _APPEARED or len(there) - absent < _APPEARED or not all(there[absent:]):
        return None
    return dated[absent][1]


def outliers_of(entries: Sequence[Entry], pooled: Sequence[Pooled]) -> list[Outlier]:
    """Return units whose numbers, and recordings whose residuals, lie far from the others."""
    found = []
    for quantity in pooled:
        for unit in quantity.units:
            if unit.distance is not None and abs(unit.distance) > _FAR:
                side = 'above' if unit.distance > 0 else 'below'
                found.append(Outlier(
                    unit.unit, '', quantity.quantity, unit.distance,
                    f'{unit.value:.4g} {quantity.unit_of_measure} is {abs(unit.distance):.1f} '
                    f'standard deviations {side} the other units'))
    found.extend(_residuals(entries))
    return sorted(found, key=lambda outlier: -abs(outlier.distance))


def _residuals(entries: Sequence[Entry]) -> list[Outlier]:
    """Return recordings whose corrected model misses far more than that of the others."""
    ratios = []
    for entry in entries:
        fit = entry.held_out()
        if fit and fit.get('noise_floor') and fit['rms_after'] > 0:
            ratios.append((entry, fit['rms_after'] / fit['noise_floor']))
    if len(ratios) < _FEW:
        return []
    logs = np.log([ratio for _, ratio in ratios])
    middle = float(np.median(logs))
    # At least 10 %: recordings that are all alike make no other an outlier by a hair.
    spread = max(robust_deviation(logs - middle), 0.1)
    return [Outlier(entry.unit, entry.key, 'residual', (log - middle) / spread,
                    f'the corrected model still misses by {ratio:.1f} noise floors, usual here '
                    f'are {np.exp(middle):.1f}')
            for (entry, ratio), log in zip(ratios, logs, strict=True)
            if log - middle > _FAR * spread]
