# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The numbers of a corrected model, fitted anew to other recordings of the machine.

No command of the tool fits given causes to a recording, so this is plain least squares over what
`engb.predict` and `engb.simulate` say, the same causes all the time. A number keeps its sign. How
sure a fit is of a number follows from its own residual and that one's colour, as in
docs/statistics.md ("Noise"); how wrong the formula may be is not in it.
"""
from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

import engb_core as engb

from .nominal import low_pass
from .real_ladder import moving_rows, Prediction
from .signals import RATE, read_signals

__all__ = ['acting', 'changed', 'Descent', 'driven', 'effort_left', 'Fitted', 'Number',
           'numbers_of', 'Piece', 'PLAIN', 'position_left', 'refit', 'UNEVEN']

Left = Callable[[dict], np.ndarray]
# A number may become so many times what it was, or this part of it.
_RANGE = (1e-2, 1e2)
# Sizes beyond which docs/contract.md knows no such number.
_LARGEST = {'load_curvature': 1.0, 'asymmetry': 0.95}
# Samples per period of the band's upper end that a fit takes.
_SAMPLES = 2.5
# A derivative below this part of the largest one is none: the number says nothing here.
_IDLE = 1e-7
_LAGS, _NO_COLOUR = 25, 0.05
# A loop at this rate [Hz] at least hands the recorded effort on; the drive's own may be faster.
_DRIVEN_RATE = 1000.0


@dataclass(frozen=True)
class Number:
    """A number of a model.

    Attributes:
        name: as in the model file.
        effect: the id of the effect whose it is, '' for the machine's own.
        place: keys and indices to it from the top of the model file.
        value: in the corrected model [SI].
        told: the standard deviation that the diagnosis gave it, None where it gave none.
    """

    name: str
    effect: str
    place: tuple[str | int, ...]
    value: float
    told: float | None


@dataclass(frozen=True)
class Piece:
    """A recording or a part of it, from `begin` to `end` [s]."""

    path: Path
    begin: float = -np.inf
    end: float = np.inf


@dataclass(frozen=True)
class Descent:
    """How a fit looks for the least, each number on a logarithmic scale.

    Attributes:
        step: of a derivative.
        both_sides: whether a derivative is taken to both sides.
        rounds: at most.
        ends: part of the numbers or of the sum of squares by which the last step changes them.
    """

    step: float
    both_sides: bool
    rounds: int
    ends: float


PLAIN = Descent(5e-3, False, 12, 1e-5)
# A shaft that sticks makes the driven position uneven, in a valley of what goes for each other.
UNEVEN = Descent(1e-2, True, 30, 1e-6)


@dataclass(frozen=True)
class Fitted:
    """Numbers as a fit found them.

    Attributes:
        values: (k,) [SI].
        deviations: (k,) by the fit's own residual; infinite where the data say nothing of it, or
            only that it lies beyond the end of its range.
        model: with these numbers.
    """

    values: np.ndarray
    deviations: np.ndarray
    model: dict


def numbers_of(model: dict, nominal: dict, claims: list[dict], all_of_file: bool = False,
               ) -> list[Number]:
    """What the tool named or changed: each number of a corrected model that its file has
    otherwise, and each that a claimed effect was told with a deviation.

    Args:
        model: the corrected model's mapping.
        nominal: that of the file which it came from.
        claims: of the diagnosis.
        all_of_file: the file's other numbers that are not 0 as well.
    """
    told = {(claim['effect'], name): entry['std'] for claim in claims
            for name, entry in claim['parameters'].items()}
    by_name = {name: std for (_, name), std in told.items()}
    places: list[tuple[str | int, ...]] = [
        ('motor', 'inertia'), ('motor', 'viscous_friction'), ('friction', 'coulomb'),
        ('friction', 'load_gain')]
    load = model['load_torque']
    places += [('load_torque', 'amplitude')] if load['form'] == 'sinusoid' else [
        ('load_torque', 'coefficients', place) for place in range(len(load['coefficients']))]
    found = []
    for place in places:
        value, before = _at(model, place), _at(nominal, place)
        # A number at 0 stays there: friction does not fall below nothing.
        if value and (all_of_file or abs(value - (before or 0.0)) > 1e-9 * abs(value)):
            name = 'load ' + str(place[-1]) if place[0] == 'load_torque' else str(place[-1])
            found.append(Number(name, '', place, value, by_name.get(str(place[-1]))))
    curvature = _at(model, ('friction', 'load_curvature'))
    if curvature and by_name.get('load_curvature') is not None:
        found.append(Number('load_curvature', '', ('friction', 'load_curvature'), curvature,
                            by_name['load_curvature']))
    for index, setting in enumerate(model['effects']):
        for name, value in setting['parameters'].items():
            std = told.get((setting['effect'], name))
            if value and std is not None:
                found.append(Number(name, setting['effect'],
                                    ('effects', index, 'parameters', name), float(value), std))
    return found


def _at(model: dict, place: tuple[str | int, ...]) -> float | None:
    found = model
    for key in place:
        try:
            found = found[key]
        except (KeyError, IndexError):
            return None
    return float(found)     # type: ignore[arg-type]


def changed(model: dict, numbers: Sequence[Number], values: Sequence[float]) -> dict:
    """The model with these values for these numbers."""
    model = deepcopy(model)
    for number, value in zip(numbers, values, strict=True):
        part = model
        for key in number.place[:-1]:
            part = part[key]
        part[number.place[-1]] = float(value)
    return model


def acting(model: dict, numbers: Sequence[Number], left: Left) -> list[Number]:
    """Those of the numbers that change what is left."""
    first = left(model)
    return [number for number in numbers if not np.array_equal(
        left(changed(model, [number], [(1.0 - PLAIN.step) * number.value])), first)]


def refit(model: dict, numbers: Sequence[Number], left: Left, held: float | None = None,
          descent: Descent = PLAIN) -> Fitted:
    """Fit numbers of a model so that little is left.

    Args:
        model: with the numbers at which the fit begins.
        numbers: that are free.
        left: what a model leaves, (m,), the smaller the better.
        held: how far they are believed beforehand, as a part of their value (None: not at all).
        descent: how it is looked for.
    """
    start = np.array([number.value for number in numbers])
    most = np.array([min(_RANGE[1], _LARGEST.get(number.name, np.inf) / abs(number.value))
                     for number in numbers])

    def at(powers: np.ndarray) -> np.ndarray:
        return left(changed(model, numbers, np.clip(np.exp(powers), _RANGE[0], most) * start))

    first = at(np.zeros(start.size))
    # What is believed counts as much as a value that is off by what is left at the start.
    weight = 0.0 if held is None else float(np.sqrt(np.mean(first ** 2))) / held

    def beside_belief(powers: np.ndarray) -> np.ndarray:
        return np.concatenate([at(powers), weight * powers])

    def derivatives(powers: np.ndarray) -> np.ndarray:
        columns = []
        here = None if descent.both_sides else beside_belief(powers)
        for size, step in _steps(powers, descent):
            below = beside_belief(powers - step) if here is None else here
            columns.append((beside_belief(powers + step) - below)
                           / (size * (2.0 if here is None else 1.0)))
        return np.stack(columns, axis=1)

    found = least_squares(beside_belief, np.zeros(start.size), jac=derivatives,
                          max_nfev=descent.rounds, ftol=descent.ends, xtol=descent.ends)
    ends = np.log(_RANGE[0]), np.log(most)
    # At the end of a range nothing moves: taken a step before it, so that others seem no surer.
    inside = np.clip(found.x, ends[0] + 2.0 * descent.step, ends[1] - 2.0 * descent.step)
    parts = _deviations(found.fun[:first.size], _least_derivatives(at, inside, descent, ends))
    factors = np.clip(np.exp(found.x), _RANGE[0], most)
    # What lies at the end of its range is not found.
    parts[(factors <= _RANGE[0]) | (factors >= most)] = np.inf
    return Fitted(factors * start, parts * np.abs(np.exp(inside) * start),
                  changed(model, numbers, factors * start))


def _steps(powers: np.ndarray, descent: Descent) -> list[tuple[float, np.ndarray]]:
    """Size and vector (k,) of a derivative's step for each number: one that has become small makes
    a step as large as it would have made at the start."""
    sizes = descent.step * np.clip(np.exp(-powers), 1.0, 1.0 / descent.step)
    return list(zip(sizes.tolist(), np.diag(sizes), strict=True))


def _least_derivatives(at: Callable[[np.ndarray], np.ndarray], powers: np.ndarray,
                       descent: Descent, ends: tuple[float, np.ndarray]) -> np.ndarray:
    """Derivatives (m, k) for deviations, each the least of four to both sides: how a motion is
    smoothed hangs on the numbers by jumps, and a step across one seems to say too much."""
    here, columns = at(powers), []
    for size, step in _steps(powers, descent):
        around = [((at(moved) - here) / (times * size)) for times in (1.0, 2.0, -1.0, -2.0)
                  if (ends[0] <= (moved := powers + times * step)).all()
                  and (moved <= ends[1]).all()]
        columns.append(min(around, key=lambda column: float(column @ column),
                           default=np.zeros(here.size)))
    return np.stack(columns, axis=1)


def _deviations(rest: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
    """The numbers' standard deviations (k,), as the logarithms', by what is left (m,) and its
    derivatives (m, k); infinite where these are none."""
    size = np.sqrt(np.sum(jacobian ** 2, axis=0))
    tells = size > _IDLE * max(float(size.max()), 1e-300)
    deviations = np.full(size.size, np.inf)
    if tells.any() and rest.size > size.size:
        columns = jacobian[:, tells] / size[tells]
        inverse = np.linalg.pinv(columns.T @ columns, rcond=1e-10, hermitian=True)
        variance = float(rest @ rest) / (rest.size - size.size) * _colour(rest)
        deviations[tells] = np.sqrt(variance * np.diag(inverse)) / size[tells]
    return deviations


def _colour(residual: np.ndarray) -> float:
    """The sum of the autocorrelation: what coloured residuals cost."""
    centred = residual - residual.mean()
    whole = float(centred @ centred)
    colour = 1.0
    for lag in range(1, min(_LAGS, residual.size // 4) + 1):
        rho = float(centred[lag:] @ centred[:-lag]) / whole if whole > 0.0 else 0.0
        if rho < _NO_COLOUR:
            break
        colour += 2.0 * rho
    return colour


def _recording_for(model: dict, path: Path) -> engb.Recording:
    """What was recorded of the joint that a model is of."""
    return _recording(path, model.get('joint', {}).get('name', 'motor'))


@lru_cache(maxsize=64)
def _recording(path: Path, joint: str) -> engb.Recording:
    return engb.read(path, engb.Model.from_mapping({
        'format': 'engb-model/1', 'joint': {'name': joint},
        'motor': {'inertia': 1.0, 'viscous_friction': 0.0},
        'friction': {'coulomb': 0.0, 'load_gain': 0.0, 'saturation_velocity': 1.0}}))


def effort_left(pieces: Sequence[Piece], band: float) -> Left:
    """What models leave of the recorded effort while the shaft moves, up to `band` [Hz]."""
    every = max(1, round(RATE / (_SAMPLES * band)))
    parts = []
    for path in dict.fromkeys(piece.path for piece in pieces):
        run = read_signals(path)
        inside = np.any([(run.time >= piece.begin) & (run.time < piece.end)
                         for piece in pieces if piece.path == path], axis=0)
        rows = np.flatnonzero(moving_rows(run, band) & inside)[::every]
        parts.append((path, run.time, run.effort, rows))

    def left(model: dict) -> np.ndarray:
        made = engb.Model.from_mapping(model)
        rest = []
        for path, time, effort, rows in parts:
            recording = _recording_for(model, path)
            said = np.interp(time, recording.time, engb.predict(recording, made))
            rest.append(low_pass(effort - said, RATE, band)[rows])
        return np.concatenate(rest)

    return left


def driven(path: Path, model: dict) -> Prediction | None:
    """The recorded effort drives the model, with no loop around it, from the recording's first
    position on, at rest; None where the run leaves all bounds."""
    recording = _recording_for(model, path)
    rate = max(_DRIVEN_RATE, 1.0 / recording.interval)
    alone = engb.Model.from_mapping({**model, 'controller': {
        'proportional': 0.0, 'integral': 0.0, 'derivative': 0.0, 'rate': rate}})
    # Without gains the loop's effort is its feedforward.
    position, _ = engb.simulate(replace(recording, reference=engb.Reference(
        recording.time, recording.position, effort=recording.effort)), alone)
    if not np.isfinite(position).all():
        return None
    return Prediction(recording.time, recording.effort, position)


def position_left(paths: Sequence[Path]) -> Left:
    """What models that the recorded effort drives leave of the recorded position, a hundred times
    a second; ten strokes all along where a run leaves all bounds."""
    def left(model: dict) -> np.ndarray:
        rest = []
        for path in paths:
            recording = _recording_for(model, path)
            every = max(1, round(0.01 / recording.interval))
            said = driven(path, model)
            off = np.full(recording.time.size, 10.0 * np.ptp(recording.position)) \
                if said is None else said.position - recording.position
            rest.append(off[::every])
        return np.concatenate(rest)

    return left
