# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which units a recording is in, by what its model file says: a choice between stated readings.

A reading says what one multiplies position, time and effort with. Under it the recorded effort is

    factor · effort = g_J·J·a + g_B·B·ω + g_F·friction + g_L·(load and all else) + offset + rest

with the file's own torques at the motion as it is read. How well a reading fits is told by

- the rest: its size counts four times a stroke, as what a file lacks does the same while a motion
  starts, goes on, stops and turns back; a tenth of the effort is missed by any formula, and less
  isn't better,
- the factors g of the file's numbers: two of three are right within exp(SPREAD), and one in fifty
  is no number of this machine at all, whatever it is,
- what is free instead: the load's curve, or all but the inertia, if the file has them wrong
  altogether; each column costs half the logarithm of their number (BIC),
- how often people take the unit: PRIORS.

No single number tells degrees from radians. But that inertia, friction and load all of them are
off by just what degrees make of them is as rare as its parts are together, and where the data
tell none of them the readings stay alike: then nothing is said. A reading other than the plain one
is believed where it is LOSS times as probable: who is refused for nothing loses that much more
than who is told a wrong cause.
"""

from __future__ import annotations

from collections.abc import Sequence
import dataclasses
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from engb_core.model import Friction, Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.signals.motion import Motion

__all__ = ['Fit', 'Reading', 'Unit', 'Weigher', 'LOSS', 'PRIORS', 'SI', 'USUAL_SPREAD']

Array = NDArray[np.float64]

# Numbers of model files: spread of the logarithm, part that are none of this machine, and the
# range of the logarithm over which such numbers lie evenly.
SPREAD, NONSENSE, RANGE = 0.5, 0.02, 14.0
# What any formula misses of the effort, rms over rms.
MISSED = 0.1
# The load's curve is none of this machine; nor is anything but the inertia.
FREE_LOAD, FREE_ALL = 0.05, 0.01
# Position, time or effort is in another unit; effort where position is: who converts nothing
# converts neither. A slip of sign. Position that holds whole numbers only is counts.
PRIORS = {'position': 0.01, 'time': 0.01, 'effort': 0.02, 'effort too': 0.3, 'opposite': 0.2}
# Of the efforts in another unit, those whose factor is one of the usual ones; within so much.
USUAL, USUAL_SPREAD = 0.8, 0.15
# The others: any factor of so many octaves (of e).
OTHER_RANGE = 28.0
LOSS = 10.0
# What a stroke tells of the rest counts as so many independent values.
LOOKS = 4
# Speeds below this part of the largest are a standstill between strokes.
STANDS = 0.02
# Bounds of the logarithms of factors, the longest step of them, the most rounds, and a gain that
# ends them.
_FAR, _STEP, _ROUNDS, _ENOUGH = 30.0, 3.0, 60, 1e-4


@dataclass(frozen=True)
class Unit:
    """What one multiplies with to get SI units, what the numbers then are ('' for SI), and the
    logarithm of how often people take it."""

    factor: float
    name: str
    log_prior: float = 0.0


SI = Unit(1.0, '')


@dataclass(frozen=True)
class Reading:
    """Units of position and time; effort's is found."""

    position: Unit
    time: Unit


@dataclass(frozen=True)
class Fit:
    """How one reading fits.

    Attributes:
        reading: what position and time are.
        factor: what effort is multiplied with; 1 where it is read as it stands.
        log_odds: logarithm of its probability, but for what all readings share.
        off: by what factor each of the file's numbers would be wrong, by its name.
        left: rms of what the file leaves of the effort with no number changed but `factor`, over
            the effort's.
    """

    reading: Reading
    factor: float
    log_odds: float
    off: dict[str, float]
    left: float


@dataclass(frozen=True)
class _Shape:
    """Which of the file's torques take part, and which columns are free."""

    parts: tuple[int, ...]
    columns: tuple[int, ...]
    log_prior: float


PARTS = ('inertia', 'viscous friction', 'friction', 'load')
# Columns: 1; x, x², x³; sign, ω, |ω|ω.
_SHAPES = (_Shape((0, 1, 2, 3), (0,), 0.0),
           _Shape((0, 1, 2), (0, 1, 2, 3), math.log(FREE_LOAD)),
           _Shape((0,), (0, 1, 2, 3, 4, 5, 6), math.log(FREE_ALL)))


@dataclass(frozen=True)
class _Problem:
    """Normal equations of one shape: mean products of the file's torques with each other
    (`gram`), with effort (`along`), and of effort (`whole`), without what the columns take."""

    shape: _Shape
    chosen: list[int]
    gram: Array
    along: Array
    whole: float


class Weigher:
    """Weighs the readings of one recorded motion against each other.

    Args:
        motion: as it was recorded.
        model: the file.
        usual: efforts in usual units; the factor's logarithm is near one of theirs.
    """

    def __init__(self, motion: Motion, model: Model, usual: Sequence[Unit]) -> None:
        self._motion, self._model, self._usual = motion, model, usual
        known = motion.known
        self._effort = motion.effort[known]
        self._size = float(np.std(self._effort)) or 1.0
        self._power = float(self._effort @ motion.velocity[known])
        position: Array = motion.position[known]
        position = (position - position.mean()) / (float(np.ptp(position)) or 1.0)
        speed = motion.velocity[known] / (float(np.abs(motion.velocity[known]).max()) or 1.0)
        self._free = np.stack([np.ones(position.size), position, position ** 2, position ** 3,
                               np.tanh(50.0 * speed), speed, np.abs(speed) * speed], 1)
        self._bases = [np.linalg.qr(self._free[:, shape.columns])[0] for shape in _SHAPES]
        self._centres = np.log([unit.factor for unit in usual])
        way = np.sign(speed[np.abs(speed) > STANDS])
        self._count = LOOKS * (1 + int(np.count_nonzero(np.diff(way))))

    def weigh(self, reading: Reading, other_effort: bool) -> list[Fit]:
        """Return how a reading fits with effort as it stands; and with it in another unit."""
        parts = self._parts(reading)
        if not np.isfinite(parts).all():
            return []
        problems = self._problems(parts)
        prior = reading.position.log_prior + reading.time.log_prior
        fits = [self._best(reading, problems, 0, prior)]
        if other_effort:
            share = 'effort' if reading.position.name == '' else 'effort too'
            prior += math.log(PRIORS[share])
            fits.append(self._best(reading, problems, 1, prior))
            if self._power < 0.0:
                # The motor as recorded brakes all in all, which friction does for it.
                prior += math.log(PRIORS['opposite'])
                fits.append(self._best(reading, problems, -1, prior))
        return fits

    def _parts(self, reading: Reading) -> Array:
        """Return the file's torques (4, n) of the motion as it is read, over effort's size."""
        motion, model = self._motion, self._model
        place, clock = reading.position.factor, reading.time.factor
        motion = dataclasses.replace(
            motion, step=motion.step * clock, time=motion.time * clock,
            position=motion.position * place, velocity=motion.velocity * (place / clock),
            acceleration=motion.acceleration * (place / clock ** 2))
        smooth = dataclasses.replace(model, friction=Friction(
            0.0, 0.0, model.friction.saturation_velocity))
        with np.errstate(all='ignore'):
            whole = effort_of_motion(motion.samples(), motion.step, physics_of(model))
            without = effort_of_motion(motion.samples(), motion.step, physics_of(smooth))
            inertia = model.motor.inertia * motion.acceleration
            viscous = model.motor.viscous_friction * motion.velocity
            parts = np.stack([inertia, viscous, whole - without, without - inertia - viscous])
        return parts[:, motion.known] / self._size

    def _best(self, reading: Reading, problems: list[_Problem], effort: int,
              prior: float) -> Fit:
        """Return the best fit with effort as it stands (0), in another unit (1), or in one of the
        opposite sign (-1)."""
        cost, logs, problem = min(((*self._fit(problem, effort), problem) for problem in problems),
                                  key=lambda one: one[0])
        factor = (-1.0 if effort < 0 else 1.0) * float(np.exp(logs[-1]))
        off = {PARTS[part]: float(np.exp(log))
               for part, log in zip(problem.chosen, logs, strict=False)}
        return Fit(reading, factor, prior - cost, off, _left(problems[0], factor))

    def _problems(self, parts: Array) -> list[_Problem]:
        """Return the normal equations of each shape, of torques (4, n) over effort's size."""
        problems = []
        for shape, basis in zip(_SHAPES, self._bases, strict=True):
            rows = np.concatenate([parts, self._effort[None] / self._size])
            rows = rows - (rows @ basis) @ basis.T
            products = rows @ rows.T / rows.shape[1]
            chosen = [part for part in shape.parts if products[part, part] > 0.0]
            problems.append(_Problem(shape, chosen, products[np.ix_(chosen, chosen)],
                                     products[chosen, -1], float(products[-1, -1])))
        return problems

    def _fit(self, problem: _Problem, effort: int) -> tuple[float, Array]:
        """Return the least cost and the logarithms of the file's factors and of effort's."""
        sign = -1.0 if effort < 0 else 1.0
        logs = self._starts(problem, sign, effort)
        damping = np.full(len(logs), 1e-3)
        value, gradient, curve = self._cost(problem, logs, sign, effort)
        for _ in range(_ROUNDS):
            steep = curve + damping[:, None, None] * np.eye(logs.shape[1])
            step = -np.linalg.solve(steep, gradient[..., None])[..., 0]
            step *= np.minimum(1.0, _STEP / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
            tried = np.clip(logs + step, -_FAR, _FAR)
            new = self._cost(problem, tried, sign, effort)
            better = new[0] < value
            damping = np.clip(np.where(better, damping / 5.0, damping * 5.0), 1e-9, 1e9)
            gain = value - new[0]
            logs = np.where(better[:, None], tried, logs)
            value = np.where(better, new[0], value)
            gradient = np.where(better[:, None], new[1], gradient)
            curve = np.where(better[:, None, None], new[2], curve)
            if not (gain > _ENOUGH).any() and (better | (damping > 1e3)).all():
                break
        best = int(np.argmin(value))
        shape = problem.shape
        extra = 0.5 * (len(shape.columns) - 1) * math.log(self._count) - shape.log_prior
        return float(value[best]) + extra, logs[best]

    def _cost(self, problem: _Problem, logs: Array, sign: float, effort: int,
              ) -> tuple[Array, Array, Array]:
        """Return of each row of logarithms (m, k) the cost, its gradient and a curvature of it
        that is positive definite (of Gauss and Newton)."""
        numbers, unit = logs[:, :-1], logs[:, -1:]
        amount = sign * np.exp(np.clip(numbers - unit, -2.0 * _FAR, 2.0 * _FAR))
        slope = amount @ problem.gram - problem.along
        left = np.maximum(problem.whole + ((slope - problem.along) * amount).sum(axis=1), 0.0)
        weight = 0.5 * self._count / (left + MISSED ** 2)
        value = 0.5 * self._count * np.log(left + MISSED ** 2)
        size = logs.shape[1]
        gradient, curve = np.zeros(logs.shape), np.zeros((*logs.shape, size))
        gradient[:, :-1] = 2.0 * amount * slope
        inner = 2.0 * amount[:, :, None] * problem.gram * amount[:, None, :]
        curve[:, :-1, :-1] = inner
        if effort:
            gradient[:, -1] = -gradient[:, :-1].sum(axis=1)
            curve[:, -1, :-1] = curve[:, :-1, -1] = -inner.sum(axis=1)
            curve[:, -1, -1] = inner.sum(axis=(1, 2))
        gradient *= weight[:, None]
        curve *= weight[:, None, None]
        place = np.arange(size - 1)
        price, steep = _price(numbers)
        value = value + price.sum(axis=1)
        gradient[:, :-1] += steep
        curve[:, place, place] += 1.0 / SPREAD ** 2
        if effort:
            price, steep = self._unit_price(unit[:, 0])
            value = value + price
            gradient[:, -1] += steep
            curve[:, -1, -1] += 1.0 / USUAL_SPREAD ** 2
        else:
            curve[:, -1, -1] = 1.0
        return value, gradient, curve

    def _starts(self, problem: _Problem, sign: float, effort: int) -> Array:
        """Return logarithms to start from (m, parts + 1): no number wrong, and those that fit."""
        gram, along = problem.gram, problem.along
        count = along.size
        right = np.zeros(count)
        both = sign * float(along.sum())
        units = [0.0]
        if effort:
            units += [math.log(unit.factor) for unit in self._usual]
            if both > 0.0:
                units.append(math.log(float(gram.sum()) / both))
        starts = [np.append(right, unit) for unit in units]
        if count:
            scale = np.sqrt(np.diag(gram))
            fitted = _positive(gram / np.outer(scale, scale), sign * along / scale) / scale
            logs = np.clip(np.log(np.maximum(fitted, 1e-300)), -_FAR, _FAR)
            starts.append(np.append(logs, 0.0))
            if effort:
                middle = float(np.median(logs))
                starts.append(np.append(logs - middle, -middle))
        clipped: Array = np.clip(np.array(starts), -_FAR, _FAR)
        return clipped

    def _unit_price(self, log: Array) -> tuple[Array, Array]:
        """Return the cost of factors of effort (m,), and its slopes."""
        beside = (log[:, None] - self._centres) / USUAL_SPREAD
        shares = np.exp(-0.5 * beside ** 2) * (
            USUAL / self._centres.size / (USUAL_SPREAD * math.sqrt(2.0 * math.pi)))
        density = shares.sum(axis=1) + (1.0 - USUAL) / OTHER_RANGE
        return -np.log(density), (shares * beside).sum(axis=1) / USUAL_SPREAD / density


def _left(problem: _Problem, factor: float) -> float:
    """Return the rms of what the file leaves of effort times `factor`, over effort's."""
    ones = np.ones(len(problem.chosen))
    rest = (problem.whole - 2.0 * float(problem.along @ ones) / factor
            + float(ones @ problem.gram @ ones) / factor ** 2)
    return math.sqrt(max(rest, 0.0) / problem.whole) if problem.whole > 0.0 else 1.0


def _price(logs: Array) -> tuple[Array, Array]:
    """Return the costs of numbers that are off by exp(logs), and their slopes."""
    floor = NONSENSE * SPREAD * math.sqrt(2.0 * math.pi) / RANGE
    bell = (1.0 - NONSENSE) * np.exp(-0.5 * (logs / SPREAD) ** 2)
    return -np.log(bell + floor), bell * logs / SPREAD ** 2 / (bell + floor)


def _positive(gram: Array, along: Array) -> Array:
    """Return the amounts, none negative, that fit best, from the normal equations."""
    root = np.linalg.cholesky(gram + 1e-12 * np.eye(along.size))
    amounts: Array = nnls(root.T, np.linalg.solve(root, along))[0]
    return amounts
