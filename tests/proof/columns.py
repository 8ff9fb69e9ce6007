# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Textbook regressors: the columns of a torque balance, and of every effect of table 4."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from .nominal import low_pass, moving, Nominal
from .signals import RATE, Signals

__all__ = ['Answer', 'candidates', 'Columns', 'number_columns', 'seen', 'solve', 'travel_of']

Columns = dict[str, list[np.ndarray]]


@dataclass(frozen=True)
class Answer:
    """Effects named, the first first, with probabilities; and the torque it adds to a run."""

    claims: list[tuple[str, float]]
    added: Callable[[Signals], np.ndarray]


def travel_of(run: Signals) -> np.ndarray:
    """Angle [rad] since the last reversal of the motion."""
    sign = np.sign(run.velocity) * moving(run.velocity)
    walked = np.cumsum(np.abs(run.velocity)) / RATE
    held = sign[np.maximum.accumulate(np.where(sign != 0, np.arange(sign.size), 0))]
    turns = np.flatnonzero(np.diff(held, prepend=held[0]))
    since = np.zeros(sign.size)
    since[turns] = walked[turns]
    return walked - np.maximum.accumulate(since)


def _lagged(signal: np.ndarray, constant: float) -> np.ndarray:
    keep = np.exp(-1.0 / (RATE * constant))
    return lfilter([1.0 - keep], [1.0, -keep], signal)


def number_columns(model: Nominal, run: Signals) -> tuple[list[np.ndarray], dict[str, np.ndarray]]:
    """The columns of all linear numbers, and what the other columns are made of."""
    s = run.position if model.contact is None else np.maximum(run.position - model.contact, 0.0)
    touch = np.ones_like(s) if model.contact is None else (s > 0.0) * 1.0
    p = model.load
    load = touch * (p[0] + s * (p[1] + s * (p[2] + s * p[3])))
    slope = touch * (p[1] + s * (2.0 * p[2] + s * 3.0 * p[3]))
    slip = np.clip(run.velocity / model.saturation, -1.0, 1.0)
    friction = (model.coulomb + model.gain * np.abs(load)) * slip
    columns = [run.acceleration, run.velocity, s, s ** 2, s ** 3, slip, np.abs(load) * slip]
    if model.contact is None:
        columns.append(np.ones_like(s))
    return columns, {'load': load, 'slope': slope, 'slip': slip, 'friction': friction}


def candidates(model: Nominal, run: Signals, orders: int) -> Columns:
    """Columns of every effect; variants (`cogging_torque:7`) differ in a nonlinear constant."""
    _, part = number_columns(model, run)
    load, slope, slip, friction = (part[k] for k in ('load', 'slope', 'slip', 'friction'))
    travel, effort = travel_of(run), low_pass(run.effort, RATE)
    found: Columns = {
        'inertia_error': [run.acceleration], 'viscous_friction_error': [run.velocity],
        'coulomb_friction_error': [slip], 'load_stiffness_error': [load],
        'contact_shift': [slope], 'torque_offset': [np.ones_like(load)],
        'load_dependent_friction': [np.abs(load) * slip],
        'torque_saturation': [effort ** 3], 'actuation_lag': [np.gradient(effort) * RATE],
        'drivetrain_resonance': [np.gradient(np.gradient(run.acceleration)) * RATE ** 2],
        'asymmetric_friction': [np.abs(friction)],
        'nonlinear_viscous_friction': [run.velocity * np.abs(run.velocity)],
        'friction_drift': [friction * run.time / 60.0],
    }
    for order in range(1, orders + 1):
        waves = [np.cos(order * run.position), np.sin(order * run.position)]
        found[f'cogging_torque:{order}'] = waves
        found[f'torque_ripple:{order}'] = [effort * wave for wave in waves]
    for speed in (1.0, 3.0, 8.0):
        found[f'stribeck_friction:{speed}'] = [friction * np.exp(-(run.velocity / speed) ** 2)]
    for width in (0.03, 0.1, 0.3):
        found[f'presliding_friction:{width}'] = [-friction * np.exp(-travel / width)]
    for gap in (0.1, 0.3, 0.6):
        found[f'backlash:{gap}'] = [-(load + friction) * (travel < gap)]
    for width in (0.7, 2.0):
        found[f'load_hysteresis:{width}'] = [np.abs(load) * slip * (1 - np.exp(-travel / width))]
    for constant in (0.3, 1.0, 3.0):
        found[f'pad_creep:{constant}'] = [load - _lagged(load, constant)]
    if run.disc is not None:
        turning = np.sign(run.disc) * (np.abs(run.disc) > 1.0)
        angle = np.cumsum(run.disc) / RATE
        found['self_energizing'] = [load * turning]
        found['disc_runout'] = [slope * np.cos(angle), slope * np.sin(angle)]
        if run.temperature is not None:
            found['pad_friction_fade'] = [load * turning * (run.temperature - 25.0) / 100.0]
    return found


def seen(columns: list[np.ndarray], run: Signals) -> np.ndarray:
    """Columns as a matrix, filtered as the effort is, in motion, at 50 Hz."""
    move = moving(run.velocity)
    low = low_pass(np.stack(columns, axis=1) * move[:, None], RATE)
    return low[np.flatnonzero(move)[::10]]


def solve(matrix: np.ndarray, target: np.ndarray) -> np.ndarray:
    size = np.sqrt(np.mean(matrix ** 2, axis=0)) + 1e-15
    return np.linalg.lstsq(matrix / size, target, rcond=1e-8)[0] / size
