# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What an effect that is added to a fit is worth, and how large it is, by linear least squares."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.fit_steps import nominal_value
from engb_core.diagnose.fitted import Fit, Screened, StartColumns
from engb_core.diagnose.hypothesis import Hypothesis
from engb_core.diagnose.objective import Objective
from engb_core.diagnose.optimise.normal_equations import normal_equations

__all__ = ['added', 'columns_with_friction', 'frictionless', 'screened', 'start_columns',
           'start_vector']

Array = NDArray[np.float64]
# Weight, where 1 is that of all data, with which a number is held.
HELD = 1e9


def start_vector(hypothesis: Hypothesis, start: Fit, setting: dict[str, float],
                 sizes: Array | None) -> Array:
    """Return the vector of `hypothesis`, one effect more than `start`, where that effect stands at
    `setting`; `sizes` scale it."""
    last = len(hypothesis.variants) - 1
    sizing = hypothesis.variants[last].sizing
    phase = hypothesis.variants[last].effect.of_kind('phase')
    entries = [entry for entry, place in enumerate(hypothesis.places) if place[0] == last]
    added = []
    for entry in entries:
        parameter = hypothesis.parameter(entry)
        default = parameter.starts[0] if parameter.starts and parameter is not phase else 0.0
        value = setting.get(parameter.name, default)
        if parameter is sizing and parameter.none is None:
            value = nominal_value(hypothesis.model, parameter.name)
        elif parameter is sizing and sizes is not None and not parameter.logarithmic:
            value = parameter.none + (np.hypot(*sizes) if sizes.size == 2 else sizes[0])
        elif parameter is phase and sizes is not None and sizes.size == 2:
            value = np.arctan2(sizes[1], sizes[0])
        added.append(np.log(value) if parameter.logarithmic else float(value))
    low, high = hypothesis.bounds
    vector: Array = np.clip(np.concatenate([start.vector, added]), low, high)
    return vector


def start_columns(objective: Objective, hypothesis: Hypothesis, base: Fit,
                  setting: dict[str, float]) -> Array:
    """Return how the last effect at `setting` changes the filtered effort, per unit of its size:
    (m, 1), or (m, 2) where a phase is free, at phase 0 and a quarter turn on."""
    sizing = hypothesis.variants[-1].sizing
    vector = start_vector(hypothesis, base, setting, None)
    if not hypothesis.variants[-1].scalable:
        # Sized by itself: its whole change, as if it could be scaled.
        return (objective.predict(hypothesis, vector) - base.predicted)[:, None]
    assert sizing.none is not None, 'what is scalable has a size at which it vanishes'
    unit = sizing.starts[0] - sizing.none
    change = objective.predict(hypothesis, vector) - base.predicted
    if not change.any() and sizing.low <= sizing.none - unit <= sizing.high:
        # An effect may act on the other side of none alone.
        unit = -unit
        vector[base.vector.size] = sizing.none + unit
        change = objective.predict(hypothesis, vector) - base.predicted
    columns = [change / unit]
    phases = _phases_of_last(hypothesis)
    if phases:
        vector[phases] += 0.5 * np.pi
        columns.append((objective.predict(hypothesis, vector) - base.predicted) / unit)
    return np.stack(columns, axis=1)


def frictionless(objective: Objective, base: Fit) -> bool:
    """Whether a fit's numbers hold no friction of the motor itself above the noise, as where a
    refit has put that of an effect into others."""
    place = _place_of_coulomb(base.hypothesis)
    return place is not None and bool(base.vector[place] <= objective.problem.noise_floor)


def _place_of_coulomb(hypothesis: Hypothesis) -> int | None:
    return next((place for place, number in enumerate(hypothesis.numbers)
                 if number.name == 'coulomb'), None)


def columns_with_friction(objective: Objective, hypothesis: Hypothesis, base: Fit,
                          setting: dict[str, float]) -> tuple[Array, float]:
    """Return how the last effect at `setting`, as large as it starts, changes the filtered effort
    together with a Coulomb friction that `base` lacks (m, 1), and that size of it."""
    sizing = hypothesis.variants[-1].sizing
    vector = start_vector(hypothesis, base, setting, None)
    place = _place_of_coulomb(hypothesis)
    assert place is not None, 'only what is free can be lacking'
    vector[place] = float(np.std(objective.measured))
    size = 1.0
    if hypothesis.variants[-1].scalable:
        assert sizing.none is not None, 'what is scalable has a size at which it vanishes'
        size = sizing.starts[0] - sizing.none
        vector[base.vector.size] = sizing.starts[0]
    return (objective.predict(hypothesis, vector) - base.predicted)[:, None], size


def screened(objective: Objective, base: Fit, shared: Array, start: StartColumns) -> Screened:
    """Return what a start promises when it is added to a fit, whose numbers have the derivatives
    `shared` (m, n).

    An effect that is its own size acts as its start has it, or, with a smaller size, by a part of
    that: less than none of it is nothing that it could do.
    """
    count = shared.shape[1]
    design = np.concatenate([shared, start.columns], axis=1)
    solution, cost, curvature = added(objective, base, design)
    size = float(solution[count])
    if start.begins_at is not None:
        cost += curvature * min(size, 0.0) ** 2
        return Screened(cost, cost, np.array([start.begins_at]))
    if start.scalable:
        return Screened(cost, cost, solution[count:])
    promised = min(max(size, 0.0), 1.0)
    return Screened(cost + curvature * (promised - size) ** 2,
                    cost + curvature * (1.0 - size) ** 2, np.ones(1))


def added(objective: Objective, base: Fit, design: Array) -> tuple[Array, float, float]:
    """Return sizes (k,) and cost when the columns of `design` (m, k) are added to a fit: those of
    its numbers, held by their priors and where they stand at a bound, and what comes new; and by
    how much the cost rises with the square of another last size, all others following."""
    target = np.where(objective.fitted, base.residual / objective.spread, 0.0)
    gram, right = normal_equations(design, base.residual, objective.weight)
    norm = np.sqrt(np.diag(gram))
    norm[norm == 0.0] = 1.0
    gram /= np.outer(norm, norm)
    count = len(base.hypothesis.numbers)
    ridge = np.zeros(design.shape[1])
    pull = np.zeros(design.shape[1])
    if count:
        centre, spread = base.hypothesis.prior
        ridge[:count] = 1.0 / (spread[:count] * norm[:count]) ** 2
        pull[:count] = (centre[:count] - base.vector[:count]) / spread[:count] ** 2 \
            / norm[:count]
        # A delay that may grow no further must not stand for a lag.
        low, high = (bound[:count] for bound in base.hypothesis.bounds)
        ridge[:count][(base.vector[:count] <= low) | (base.vector[:count] >= high)] = HELD
    right = right / norm + pull
    gram += np.diag(ridge + 1e-12)
    last = np.zeros(right.size)
    last[-1] = 1.0
    solution, response = np.linalg.solve(gram, np.stack([right, last], axis=1)).T
    return (solution / norm, float(target @ target - solution @ right),
            float(norm[-1] ** 2 / response[-1]))


def _phases_of_last(hypothesis: Hypothesis) -> list[int]:
    """Return the places in the vector of the last effect's phase, one for each recording where
    that is found anew in each."""
    count, last = len(hypothesis.numbers), len(hypothesis.variants) - 1
    phase = hypothesis.variants[last].effect.of_kind('phase')
    return [count + entry for entry, (owner, _, _) in enumerate(hypothesis.places)
            if owner == last and hypothesis.parameter(entry) is phase]
