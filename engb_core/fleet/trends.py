# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Numbers that change with time or mileage, within units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.fleet.rows import Measure

__all__ = ['Trend', 'find_trends', 'false_discovery']

Array = NDArray[np.float64]

LEAST = 4       # recordings of a unit, and of all together more than their units plus this


@dataclass(frozen=True)
class Trend:
    """A slope that is not chance.

    Attributes:
        quantity, unit_of_measure: what changes.
        over: 'mileage' [km] or 'time' [days].
        unit: of which unit; '' for the slope that all units have in common.
        slope, std: per km or per day.
        chance: the probability of such a slope if nothing changed, before `find_trends`'
            allowance for their number.
        count: recordings.
    """

    quantity: str
    unit_of_measure: str
    over: str
    unit: str
    slope: float
    std: float
    chance: float
    count: int


def find_trends(measures: Sequence[Measure], rate: float = 0.05) -> list[Trend]:
    """Return the trends that remain when one in twenty (`rate`) may be false.

    Each quantity is regressed on time and on mileage: with one slope for all units, each with a
    level of its own, and for each unit by itself. Benjamini & Hochberg (1995) over all of them.
    """
    tried = []
    for quantity in dict.fromkeys(measure.quantity for measure in measures):
        chosen = [measure for measure in measures if measure.quantity == quantity]
        for over in ('mileage', 'time'):
            told = [(measure, measure.mileage if over == 'mileage' else measure.days)
                    for measure in chosen]
            usable = [(measure, place) for measure, place in told if place is not None]
            units = sorted({measure.unit for measure, _ in usable})
            groups = {unit: [entry for entry in usable if entry[0].unit == unit]
                      for unit in units}
            for unit, mine in [*groups.items(), *([('', usable)] if len(units) > 1 else [])]:
                if len(mine) < LEAST:
                    continue
                owner = np.array([units.index(measure.unit) for measure, _ in mine])
                fitted = _slope(np.array([place for _, place in mine], float),
                                np.array([measure.value for measure, _ in mine]), owner)
                if fitted:
                    tried.append(Trend(quantity, mine[0][0].unit_of_measure, over, unit, *fitted,
                                       len(mine)))
    kept = false_discovery(np.array([trend.chance for trend in tried]), rate)
    return sorted((trend for trend, keep in zip(tried, kept, strict=True) if keep),
                  key=lambda trend: trend.chance)


def false_discovery(chance: Array, rate: float) -> NDArray[np.bool_]:
    """Return which of some findings (k,) to keep so that the share `rate` of them is false."""
    order = np.argsort(chance)
    passed = np.flatnonzero(chance[order] <= rate * np.arange(1, chance.size + 1) / max(
        1, chance.size))
    kept = np.zeros(chance.size, bool)
    if passed.size:
        kept[order[:passed[-1] + 1]] = True
    return kept


def _slope(x: Array, y: Array, owner: NDArray[np.int_]) -> tuple[float, float, float] | None:
    """Regress y on x with a level per owner: slope, its standard deviation, chance."""
    from scipy.stats import t as student
    for index in np.unique(owner):
        mine = owner == index
        x = np.where(mine, x - x[mine].mean(), x)
        y = np.where(mine, y - y[mine].mean(), y)
    free = x.size - np.unique(owner).size - 1
    spread = float(x @ x)
    if free < 2 or spread <= 0 or not np.ptp(y) > 0:
        return None
    slope = float(x @ y) / spread
    rest = y - slope * x
    std = float(np.sqrt(rest @ rest / free / spread))
    if std <= 1e-9 * abs(slope):
        return slope, std, 0.0
    return slope, std, float(2 * student.sf(abs(slope) / std, free))
