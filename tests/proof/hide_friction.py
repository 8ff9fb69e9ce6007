# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Hidden friction: asymmetry, Stribeck, presliding, nonlinear drag, drift."""
from __future__ import annotations

import numpy as np

from .catalogue import Context, drawer, Hidden
from .effects_friction import advance_bristle, asymmetry_share, warmth
from .nominal import load_of, Nominal

__all__ = ['presliding_distance']


@drawer('asymmetric_friction')
def _asymmetric(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    sign = 1.0 if rng.random() < 0.5 else -1.0
    by_speed = rng.random() < 0.5
    parts = np.ones(2) if by_speed else rng.uniform(0.65, 1.35, 2)
    speed = rng.uniform(10.0, 40.0) if by_speed else 0.0

    def put(plant: np.ndarray, m: float) -> None:
        plant['asym_coulomb'], plant['asym_load'] = sign * m * parts
        plant['asym_speed'] = speed

    def describe(context: Context) -> dict[str, float]:
        p, b = context.plant[0], context.base
        moves = np.abs(context.run.velocity) > 0.3
        spots = context.run.position[moves]
        acting = np.mean([asymmetry_share(p, v) for v in context.run.velocity[moves][::20]])
        load = b.gain * np.abs(load_of(b, spots)).mean()
        odd = acting * (b.coulomb * p['asym_coulomb'] + load * p['asym_load'])
        return {'asymmetry': float(odd / (b.coulomb + load))}

    name = 'grows with speed' if by_speed else 'unequal parts'
    return Hidden('asymmetric_friction', name, put, (0.005, 0.7), describe)


@drawer('stribeck_friction')
def _stribeck(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind = int(rng.integers(1, 5))
    speed = float(np.exp(rng.uniform(np.log(1.2), np.log(9.0))))

    def put(plant: np.ndarray, m: float) -> None:
        plant['stribeck_kind'], plant['stribeck_velocity'] = kind, speed
        plant['stribeck_ratio'] = 1.0 + m
        plant['saturation'] = 0.0

    name = ('secant', 'inverse square', 'lorentzian', 'tanh')[kind - 1]
    return Hidden('stribeck_friction', name, put, (0.02, 4.0), lambda c: {
        'breakaway_ratio': 1.0 + c.magnitude, 'stribeck_velocity': speed})


def presliding_distance(plant: np.ndarray) -> float:
    """Way after a full reversal in which friction has gone 63 % of its change."""
    p, states = plant[0], np.zeros(6)
    step = float(max(p['bristle_length'], p['slip_length'].max())) / 400.0
    for _ in range(20000):
        advance_bristle(p, states, -step, 1.0)
    way, start = 0.0, -1.0
    value = start
    while value < start + 2.0 * (1.0 - np.exp(-1.0)):
        value = advance_bristle(p, states, step, 1.0)
        way += step
    return way


@drawer('presliding_friction')
def _presliding(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind = int(rng.integers(1, 4))
    lengths = np.array([0.15, 0.4, 0.8, 1.4, 2.2, 3.5])
    weights = rng.dirichlet(np.full(6, 3.0))
    elastic, damping = rng.uniform(0.2, 0.7), rng.uniform(2e-4, 2e-3)

    def put(plant: np.ndarray, m: float) -> None:
        plant['bristle_kind'], plant['bristle_length'] = kind, m
        plant['slip_length'], plant['slip_weight'] = 0.5 * m * lengths, weights
        plant['bristle_elastic'], plant['bristle_damping'] = elastic, damping
        plant['saturation'] = 0.0

    name = ('LuGre, damped', 'Maxwell slip', 'elastoplastic')[kind - 1]
    return Hidden('presliding_friction', name, put, (0.003, 4.0), lambda c: {
        'presliding_distance': presliding_distance(c.plant)})


@drawer('nonlinear_viscous_friction')
def _drag(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind = int(rng.integers(1, 4))
    sign = 1.0 if rng.random() < 0.75 or kind == 2 else -1.0
    shape = rng.uniform(*((5.0, 25.0), (1.7, 2.4), (90.0, 300.0))[kind - 1])

    def put(plant: np.ndarray, m: float) -> None:
        plant['drag_kind'], plant['drag'], plant['drag_shape'] = kind, sign * m, shape

    def describe(context: Context) -> dict[str, float]:
        v = context.run.velocity[np.abs(context.run.velocity) > 0.3]
        size = np.abs(v)
        law = {1: size ** 2 * (1 - np.exp(-size / shape)), 2: 900.0 * (size / 30.0) ** shape,
               3: size ** 2 / (1 + size / shape)}
        target = sign * context.magnitude * law[kind] * np.sign(v)
        columns = np.stack([v * size, v, np.sign(v)], axis=1)
        fit = np.linalg.lstsq(columns, target, rcond=None)[0]
        return {'quadratic_viscous_friction': float(fit[0])}

    name = ('churning', 'power law', 'shear thinning')[kind - 1]
    return Hidden('nonlinear_viscous_friction', name, put, (2e-7, 2e-4), describe)


@drawer('friction_drift')
def _drift(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind = int(rng.integers(1, 3))
    sign = 1.0 if rng.random() < 0.4 else -1.0
    time = 60.0 if kind == 1 else rng.uniform(4.0, 12.0)
    middle = rng.uniform(12.0, 40.0)

    def put(plant: np.ndarray, m: float) -> None:
        plant['drift_kind'], plant['drift'], plant['drift_time'] = kind, sign * m, time
        plant['drift_at'] = middle

    def describe(context: Context) -> dict[str, float]:
        return {'friction_ratio': warmth(context.plant[0], float(context.run.time[-1]))}

    name = ('root of time', 'logistic')[kind - 1]
    return Hidden('friction_drift', name, put, (0.02, 0.75), describe)
