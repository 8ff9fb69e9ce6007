# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A flexible model of what is left: how much more there is to explain, and on what it depends.

Tables over one or two coordinates, fitted jointly with the numbers and effects of a fit (by its
derivatives) and judged by cross-validation over stretches of time, so that flexibility alone
gains nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import FORMULA_ERROR, LARGER_PART
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import Run
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square
from engb_core.diagnose.score.stretch_odds import STRETCH
from engb_core.effects.base import (
    ACCELERATION,
    DIRECTION,
    DISC_SPEED,
    LOAD,
    PAD_TEMPERATURE,
    POSITION,
    VELOCITY,
)
from engb_core.effects.unexplained_surface import (
    DIRECTION_CODE,
    MOTOR_ANGLE_CODE,
    NOTHING_CODE,
    SURFACE_VALUES,
)
from engb_core.model import EffectSetting
from engb_core.physics.compiled import compiled
from engb_core.physics.inverse_dynamics import effort_of_motion

__all__ = ['Flexible', 'Table', 'best_table', 'form_left', 'left_out']

Array = NDArray[np.float64]

FOLDS = 5
SMOOTHNESS = (0.3, 3.0, 30.0, 300.0)
# Mean square (noise = 1) that a table must take away of values left out: about as much is but the
# scatter of some thousand values.
LEAST_GAIN = 0.02


@dataclass(frozen=True)
class Axis:
    """A coordinate of a table: name, place in the sample, number of knots."""

    name: str
    code: float
    count: int


_DIRECTION = Axis('direction', DIRECTION_CODE, 2)
_NOTHING = Axis('', NOTHING_CODE, 1)
_TABLES = (
    (Axis('position', float(POSITION), 40), _DIRECTION),
    (Axis('velocity', float(VELOCITY), 28), _NOTHING),
    (Axis('motor_angle', MOTOR_ANGLE_CODE, 16), _DIRECTION),
    (Axis('motor_angle', MOTOR_ANGLE_CODE, 12), Axis('load', float(LOAD), 5)),
    (Axis('load', float(LOAD), 9), Axis('velocity', float(VELOCITY), 9)),
    (Axis('position', float(POSITION), 14), Axis('velocity', float(VELOCITY), 6)),
)
_DISC_TABLES = (
    (Axis('disc_speed', float(DISC_SPEED), 8), Axis('load', float(LOAD), 6)),
)
_WARM_TABLES = (
    (Axis('pad_temperature', float(PAD_TEMPERATURE), 8), Axis('load', float(LOAD), 6)),
)
# Any form of what shows itself over one coordinate, by the coordinate's name.
_FORMS = {
    'position': _TABLES[0], 'velocity': _TABLES[1], 'motor_angle': _TABLES[2],
    'load': (Axis('load', float(LOAD), 12), _DIRECTION),
    'acceleration': (Axis('acceleration', float(ACCELERATION), 28), _NOTHING),
    'disc_speed': _DISC_TABLES[0], 'pad_temperature': _WARM_TABLES[0],
}


@dataclass(frozen=True)
class Table:
    """A table ready to be fitted: axes and ranges."""

    x: Axis
    y: Axis
    x_range: tuple[float, float]
    y_range: tuple[float, float]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(axis.name for axis in (self.x, self.y) if axis.name)

    def setting(self, values: Array) -> EffectSetting:
        """Return the table with its values as an entry of the model file."""
        padded = np.zeros(SURFACE_VALUES)
        padded[:values.size] = values
        parameters = {f'value_{index:02d}': float(value) for index, value in enumerate(padded)
                      if value != 0.0}
        parameters |= {'x_code': self.x.code, 'x_from': self.x_range[0],
                       'x_to': self.x_range[1], 'x_count': float(self.x.count),
                       'y_code': self.y.code, 'y_from': self.y_range[0],
                       'y_to': self.y_range[1], 'y_count': float(self.y.count)}
        return EffectSetting('unexplained_surface', parameters)


@dataclass(frozen=True)
class Flexible:
    """The best table on top of a fit.

    Attributes:
        table: it.
        values: (count,) its torques [N·m].
        numbers: (size,) by how much the fit's vector moves along with it.
        level: cross-validated mean squared residual (noise = 1).
        predicted: (m,) what it adds to the filtered effort.
    """

    table: Table
    values: Array
    numbers: Array
    level: float
    predicted: Array


def best_table(fitter: Fitter, fit: Fit) -> Flexible | None:
    """Return the table that explains most of what a finished fit leaves, None if none does.

    `fit` must have its derivatives (`Fitter.finish`).
    """
    scene = fitter.problem.scene
    tables = list(_TABLES)
    if scene.disc_speed_range is not None:
        tables += _DISC_TABLES
    if scene.temperature_range is not None:
        tables += _WARM_TABLES
    _fill_in_samples(fitter, fit)
    best = None
    for x, y in tables:
        made = _made(fitter.problem.runs, x, y)
        if made is None:
            continue
        found = _fitted(fitter, fit, made)
        if best is None or found.level < best.level:
            best = found
    if best is None or best.level > reduced_chi_square(fit, fitter) - LEAST_GAIN:
        return None
    return best


def form_left(fitter: Fitter, without: Fit, with_it: Fit, coordinate: str) -> float | None:
    """Return the part (0 to 1) of what any form over its own coordinate explains that the formula
    of an effect leaves to be explained by a form over it.

    What else is missing depends on other things, and says little of whether this formula is right.

    Args:
        fitter: of the problem.
        without, with_it: fits without and with the effect.
        coordinate: over which the effect shows itself (`Effect.reveals`).

    Returns:
        the part; None where a form over the coordinate does not say what the effect does.
    """
    if coordinate not in _FORMS:
        return None
    # Derivatives first: whoever predicts fills in other samples.
    fits = [fitter.finished(fit) for fit in (without, with_it)]
    _fill_in_samples(fitter, with_it)
    made = _made(fitter.problem.runs, *_FORMS[coordinate])
    if made is None:
        return None
    folds = _folds(fitter)
    before, after = (_Regression(fitter, fit, made) for fit in fits)
    alone, explained = before.alone(folds), before.best(folds)[0]
    leaves = after.alone(folds)
    if alone - explained < LARGER_PART * max(alone - leaves, FORMULA_ERROR):
        return None
    # Fits are told apart by no less than the formula's error.
    left = max(0.0, leaves - after.best(folds)[0] - FORMULA_ERROR)
    return min(1.0, left / (alone - explained))


def _fill_in_samples(fitter: Fitter, fit: Fit) -> None:
    """Fill in the load, level and direction of each sample under a fit."""
    for index, run in enumerate(fitter.problem.runs):
        effort_of_motion(run.samples, run.motion.step,
                         fit.hypothesis.physics(fit.vector, index))


def _values(run: Run, axis: Axis) -> Array:
    if axis.code == NOTHING_CODE:
        return np.zeros(run.motion.time.size)
    if axis.code == MOTOR_ANGLE_CODE:
        return np.mod(run.motion.position, 2.0 * np.pi)
    return run.samples[:, int(axis.code)]


def _made(runs: tuple[Run, ...], x: Axis, y: Axis) -> Table | None:
    ranges = []
    for axis in (x, y):
        values = np.concatenate([_values(run, axis)[run.comparison.grid] for run in runs])
        if axis.code == DIRECTION:
            ranges.append((-1.0, 1.0))
        elif axis.code == MOTOR_ANGLE_CODE:
            ranges.append((0.0, 2.0 * np.pi))
        else:
            low, high = (float(value) for value in np.quantile(values, [0.002, 0.998]))
            if axis.code != NOTHING_CODE and high - low <= 0.0:
                return None
            ranges.append((low, high))
    return Table(x, y, *ranges)


def _columns(runs: tuple[Run, ...], table: Table) -> Array:
    """Return what each knot adds to the filtered effort, (m, knots)."""
    parts = []
    for run in runs:
        x, along = _knots(_values(run, table.x), table.x_range, table.x.count)
        y, across = _knots(_values(run, table.y), table.y_range, table.y.count)
        comparison = run.comparison
        part = np.zeros((run.measured.size, table.x.count * table.y.count))
        _filtered_table(x, along, y, across, table.x.count, table.y.count, comparison.weight,
                        comparison.taps, comparison.grid, comparison.scale, part)
        parts.append(part)
    return np.concatenate(parts)


@compiled
def _filtered_table(x: NDArray[np.int64], along: Array, y: NDArray[np.int64], across: Array,
                    columns: int, rows: int, weight: Array, taps: Array,
                    grid: NDArray[np.int64], scale: Array, out: Array) -> None:
    reach = taps.size // 2
    for place in range(grid.size):
        centre = grid[place]
        for index in range(max(0, centre - reach), min(x.size, centre + reach + 1)):
            share = taps[index - centre + reach] * weight[index] / scale[place]
            knot = y[index] * columns + x[index]
            out[place, knot] += share * (1.0 - along[index]) * (1.0 - across[index])
            if columns > 1:
                out[place, knot + 1] += share * along[index] * (1.0 - across[index])
            if rows > 1:
                out[place, knot + columns] += share * (1.0 - along[index]) * across[index]
            if columns > 1 and rows > 1:
                out[place, knot + columns + 1] += share * along[index] * across[index]


def _knots(values: Array, span: tuple[float, float], count: int,
           ) -> tuple[NDArray[np.int64], Array]:
    if count < 2:
        return np.zeros(values.size, np.int64), np.zeros(values.size)
    way = np.clip((values - span[0]) / (span[1] - span[0]) * (count - 1), 0.0, count - 1.000001)
    knot = way.astype(np.int64)
    return knot, way - knot


def _fitted(fitter: Fitter, fit: Fit, table: Table) -> Flexible:
    made = _Regression(fitter, fit, table)
    reached, smoothness = made.best(_folds(fitter))
    solution = made.solved(fitter.fitted, smoothness)
    count = made.norm.size
    values = solution[count:]
    return Flexible(table, values, solution[:count] / made.norm, reached, made.columns @ values)


def left_out(fitter: Fitter, fit: Fit, table: Table, labels: NDArray[np.int64]) -> float:
    """Return the mean square (noise = 1) that a table and the numbers beside it leave of values
    with each label (m,) when they are fitted to all others."""
    _fill_in_samples(fitter, fit)
    return _Regression(fitter, fit, table).best(labels)[0]


class _Regression:
    """Least squares of a table's torques, and of how far a fit's numbers move along."""

    def __init__(self, fitter: Fitter, fit: Fit, table: Table) -> None:
        if fit.jacobian is None:
            raise ValueError('a table is fitted beside a finished fit')
        self._fitter = fitter
        self.columns = _columns(fitter.problem.runs, table)
        weight = 1.0 / fitter.spread
        nuisance = fit.jacobian * weight[:, None]
        self.norm = np.sqrt(np.mean(nuisance ** 2, axis=0)) + 1e-300
        self._design = np.concatenate([nuisance / self.norm, self.columns * weight[:, None]],
                                      axis=1)
        self._target = fit.residual * weight
        self._noise = float(np.sum((fitter.sigma * weight) ** 2))
        self._penalty = _penalty(table, self._design.shape[1], self.norm.size, weight)

    def solved(self, seen: NDArray[np.bool_], smoothness: float, size: int | None = None,
               ) -> Array:
        """Return the numbers and torques that fit the rows `seen` (m,) best, the first `size` of
        them alone."""
        return _solve(self._design[:, :size][seen], self._target[seen],
                      smoothness * self._penalty[:size, :size])

    def best(self, labels: NDArray[np.int64]) -> tuple[float, float]:
        """Return the least mean square (noise = 1) of values left out by label, and at which
        smoothness."""
        return min((self._level(labels, smoothness), smoothness) for smoothness in SMOOTHNESS)

    def alone(self, labels: NDArray[np.int64]) -> float:
        """Return the mean square (noise = 1) of values left out by label, of the numbers without
        the table."""
        return min(self._level(labels, smoothness, self.norm.size) for smoothness in SMOOTHNESS)

    def _level(self, labels: NDArray[np.int64], smoothness: float, size: int | None = None,
               ) -> float:
        left = np.empty_like(self._target)
        for label in np.unique(labels):
            out = labels == label
            solution = self.solved(self._fitter.fitted & ~out, smoothness, size)
            left[out] = self._target[out] - self._design[:, :size][out] @ solution
        return float(np.sum(left ** 2)) / self._noise


def _folds(fitter: Fitter) -> NDArray[np.int64]:
    """Return the fold (m,) of each value: stretches of time, or whole recordings where there are
    enough of them, since the next one moves in other ways than the last."""
    runs = fitter.problem.runs
    if len(runs) >= FOLDS:
        parts = [np.full(run.measured.size, index) for index, run in enumerate(runs)]
    else:
        parts = [(run.motion.time[run.comparison.grid] / STRETCH).astype(int) + 3 * index
                 for index, run in enumerate(runs)]
    return np.concatenate(parts) % FOLDS


def _solve(design: Array, target: Array, penalty: Array) -> Array:
    gram = design.T @ design
    solved: Array = np.linalg.solve(gram + penalty, design.T @ target).astype(np.float64)
    return solved


def _penalty(table: Table, size: int, offset: int, weight: Array) -> Array:
    """Return the quadratic penalty: roughness along both axes, and a little on size."""
    scale = float(np.median(weight ** 2))
    matrix = 1e-6 * np.eye(size)
    # Numbers and table can trade against each other far beyond what either has to explain.
    matrix[:offset, :offset] = np.eye(offset) * 0.01 * weight.size
    index = offset + np.arange(table.x.count * table.y.count).reshape(table.y.count,
                                                                      table.x.count)
    lines = [row for row in index if table.x.count > 2] \
        + [column for column in index.T if table.y.count > 2]
    for line in lines:
        for place in range(1, line.size - 1):
            trio = line[place - 1:place + 2]
            bend = np.array([1.0, -2.0, 1.0])
            matrix[np.ix_(trio, trio)] += scale * np.outer(bend, bend)
    size_of_values = 0.05 * weight.size / index.size
    matrix[np.ix_(index.ravel(), index.ravel())] += size_of_values * scale * np.eye(index.size)
    return matrix
