# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Hidden load effects: hysteresis, creep, and what the turning disc does."""
from __future__ import annotations

import numpy as np

from .catalogue import Context, drawer, Hidden
from .effects_load import curve, curves, fade_share, load_torque, pressure_share
from .nominal import Nominal

__all__ = ['creep_time', 'hysteresis_ratio']


def hysteresis_ratio(plant: np.ndarray, top: float) -> float:
    """Half the widest opening of the slow loop 0..top..0, over the peak load."""
    p, states = plant[0], np.zeros(5)
    grid = np.linspace(0.0, top, 4000)
    idle, face = np.zeros(6), np.zeros(1)
    strokes = []
    previous = 0.0
    for path in (grid, grid[::-1]):
        loads = []
        for theta in path:
            loads.append(load_torque(p, states, idle, face, theta, previous, 0.0, 0.0, 0.0,
                                     25.0, 1e-3))
            previous = theta
        strokes.append(np.array(loads))
    width = strokes[0] - strokes[1][::-1]
    return float(0.5 * np.abs(width).max() / strokes[0].max())


@drawer('load_hysteresis')
def _hysteresis(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind = int(rng.integers(1, 3))
    length, shape = np.exp(rng.uniform(np.log(0.7), np.log(5.0))), rng.uniform(0.5, 0.9)
    radius, weight = np.array([0.1, 0.3, 0.6, 1.0, 1.6]), rng.dirichlet(np.full(5, 3.0))
    top = 24.0 if motion == 'routine' else 36.0

    def put(plant: np.ndarray, m: float) -> None:
        plant['hyst_kind'], plant['hyst'], plant['hyst_length'] = kind, m, length
        plant['hyst_shape'], plant['hyst_peak'] = shape, curve(plant[0], top)
        plant['play_radius'], plant['play_weight'] = radius, weight

    def describe(context: Context) -> dict[str, float]:
        return {'hysteresis_ratio': hysteresis_ratio(context.plant,
                                                     float(context.run.position.max()))}

    bounds = ((0.003, 0.35), (0.02, 7.0))[kind - 1]
    return Hidden('load_hysteresis', ('Bouc-Wen', 'play operators')[kind - 1], put, bounds,
                  describe)


def creep_time(parts: np.ndarray, times: np.ndarray) -> float:
    """Time into a hold at which 63 % of the relaxation is done."""
    t = np.geomspace(1e-3, 200.0, 6000)
    left = (parts[:, None] * np.exp(-t / times[:, None])).sum(axis=0) / parts.sum()
    return float(np.interp(-np.exp(-1.0), -left, t))


@drawer('pad_creep')
def _creep(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind = int(rng.integers(1, 4))
    time = np.exp(rng.uniform(np.log(0.4), np.log(5.0)))
    shares, times = {1: ([0.5, 0.3, 0.2], [0.3 * time, time, 3.0 * time]),
                     2: ([0.6, 0.4], [time, 4.5 * time]),
                     3: ([0.2] * 5, time * np.array([0.15, 0.4, 1.0, 2.5, 6.0]))}[kind]
    part, when = np.zeros(5), np.ones(5)
    part[:len(shares)], when[:len(shares)] = shares, times

    def put(plant: np.ndarray, m: float) -> None:
        plant['creep_kind'], plant['creep_part'] = kind, m * part
        plant['creep_time'] = when

    name = ('three times', 'two times, no pull', 'power-law series')[kind - 1]
    return Hidden('pad_creep', name, put, (0.005, 0.6), lambda c: {
        'relaxed_fraction': c.magnitude, 'time_constant': creep_time(part[part > 0],
                                                                     when[part > 0])})


@drawer('self_energizing')
def _self(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind, speed = int(rng.integers(1, 4)), rng.uniform(0.3, 3.0)
    sign = -1.0 if rng.random() < 0.8 else 1.0

    def put(plant: np.ndarray, m: float) -> None:
        plant['self_kind'], plant['self_gain'], plant['self_speed'] = kind, sign * m, speed

    def describe(context: Context) -> dict[str, float]:
        ratio = sign * context.magnitude
        if kind == 3:
            loads = curves(context.plant, context.run.position[np.abs(context.disc.speed) > 3.0])
            loads = np.maximum(loads[::20], 0.0)
            shares = np.array([pressure_share(load) for load in loads])
            ratio *= float(shares @ loads ** 2 / max(float(loads @ loads), 1e-12))
        return {'load_ratio': 1.0 + ratio}

    name = ('algebraic sign', 'friction that builds up', 'falls with pressure')[kind - 1]
    return Hidden('self_energizing', name, put, (0.005, 0.7), describe, needs_disc=True)


@drawer('pad_friction_fade')
def _fade(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind, knee = int(rng.integers(1, 4)), rng.uniform(25.0, 60.0)
    gain = -rng.uniform(0.15, 0.45)
    span = (45.0, 350.0)

    def put(plant: np.ndarray, m: float) -> None:
        plant['self_kind'], plant['self_gain'], plant['self_speed'] = 1, gain, 1.0
        plant['fade_kind'], plant['fade'] = kind, m
        plant['fade_from'], plant['fade_to'] = (0.0, knee) if kind == 3 else span

    def describe(context: Context) -> dict[str, float]:
        turning = np.abs(context.disc.speed) > 3.0
        p = context.plant[0]
        speeds, heats = context.disc.speed[turning][::20], context.disc.temperature[turning][::20]
        shares = [fade_share(p, s, t) for s, t in zip(speeds, heats, strict=True)]
        return {'ratio_change': float(context.plant['fade'][0] * (max(shares) - min(shares)))}

    def beside(context: Context) -> np.ndarray:
        load = curves(context.plant, context.run.position)
        turning = load * np.tanh(context.disc.speed)
        return np.stack([turning, np.abs(turning) * np.sign(context.run.velocity)], axis=1)

    name = ('square of temperature', 'sigmoid of temperature', 'exponential in speed')[kind - 1]
    return Hidden('pad_friction_fade', name, put, (0.01, 0.9), describe, needs_disc=True,
                  beside=beside)


@drawer('disc_runout')
def _runout(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind = int(rng.integers(1, 3))
    phase, second = rng.uniform(0, 2 * np.pi), rng.uniform(0.0, 0.2)
    shape = rng.uniform(0, 2 * np.pi)

    def put(plant: np.ndarray, m: float) -> None:
        plant['runout_kind'], plant['runout'], plant['runout_phase'] = kind, m, phase
        plant['runout_second'], plant['runout_shape'] = second, shape

    def describe(context: Context) -> dict[str, float]:
        if kind == 1:
            return {'amplitude': context.magnitude}
        spots = context.run.position[np.abs(context.disc.speed) > 3.0][::10]
        spots = spots[curves(context.plant, spots) > 0.02]
        slope = (curves(context.plant, spots + 0.01) - curves(context.plant, spots - 0.01)) / 0.02
        return {'amplitude': float(context.magnitude * np.sqrt(np.mean(slope ** 2)))}

    bounds = ((3e-4, 0.05), (0.02, 5.0))[kind - 1]
    return Hidden('disc_runout', ('force', 'displacement')[kind - 1], put, bounds, describe,
                  needs_disc=True)
