# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How well each kind of model predicts recordings of a real machine: the held-out ladder.

Force error: |recorded - predicted| / |recorded|, both decimated to 100 Hz, 50 samples cut at each
end (as the EMPS benchmark does); recordings below 200 Hz are brought to 100 Hz and low-passed at
10 Hz. Moving error: the same ratio while the shaft moves, both low-passed to the band of the
machine, without the first and last 0.3 s. Position error: rms of recorded minus simulated closed
loop, or of a model that the recorded effort drives.
"""
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import decimate

from .flexible import random_features
from .nominal import low_pass
from .signals import RATE, read_samples, read_signals, Signals

__all__ = ['CORRECTED', 'force_error', 'moving_error', 'moving_rows', 'plain_rungs',
           'PlainRung', 'position_error', 'Prediction']

CORRECTED = 'the tool\'s corrected model'
_CUT = 50
_PENALTY = 0.03
_SPEED = 0.02
# The shaft moves above this part of a recording's highest speed; filters settle in so long [s].
_MOVES = 0.02
_SETTLES = 0.3


@dataclass(frozen=True)
class Prediction:
    """What a model says of one recording: time [s], effort; position where the loop was run."""

    time: np.ndarray
    effort: np.ndarray
    position: np.ndarray | None


def force_error(recordings: Sequence[Path], predictions: Sequence[Prediction]) -> float:
    """Relative error over all recordings together."""
    wrong = whole = 0.0
    for path, said in zip(recordings, predictions, strict=True):
        samples = read_samples(path)
        effort, other = _at_100_hertz(samples.time, samples.effort,
                                      np.interp(samples.time, said.time, said.effort))
        wrong += float(np.sum((effort - other) ** 2))
        whole += float(np.sum(effort ** 2))
    return float(np.sqrt(wrong / whole))


def moving_error(recordings: Sequence[Path], predictions: Sequence[Prediction], band: float
                 ) -> float:
    """Relative error over all recordings together while the shaft moves, up to `band` [Hz]."""
    wrong = whole = 0.0
    for path, said in zip(recordings, predictions, strict=True):
        run = read_signals(path)
        effort, other, velocity = (low_pass(signal, RATE, band) for signal in (
            run.effort, np.interp(run.time, said.time, said.effort), run.velocity))
        rows = _moving(run, velocity)
        wrong += float(np.sum((effort - other)[rows] ** 2))
        whole += float(np.sum(effort[rows] ** 2))
    return float(np.sqrt(wrong / whole))


def moving_rows(run: Signals, band: float) -> np.ndarray:
    """Where the shaft moves and filters up to `band` [Hz] have settled, (n,)."""
    return _moving(run, low_pass(run.velocity, RATE, band))


def _moving(run: Signals, velocity: np.ndarray) -> np.ndarray:
    return ((np.abs(velocity) > _MOVES * np.abs(velocity).max()) & (run.time > _SETTLES)
            & (run.time < run.time[-1] - _SETTLES))


def position_error(recordings: Sequence[Path], predictions: Sequence[Prediction]) -> float | None:
    """Rms [m or rad] over all recordings together; None where no loop was simulated."""
    wrong: list[np.ndarray] = []
    for path, said in zip(recordings, predictions, strict=True):
        if said.position is None:
            return None
        samples = read_samples(path)
        wrong.append(samples.position - np.interp(samples.time, said.time, said.position))
    return float(np.sqrt(np.mean(np.concatenate(wrong) ** 2)))


def _at_100_hertz(time: np.ndarray, *signals: np.ndarray) -> list[np.ndarray]:
    rate = 1.0 / float(np.median(np.diff(time)))
    slow = rate < 200.0
    whole = 100.0 if slow else 100.0 * round(rate / 100.0)
    grid = np.arange(0.0, time[-1], 1.0 / whole)
    even = [np.interp(grid, time, signal) for signal in signals]
    if slow:
        even = [low_pass(signal, whole, 10.0) for signal in even]
    else:
        even = [decimate(signal, int(whole / 100.0), zero_phase=True) for signal in even]
    return [signal[_CUT:-_CUT] for signal in even]


@dataclass(frozen=True)
class PlainRung:
    """A plain model: what it says of a recording, and, where it is one, as a model file's mapping.
    """

    predicted: Callable[[Path], Prediction]
    model: dict | None


def plain_rungs(nominal: dict, train: Sequence[Path]) -> dict[str, PlainRung]:
    """Fit plain models to the effort of `train`, by name.

    `refitted`: the nominal's numbers; `offset`: and a constant; `flexible`: and random features.
    """
    runs = [read_signals(path) for path in train]
    speed = max(float(np.abs(run.velocity).max()) for run in runs)
    slow = min(1.0 / float(np.median(np.diff(read_samples(path).time))) for path in train) < 200.0
    inputs = np.concatenate([_inputs(run, speed) for run in runs])
    middle, size = inputs.mean(axis=0), inputs.std(axis=0) + 1e-12

    def fitted(columns: np.ndarray) -> np.ndarray:
        return low_pass(columns, RATE, 10.0 if slow else 40.0)[::5]     # the measure's band

    def numbers_of(run: Signals) -> np.ndarray:
        slip = np.clip(run.velocity / nominal['friction']['saturation_velocity'], -1.0, 1.0)
        rows = [run.acceleration, run.velocity, slip]
        if nominal['load_torque']['form'] == 'sinusoid':
            rows += [np.sin(run.position), np.cos(run.position)]
        return np.stack(rows, axis=1)

    def with_offset(run: Signals) -> np.ndarray:
        return np.hstack([numbers_of(run), np.ones((run.time.size, 1))])

    def all_of(run: Signals) -> np.ndarray:
        return np.hstack([with_offset(run), random_features(_inputs(run, speed), middle, size)])

    target = np.concatenate([fitted(run.effort) for run in runs])
    rungs = {}
    for name, columns, free in (('refitted', numbers_of, None), ('offset', with_offset, None),
                                ('flexible', all_of, with_offset(runs[0]).shape[1])):
        matrix = np.concatenate([fitted(columns(run)) for run in runs])
        solution = _solved(matrix, target, free)
        rungs[name] = PlainRung(_predicting(columns, solution, slow),
                                _as_model(nominal, solution) if free is None else None)
    return rungs


def _as_model(nominal: dict, numbers: np.ndarray) -> dict | None:
    """The file with the numbers of a plain fit; None where they are none that a model may have."""
    inertia, viscous, coulomb, *others = (float(number) for number in numbers)
    if inertia <= 0.0 or viscous < 0.0 or coulomb < 0.0:
        return None
    load = nominal['load_torque']
    if load['form'] == 'sinusoid':
        sine, cosine, *others = others
        load = {**load, 'amplitude': float(np.hypot(sine, cosine)),
                'phase': float(np.arctan2(cosine, sine))}
    elif any(load['coefficients']):
        return None     # the plain fit has no such load
    offset = [{'effect': 'torque_offset', 'parameters': {'offset': one}} for one in others]
    return {**nominal, 'load_torque': load, 'effects': offset,
            'motor': {**nominal['motor'], 'inertia': inertia, 'viscous_friction': viscous},
            'friction': {**nominal['friction'], 'coulomb': coulomb, 'load_gain': 0.0}}


def _predicting(columns: Callable[[Signals], np.ndarray], numbers: np.ndarray, slow: bool
                ) -> Callable[[Path], Prediction]:
    def predicted(path: Path) -> Prediction:
        run = read_signals(path)
        effort = columns(run) @ numbers
        # A slow recording's samples would alias what the 500 Hz grid holds above their rate.
        return Prediction(run.time, low_pass(effort, RATE, 10.0) if slow else effort, None)
    return predicted


def _inputs(run: Signals, speed: float) -> np.ndarray:
    return np.stack([run.position, run.velocity, low_pass(run.acceleration, RATE, 10.0),
                     np.tanh(run.velocity / (_SPEED * speed))], axis=1)


def _solved(matrix: np.ndarray, target: np.ndarray, free: int | None) -> np.ndarray:
    """Least squares; columns from `free` on are held by a ridge."""
    size = np.sqrt(np.mean(matrix ** 2, axis=0)) + 1e-15
    weight = np.full(size.size, 1e-10)
    if free is not None:
        weight[free:] = _PENALTY
    scaled = matrix / size
    normal = scaled.T @ scaled / target.size + np.diag(weight)
    return np.linalg.solve(normal, scaled.T @ target / target.size) / size
