# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What is common to all units and what differs between them: a random-effects model.

Each unit u has a true number x_u = μ + d_u with d_u of variance τ²; recording r of it measures
y_ur = x_u + e_ur with variance s_ur² + φ². s is the diagnosis's own standard deviation, φ what
recordings of one unit scatter beyond it. DerSimonian & Laird, Controlled Clinical Trials 7 (1986),
for both levels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engb_core.fleet.rows import Measure

__all__ = ['Pooled', 'UnitValue', 'pool', 'random_effects']

Array = NDArray[np.float64]

# A standard deviation below this share of the typical one is over-confident, not exact.
_LEAST_SPREAD = 0.2


@dataclass(frozen=True)
class UnitValue:
    """A unit's own number with its standard deviation, from `count` recordings.

    `distance` is how far it lies from the other units, in standard deviations of a unit of that
    kind (leaving this one out); None where there are fewer than three units.
    """

    unit: str
    value: float
    std: float
    count: int
    distance: float | None


@dataclass(frozen=True)
class Pooled:
    """One quantity over the fleet.

    Attributes:
        quantity, unit_of_measure: what it is.
        mean, std: the common value and how well it is known.
        between: τ, the spread between units.
        within: φ, the spread between recordings of one unit beyond their own uncertainty.
        heterogeneous: the units differ (Cochran's test at 1 %).
        units: each unit's number, in order of its name.
    """

    quantity: str
    unit_of_measure: str
    mean: float
    std: float
    between: float
    within: float
    heterogeneous: bool
    units: tuple[UnitValue, ...]


def random_effects(value: ArrayLike, std: ArrayLike) -> tuple[float, float, float, float]:
    """Pool independent estimates.

    Args:
        value, std: (k,) estimates and their standard deviations (above 0).

    Returns:
        Mean, its standard deviation, the spread τ between the true values, and the probability
        of such differences if τ were 0 (1 for a single value).
    """
    value, variance = np.asarray(value, float), np.asarray(std, float) ** 2
    weight = 1.0 / variance
    mean = float(np.sum(weight * value) / weight.sum())
    if value.size < 2:
        return mean, float(np.sqrt(variance[0])), 0.0, 1.0
    from scipy.stats import chi2
    heterogeneity = float(np.sum(weight * (value - mean) ** 2))
    free = value.size - 1
    scale = weight.sum() - np.sum(weight ** 2) / weight.sum()
    between = max(0.0, (heterogeneity - free) / scale) if scale > 0 else 0.0
    weight = 1.0 / (variance + between)
    mean = float(np.sum(weight * value) / weight.sum())
    return (mean, float(np.sqrt(1.0 / weight.sum())), float(np.sqrt(between)),
            float(chi2.sf(heterogeneity, free)))


def pool(measures: Sequence[Measure]) -> list[Pooled]:
    """Pool every quantity that at least two units have, in the order in which they come."""
    found = []
    for quantity in dict.fromkeys(measure.quantity for measure in measures):
        chosen = [measure for measure in measures if measure.quantity == quantity]
        if len({measure.unit for measure in chosen}) >= 2:
            found.append(_pool_one(quantity, chosen))
    return found


def _pool_one(quantity: str, measures: list[Measure]) -> Pooled:
    names = sorted({measure.unit for measure in measures})
    value = np.array([measure.value for measure in measures])
    owner = np.array([names.index(measure.unit) for measure in measures])
    std = _own_spread(measures, value)
    within = _within(value, std, owner)
    units = []
    for index, name in enumerate(names):
        mine = owner == index
        mean, spread, _, _ = random_effects(value[mine], np.hypot(std[mine], within))
        # Of the scatter between its recordings a mean over them keeps the part 1/√n.
        units.append((name, mean, spread, int(mine.sum())))
    means = np.array([entry[1] for entry in units])
    spreads = np.array([entry[2] for entry in units])
    mean, spread, between, chance = random_effects(means, spreads)
    return Pooled(
        quantity, measures[0].unit_of_measure, mean, spread, between, within, chance < 0.01,
        tuple(UnitValue(*entry, distance=_distance(means, spreads, index))
              for index, entry in enumerate(units)))


def _own_spread(measures: list[Measure], value: Array) -> Array:
    """Return standard deviations (k,), filled in where a diagnosis gave none."""
    given = np.array([np.nan if measure.std is None else measure.std for measure in measures])
    known = given[np.isfinite(given)]
    usual = float(np.median(known)) if known.size else 0.0
    if usual <= 0:
        usual = max(0.05 * float(np.median(np.abs(value))), 1e-12)
    return np.maximum(np.where(np.isfinite(given), given, usual), _LEAST_SPREAD * usual)


def _within(value: Array, std: Array, owner: NDArray[np.int_]) -> float:
    """Return the spread between recordings of one unit beyond their own, over all units."""
    excess, free = 0.0, 0
    for index in np.unique(owner):
        mine = owner == index
        if mine.sum() > 1:
            excess += float(np.sum((value[mine] - value[mine].mean()) ** 2)
                            - np.sum(std[mine] ** 2) * (1 - 1 / mine.sum()))
            free += int(mine.sum()) - 1
    return float(np.sqrt(max(0.0, excess / free))) if free else 0.0


def _distance(means: Array, spreads: Array, index: int) -> float | None:
    """Return how far a unit lies from the others, in its and their standard deviations."""
    if means.size < 3:
        return None
    others = np.arange(means.size) != index
    mean, spread, between, _ = random_effects(means[others], spreads[others])
    # Few others tell little of τ: their own range is the least that a unit may differ by.
    between = max(between, float(np.std(means[others], ddof=1)) if others.sum() > 1 else 0.0)
    return float((means[index] - mean) / np.sqrt(spreads[index] ** 2 + spread ** 2 + between ** 2))
