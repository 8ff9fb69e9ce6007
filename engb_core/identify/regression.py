# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Joint regression: all numbers of equation (1) at once, both sides through the same kernel.

    g∗u = J·(g″∗θ) + B·(g′∗θ) + g∗[T_L(θ) + (C₀ + C₁·|T_L(θ)|)·sat(ω/ω_s) + T_cog(θ)]

The paper fits load and friction one after the other to halves and differences of resampled data
with J and B taken for granted; here every sample in motion counts once, reversals and pairs that
don't mirror included, and the intervals follow from the residual's own colour.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from engb_core.identify.confidence import coloured_covariance, Estimate
from engb_core.identify.regression_problem import Form, load_torque, Problem
from engb_core.identify.smoothing import Motion
from engb_core.model import Cogging, Friction, LoadTorque, Model

__all__ = ['Fit', 'fit', 'Form']

Array = NDArray[np.float64]

# Of the load's numbers for its band: its ends are then good to a twentieth of its width.
DRAWS = 1000


@dataclass(frozen=True)
class Fit:
    """A finished regression.

    Attributes:
        form: what was fitted.
        values: number by name.
        estimates: the same with standard deviation and unit.
        residual: (m,) [N·m] measured less modelled, through the kernel, at the motions' rows.
        rms: [N·m] of the residual.
        effective_samples: rows that count as independent, given the residual's colour.
        covariance: (p, p) of the values in the order of `form.names`; 0 for held ones.
    """

    form: Form
    values: dict[str, float]
    estimates: dict[str, Estimate]
    residual: Array
    rms: float
    effective_samples: float
    covariance: Array

    def load(self, position: Array) -> tuple[Array, Array]:
        """Return T_L (n,) [N·m] at `position` (n,) [rad] and its derivatives by the load's
        numbers (k, n), in the order of `form.names`."""
        return load_torque(self.form, self.values, np.asarray(position, float))

    def load_covariance(self) -> Array:
        """Return the covariance (k, k) of the load's numbers."""
        first = self.form.names.index('lag') + 1
        part = slice(first, self.form.names.index('coulomb'))
        return self.covariance[part, part]

    def load_band(self, position: Array, confidence: float = 0.95) -> tuple[Array, Array]:
        """Return the lower and upper end (n,) [N·m] of T_L's confidence band at `position` (n,).

        By draws from the numbers' normal distribution: to first order, as usual, the load below
        the contact would be known exactly, wherever the contact is believed to be.
        """
        place = np.asarray(position, float)
        first = self.form.names.index('lag') + 1
        names = self.form.names[first:self.form.names.index('coulomb')]
        power, axes = np.linalg.eigh(self.load_covariance())
        spread = axes * np.sqrt(np.maximum(power, 0.0))
        draws = np.random.default_rng(0).standard_normal((DRAWS, len(names))) @ spread.T
        centre = np.array([self.values[name] for name in names])
        curves = np.array([load_torque(self.form, dict(zip(names, centre + draw, strict=True)),
                                       place)[0] for draw in draws])
        outside = 0.5 * (1.0 - confidence)
        low, high = np.quantile(curves, [outside, 1.0 - outside], axis=0)
        return low, high

    def model(self, start: Model) -> Model:
        """Return `start` with the identified numbers in place of its own."""
        get = self.values.__getitem__
        if self.form.load == 'sinusoid':
            load = LoadTorque('sinusoid', (), None, get('amplitude'), get('phase'))
        else:
            load = LoadTorque(
                'polynomial',
                tuple(self.values.get(f'p{power}', 0.0) for power in range(self.form.degree + 1)),
                self.values.get('contact_angle'))
        waves = tuple(
            Cogging(order, float(np.hypot(get(f'sine{number}'), get(f'cosine{number}'))),
                    float(np.arctan2(get(f'cosine{number}'), get(f'sine{number}'))))
            for number, order in enumerate(self.form.orders))
        return replace(
            start,
            motor=replace(start.motor, inertia=get('inertia'),
                          viscous_friction=get('viscous_friction')),
            load_torque=load,
            friction=Friction(get('coulomb'), get('load_gain'), get('saturation_velocity')),
            cogging=waves)


def fit(pieces: Sequence[Motion], form: Form, start: dict[str, float],
        prior: Mapping[str, Estimate] | None = None) -> Fit:
    """Fit `form` to the motions.

    Args:
        pieces: the motions.
        form: what is looked for.
        start: numbers by name; what is missing starts at 0.
        prior: numbers known from elsewhere, each weighed by its standard deviation.
    """
    if prior:
        # How much a known number weighs follows from how well this recording can be fitted.
        first = fit(pieces, form, start)
        size = first.rms * np.sqrt(first.residual.size / first.effective_samples)
        known = {name: prior[name] for name in form.names if name in prior
                 and name not in form.held}
        return _fit(Problem(pieces, form, known, size), first.values)
    return _fit(Problem(pieces, form), start)


def _fit(problem: Problem, start: dict[str, float]) -> Fit:
    form = problem.form
    fixed = np.array([start.get(name, 0.0) for name in form.names])
    free = np.array([name not in form.held for name in form.names])
    unit = problem.units_of_size()
    lower, upper = problem.bounds()

    def full(scaled: Array) -> Array:
        values = fixed.copy()
        values[free] = scaled * unit[free]
        return values

    low, high = (lower / unit)[free], (upper / unit)[free]
    inside = np.minimum(1e-9, 0.25 * (high - low))
    first = np.clip(fixed[free] / unit[free], low + inside, high - inside)

    def condensed(scaled: Array) -> Array:
        # Any R with RᵀR = [J r]ᵀ[J r] has the same cost, gradient and curvature as [J r], but
        # only p + 1 rows.
        residual, jacobian = problem.evaluate(full(scaled))
        table = np.column_stack([jacobian[:, free] * unit[free], residual])
        power, axes = np.linalg.eigh(table.T @ table)
        rows: Array = np.sqrt(np.maximum(power, 0.0))[:, None] * axes.T
        return rows

    found = least_squares(lambda scaled: condensed(scaled)[:, -1], first,
                          jac=lambda scaled: condensed(scaled)[:, :-1],
                          bounds=(low, high), x_scale='jac', ftol=1e-10, xtol=1e-10, max_nfev=60)
    values = full(found.x)
    # One more look from the solution: least_squares' last Jacobian may be of a refused step.
    residual, jacobian = problem.evaluate(values)
    covariance, freedom = coloured_covariance(jacobian[:, free] * unit[free], residual,
                                              problem.place, problem.least_correlation)
    deviation = np.full(values.size, np.nan)
    deviation[free] = np.sqrt(np.maximum(np.diag(covariance), 0.0)) * unit[free]
    whole = np.zeros((values.size, values.size))
    whole[np.ix_(free, free)] = covariance * np.outer(unit[free], unit[free])
    units = form.units()
    named = dict(zip(form.names, values.tolist(), strict=True))
    estimates = {name: Estimate(value, float(sigma), units[name], bool(is_free), freedom)
                 for (name, value), sigma, is_free
                 in zip(named.items(), deviation, free, strict=True)}
    measured = -residual[:problem.rows]
    return Fit(form, named, estimates, measured, float(np.sqrt(np.mean(measured**2))),
               freedom + int(free.sum()), whole)
