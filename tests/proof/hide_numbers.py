# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Hidden wrong numbers: no physics is missing, the nominal model holds a false value.

A nominal model that hides such a number was refitted in others, but not in this one. Which others
a refit held is drawn for every case without regard to what it hides (cases.py).
"""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from .catalogue import Context, drawer, Hidden
from .nominal import load_of, Nominal

__all__ = ['LOAD_NUMBERS']

LOAD_NUMBERS = ('p0', 'p1', 'p2', 'p3', 'contact')


def _nothing(plant: np.ndarray, magnitude: float) -> None:
    """Leave the plant as it is: the error is in the model."""


def _sign(rng: np.random.Generator) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0


@drawer('inertia_error')
def _inertia(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    sign = _sign(rng)

    def lack(model: Nominal, m: float) -> Nominal:
        return replace(model, inertia=model.inertia * (1.0 + sign * m))

    return Hidden('inertia_error', 'number', _nothing, (0.005, 0.7),
                  lambda c: {'inertia': c.base.inertia}, lack, ('inertia',))


@drawer('viscous_friction_error')
def _viscous(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    sign = _sign(rng)

    def lack(model: Nominal, m: float) -> Nominal:
        return replace(model, viscous=model.viscous * (1.0 + sign * m))

    return Hidden('viscous_friction_error', 'number', _nothing, (0.01, 0.95),
                  lambda c: {'viscous_friction': c.base.viscous}, lack, ('viscous',))


@drawer('coulomb_friction_error')
def _coulomb(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    sign = _sign(rng)

    def lack(model: Nominal, m: float) -> Nominal:
        return replace(model, coulomb=model.coulomb * (1.0 + sign * m))

    return Hidden('coulomb_friction_error', 'number', _nothing, (0.01, 0.95),
                  lambda c: {'coulomb': c.base.coulomb}, lack, ('coulomb',))


@drawer('load_stiffness_error')
def _stiffness(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    sign = _sign(rng)

    def lack(model: Nominal, m: float) -> Nominal:
        scale = 1.0 + sign * m
        a, b, c, d = (p / scale for p in model.load)
        return replace(model, load=(a, b, c, d))

    return Hidden('load_stiffness_error', 'number', _nothing, (0.003, 0.6),
                  lambda c: {'scale': 1.0 + sign * c.magnitude}, lack, LOAD_NUMBERS)


@drawer('contact_shift')
def _contact(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    sign = _sign(rng)

    def lack(model: Nominal, m: float) -> Nominal:
        shift = sign * m  # truth(θ) = model(θ - shift), so model(θ) = truth(θ + shift)
        if model.contact is not None:
            return replace(model, contact=model.contact - shift)
        if model.turn:
            wave = complex(model.load[1], -model.load[0]) * np.exp(1j * model.turn * shift)
            return replace(model, load=(-wave.imag, wave.real, 0.0, 0.0))
        # Of a curve of lower order numpy leaves the highest coefficients out.
        found = np.polynomial.Polynomial(model.load)(np.polynomial.Polynomial([shift, 1.0])).coef
        a, b, c, d = (*map(float, found), 0.0, 0.0, 0.0)[:4]
        return replace(model, load=(a, b, c, d))

    return Hidden('contact_shift', 'number', _nothing, (0.02, 4.0),
                  lambda c: {'shift': sign * c.magnitude}, lack, LOAD_NUMBERS)


@drawer('torque_offset')
def _offset(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    sign = _sign(rng)

    def put(plant: np.ndarray, m: float) -> None:
        plant['offset'] = sign * m

    def describe(context: Context) -> dict[str, float]:
        return {'offset': float(context.plant['offset'][0])}

    return Hidden('torque_offset', 'current sensor', put, (2e-4, 0.04), describe)


@drawer('load_dependent_friction')
def _load_friction(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    modelled = 0.0 if rng.random() < 0.6 else rng.uniform(0.01, 0.05)
    levels = rng.random() < 0.5
    knee = rng.uniform(0.3, 0.8) if levels else 0.0
    power = 1.0 if levels else rng.choice([rng.uniform(0.75, 0.92), rng.uniform(1.08, 1.3)])

    def put(plant: np.ndarray, m: float) -> None:
        plant['gain'] = modelled + m
        plant['gain_power'], plant['gain_scale'], plant['gain_knee'] = power, 0.2, knee

    def lack(model: Nominal, m: float) -> Nominal:
        return replace(model, gain=modelled)

    def describe(context: Context) -> dict[str, float]:
        load = np.abs(load_of(context.base, context.run.position))
        load = load[np.abs(context.run.velocity) > 0.3]
        gain = context.plant['gain'][0]
        level = gain * load / (1.0 + load / knee) if levels else \
            gain * 0.2 * (load / 0.2) ** power
        slope = np.polyfit(load, level, 1)[0]
        return {'load_gain': float(slope)}

    name = 'levels off with load' if levels else 'power of load'
    return Hidden('load_dependent_friction', name, put, (0.002, 0.35), describe, lack, ('gain',))
