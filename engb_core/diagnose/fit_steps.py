# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How a fit steps: what is known of a parameter beforehand, how far a step may go."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.effects.base import Parameter
from engb_core.model import Model

__all__ = ['bounded_step', 'derivative_step', 'largest_step', 'nominal_value', 'secant',
           'weak_prior']

Array = NDArray[np.float64]


def weak_prior(parameter: Parameter) -> tuple[float, float]:
    """Return centre and width of what is known of an effect's parameter beforehand: its order of
    magnitude where it has starts, else nothing."""
    if parameter.kind in ('phase', 'order') or not parameter.starts:
        return 0.0, 1e12
    if parameter.logarithmic:
        logs = np.log(parameter.starts)
        return float(logs.mean()), float(max(np.ptp(logs), 2.0))
    if parameter.none is not None:
        return parameter.none, 1e12
    return float(np.mean(parameter.starts)), float(max(np.ptp(parameter.starts), 0.5))


def bounded_step(gram: Array, right: Array, least: Array, most: Array) -> Array:
    """Return the least-squares step within bounds: what would leave them stays at its bound and
    the others are solved for anew."""
    step = _solved(gram, right)
    fixed = np.zeros(step.size, bool)
    for _ in range(step.size):
        outside = ~fixed & ((step < least) | (step > most))
        if not outside.any():
            break
        step[outside] = np.clip(step, least, most)[outside]
        fixed |= outside
        free = ~fixed
        if not free.any():
            break
        step[free] = _solved(gram[np.ix_(free, free)],
                             right[free] - gram[np.ix_(free, fixed)] @ step[fixed])
    return np.clip(step, least, most)


def _solved(gram: Array, right: Array) -> Array:
    """Return the solution, the shortest of all where the data do not tell entries apart; none
    where a prediction ran away: what it costs says where not to go."""
    try:
        found = np.linalg.solve(gram, right)
    except np.linalg.LinAlgError:
        if not (np.isfinite(gram).all() and np.isfinite(right).all()):
            return np.zeros_like(right)
        found = np.linalg.pinv(gram, hermitian=True) @ right
    return found.astype(np.float64, copy=False)


def secant(design: Array, step: Array, change: Array, weight: Array) -> Array:
    """Return derivatives (m, size) corrected by what a step really changed (Broyden, Math. Comp.
    19 (1965) 577): a second step with them spares the prediction that each column costs.

    Args:
        design: (m, size) derivatives before the step.
        step: (size,) taken.
        change: (m,) what it changed.
        weight: (size,) how much each entry of the step counts.
    """
    direction = weight * step
    length = float(direction @ step)
    if length <= 0.0:
        return design
    return design + np.outer(change - design @ step, direction / length)


def derivative_step(parameter: Parameter, value: float) -> float:
    """Return the step of a difference quotient."""
    if parameter.logarithmic:
        return 1e-5 if parameter.kind == 'order' else 1e-3
    return 1e-4 * max(abs(value), abs(parameter.starts[0]) if parameter.starts else 1.0, 1e-3)


def largest_step(parameter: Parameter) -> tuple[float, float]:
    """Return how far one iteration may move a parameter, down and up."""
    if parameter.kind == 'order':
        return -0.01, 0.01
    if parameter.logarithmic:
        return -1.2, 1.2
    if parameter.kind in ('phase', 'exponent'):
        return -0.6, 0.6
    return -np.inf, np.inf


def nominal_value(model: Model, name: str) -> float:
    """Return the model file's value of a motor or friction number. KeyError: none of that name."""
    for section in (model.motor, model.friction):
        if hasattr(section, name):
            value: float = getattr(section, name)
            return value
    raise KeyError(name)


