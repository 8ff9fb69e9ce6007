# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Hidden drive effects: cogging, ripple, saturation, lag, and the two-mass trains."""
from __future__ import annotations

import numpy as np

from .catalogue import Context, drawer, Hidden
from .effects_drive import wave, weakened
from .nominal import Nominal

__all__: list[str] = []


def _order(rng: np.random.Generator) -> float:
    if rng.random() < 0.8:
        return float(rng.choice([1, 2, 3, 4, 6, 7, 8, 9, 12]))
    return float(np.round(rng.uniform(0.4, 3.0), 3))


_WAVES = ('tone, weak odd harmonics', 'skewed wave', 'pulses')


def _drawn_wave(rng: np.random.Generator) -> tuple[int, float]:
    kind = int(rng.integers(1, 4))
    return kind, float(rng.uniform(*((0.05, 0.25), (0.2, 0.5), (0.5, 1.5))[kind - 1]))


def _fundamental(kind: int, second: float, second_phase: float) -> float:
    x = np.linspace(0.0, 2.0 * np.pi, 4096, endpoint=False)
    values = np.array([wave(kind, a, second, second_phase) for a in x])
    return float(2.0 * np.abs(np.mean(values * np.exp(-1j * x))))


@drawer('cogging_torque')
def _cogging(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind, second = _drawn_wave(rng)
    order, phase, other = _order(rng), rng.uniform(0, 2 * np.pi), rng.uniform(0, 2 * np.pi)

    def put(plant: np.ndarray, m: float) -> None:
        plant['cog_kind'], plant['cog_order'], plant['cog'] = kind, order, m
        plant['cog_phase'], plant['cog_second'] = phase, second
        plant['cog_second_phase'] = other

    part = _fundamental(kind, second, other)
    return Hidden('cogging_torque', _WAVES[kind - 1], put,
                  (3e-4, 0.04), lambda c: {'order': order, 'amplitude': c.magnitude * part})


@drawer('torque_ripple')
def _ripple(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind, second = _drawn_wave(rng)
    order, phase = _order(rng), rng.uniform(0, 2 * np.pi)

    def put(plant: np.ndarray, m: float) -> None:
        plant['ripple_kind'], plant['ripple_order'], plant['ripple'] = kind, order, m
        plant['ripple_phase'], plant['ripple_second'] = phase, second

    part = _fundamental(kind, second, 1.0)
    return Hidden('torque_ripple', _WAVES[kind - 1], put,
                  (0.004, 0.4), lambda c: {'order': order,
                                           'relative_amplitude': c.magnitude * part})


@drawer('torque_saturation')
def _saturation(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind = int(rng.integers(1, 4))
    peak = base.load[0] + 0.24 if motion == 'routine' else base.load[0] + 0.4
    knee = rng.uniform(0.4, 0.65) * peak

    def put(plant: np.ndarray, m: float) -> None:
        plant['weak_kind'], plant['weak'] = kind, m
        plant['weak_at'] = knee if kind == 3 else peak

    def describe(context: Context) -> dict[str, float]:
        most = float(np.abs(context.run.effort).max())
        return {'torque_loss': 1.0 - weakened(context.plant[0], most) / most}

    bounds = ((0.1, 1.0), (0.1, 1.1), (0.03, 0.7))[kind - 1]
    name = ('inverse root', 'tanh', 'soft knee')[kind - 1]
    return Hidden('torque_saturation', name, put, bounds, describe)


@drawer('actuation_lag')
def _lag(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind = int(rng.integers(1, 5))

    def put(plant: np.ndarray, m: float) -> None:
        plant['lag_kind'], plant['lag'] = kind, m

    name = ('dead time', 'second order', 'two first orders', 'mean over a window')[kind - 1]
    return Hidden('actuation_lag', name, put, (3e-4, 0.03), lambda c: {'lag': c.magnitude})


@drawer('backlash')
def _backlash(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind = int(rng.integers(1, 3))
    far = rng.uniform(0.2, 0.45) * base.inertia
    reduced = far * (base.inertia - far) / base.inertia
    hertz, damping = rng.uniform(200.0, 400.0), rng.uniform(0.15, 0.35)
    stiffness = reduced * (2.0 * np.pi * hertz) ** 2
    friction, load = rng.uniform(0.4, 0.85), rng.uniform(0.0, 0.6)

    def put(plant: np.ndarray, m: float) -> None:
        plant['train_kind'], plant['far_inertia'], plant['stiffness'] = kind, far, stiffness
        plant['damping'] = 2.0 * damping * np.sqrt(stiffness * reduced)
        plant['gap'] = m
        plant['far_coulomb'] = friction * base.coulomb
        plant['far_gain'] = load * min(base.gain, float(plant['gain'][0]))

    return Hidden('backlash', ('linear flanks', 'Hunt-Crossley flanks')[kind - 1], put,
                  (0.005, 9.0), lambda c: {'gap': c.magnitude})


@drawer('drivetrain_resonance')
def _resonance(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind = int(rng.integers(3, 6))
    far = rng.uniform(0.2, 0.5) * base.inertia
    reduced = far * (base.inertia - far) / base.inertia
    damping, friction = rng.uniform(0.02, 0.1), rng.uniform(0.0, 0.3)

    def hertz(m: float) -> float:
        return 40.0 / np.sqrt(m)

    def put(plant: np.ndarray, m: float) -> None:
        stiffness = reduced * (2.0 * np.pi * hertz(m)) ** 2
        plant['train_kind'], plant['far_inertia'], plant['stiffness'] = kind, far, stiffness
        plant['damping'] = 2.0 * damping * np.sqrt(stiffness * reduced)
        plant['hardening'] = 0.3 * stiffness / 0.05 ** 2 if kind == 4 else 0.0
        plant['slack'] = 3.0 * base.coulomb / stiffness
        plant['far_coulomb'] = friction * base.coulomb

    name = ('linear shaft', 'hardening shaft', 'shaft with a soft centre')[kind - 3]
    return Hidden('drivetrain_resonance', name, put, (0.25, 16.0),
                  lambda c: {'frequency': float(hertz(c.magnitude))}, cutoff=100.0)


def far_share(context: Context) -> float:
    """Share of the inertia that lies beyond the shaft or the gap."""
    return float(context.plant['far_inertia'][0] / context.plant['inertia'][0])
