# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The nominal model as the truth side sees it: its torque, its refit, its residual.

The residual is judged low-passed at 20 Hz with standstill masked (|ω| < 0.3 rad/s): errors are
set to zero while the shaft stands, then filtered, then judged where it moves.
"""
from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.signal import butter, sosfiltfilt

__all__ = ['FIT_NAMES', 'load_of', 'Moving', 'Nominal', 'STANDSTILL', 'low_pass', 'moving',
           'refit', 'residual', 'rms', 'torque_of']

STANDSTILL = 0.3
FIT_NAMES = ('inertia', 'viscous', 'p0', 'p1', 'p2', 'p3', 'contact', 'coulomb', 'gain',
             'saturation')


class Moving(Protocol):
    """Anything with a motion on the 1 ms grid."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


@dataclass(frozen=True)
class Nominal:
    """The numbers of a model file; `contact` None means the polynomial holds everywhere.

    Where `turn` is not 0 the load is load[0]·sin(turn·θ) + load[1]·cos(turn·θ): a pendulum.
    """

    inertia: float
    viscous: float
    load: tuple[float, float, float, float]
    contact: float | None
    coulomb: float
    gain: float
    saturation: float
    turn: float = 0.0

    def vector(self) -> np.ndarray:
        """The numbers in the order of FIT_NAMES (contact 0 where there is none)."""
        return np.array([self.inertia, self.viscous, *self.load, self.contact or 0.0,
                         self.coulomb, self.gain, self.saturation])

    def with_vector(self, numbers: np.ndarray) -> Nominal:
        """The same model with other numbers."""
        n = [float(x) for x in numbers]
        return replace(self, inertia=n[0], viscous=n[1], load=(n[2], n[3], n[4], n[5]),
                       contact=None if self.contact is None else n[6], coulomb=n[7], gain=n[8],
                       saturation=n[9])


def low_pass(signal: np.ndarray, rate: float = 1000.0, cutoff: float = 20.0) -> np.ndarray:
    """Zero-phase Butterworth low-pass along the first axis."""
    sos = butter(2, cutoff, fs=rate, output='sos')
    return sosfiltfilt(sos, signal, axis=0)


def moving(velocity: np.ndarray) -> np.ndarray:
    """True where the shaft moves."""
    return np.abs(velocity) > STANDSTILL


def rms(values: np.ndarray) -> float:
    """Root mean square; 0 for nothing."""
    return float(np.sqrt(np.mean(values ** 2))) if values.size else 0.0


def _columns(model: Nominal, position: np.ndarray) -> np.ndarray:
    """What the load's numbers multiply: (4, samples)."""
    if model.turn:
        angle, none = model.turn * position, np.zeros_like(position)
        return np.stack([np.sin(angle), np.cos(angle), none, none])
    s = position if model.contact is None else np.maximum(position - model.contact, 0.0)
    touch = np.ones_like(s) if model.contact is None else (position >= model.contact) * 1.0
    return touch * np.stack([np.ones_like(s), s, s ** 2, s ** 3])


def load_of(model: Nominal, position: np.ndarray) -> np.ndarray:
    """Load torque [N·m] of the model's curve."""
    return np.asarray(model.load) @ _columns(model, position)


def torque_of(model: Nominal, run: Moving) -> np.ndarray:
    """Torque [N·m] that the model says the run's motion needs."""
    load = load_of(model, run.position)
    slip = np.clip(run.velocity / model.saturation, -1.0, 1.0)
    return (model.inertia * run.acceleration + model.viscous * run.velocity + load
            + (model.coulomb + model.gain * np.abs(load)) * slip)


def _jacobian(model: Nominal, run: Moving) -> np.ndarray:
    columns, load = _columns(model, run.position), load_of(model, run.position)
    slip = np.clip(run.velocity / model.saturation, -1.0, 1.0)
    lever = 1.0 + model.gain * np.sign(load) * slip
    p, (one, s, square, _) = model.load, columns
    slope = one * p[1] + s * 2.0 * p[2] + square * 3.0 * p[3]
    size = model.coulomb + model.gain * np.abs(load)
    inside = np.abs(run.velocity) < model.saturation
    rows = [run.acceleration, run.velocity, *(columns * lever), -slope * lever, slip,
            np.abs(load) * slip, -size * slip / model.saturation * inside]
    return np.stack(rows, axis=1)


def residual(model: Nominal, run: Moving, effort: np.ndarray, cutoff: float = 20.0) -> np.ndarray:
    """Low-passed effort minus model, at the samples in motion."""
    move = moving(run.velocity)
    return low_pass(move * (effort - torque_of(model, run)), cutoff=cutoff)[move]


def refit(model: Nominal, run: Moving, effort: np.ndarray, locked: tuple[str, ...] = (),
          extra: np.ndarray | None = None) -> Nominal:
    """Least squares of all numbers but the `locked`, by damped Gauss-Newton.

    `extra` columns (samples, n) are fitted beside them (projected out) and dropped.
    """
    free = [i for i, name in enumerate(FIT_NAMES) if name not in locked]
    fixed = (4, 5, 6) if model.turn else (6,) if model.contact is None else (2,)
    free = [i for i in free if i not in fixed]
    if not free:
        return model
    move = moving(run.velocity)
    keep = np.flatnonzero(move)[::8]
    aside = np.zeros((keep.size, 1))
    if extra is not None:
        aside = np.linalg.qr(low_pass(move[:, None] * extra)[keep])[0]

    def seen(columns: np.ndarray) -> np.ndarray:
        low = low_pass(columns * (move if columns.ndim == 1 else move[:, None]))[keep]
        return low - aside @ (aside.T @ low)

    low = np.array([0.2, 0.0, -1.0, -1.0, -1.0, -1.0, -5.0, 0.0, 0.0, 0.02])
    low[0] *= model.inertia
    best, numbers, damping, worse = model, model.vector(), 1e-6, 0
    error = seen(effort - torque_of(best, run))
    while worse < 5:
        columns = seen(_jacobian(best, run)[:, free])
        size = np.sqrt(np.sum(columns ** 2, axis=0)) + 1e-12
        columns = columns / size
        normal = columns.T @ columns + damping * np.eye(size.size)
        trial = numbers.copy()
        trial[free] += np.linalg.solve(normal, columns.T @ error) / size
        trial = np.maximum(trial, low)
        trial[9] = min(trial[9], 4.0)
        now = seen(effort - torque_of(model.with_vector(trial), run))
        gain = rms(error) - rms(now)
        if gain <= 0.0:
            damping, worse = damping * 30.0 + 1e-5, worse + 1
            continue
        best, numbers, error, damping = model.with_vector(trial), trial, now, damping * 0.2
        if gain < 1e-3 * rms(error):
            break
    return best
