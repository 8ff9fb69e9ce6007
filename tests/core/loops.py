# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Closed loops with one effect each, and the effort that their motion needs, for the tests.

`python -m tests.core.loops FILE` writes the numbers of every effect: run with and without numba,
both must give the same.
"""

from __future__ import annotations

import math
import sys
import zlib

import numpy as np

from engb_core.effect_check import (
    effort_needed,
    MODEL,
    RATE,
    simulated_loop,
    TICK,
    with_effect,
)
from engb_core.effects.base import DIRECTION, Effect, Parameter, POSITION, SAMPLE_SIZE, Scene
from engb_core.effects.catalogue import catalogue
from engb_core.model import Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of

from .bench import strokes

__all__ = ['SCENE', 'drawn', 'looped', 'model_with', 'nothing', 'numbers']

# Their own numbers, for what the model file has and for what only a recording can say.
NOMINAL = {'inertia': MODEL.motor.inertia, 'viscous_friction': MODEL.motor.viscous_friction,
           'coulomb': MODEL.friction.coulomb, 'load_gain': MODEL.friction.load_gain,
           'load_curvature': MODEL.friction.load_curvature}
# The longest lag with which the loop of the tests is stable [s].
STABLE = {'lag': 0.006}
PLACES = {'begin': 1.1, 'end': 2.6, 'centre': 9.0, 'width': 2.0}
TABLE = {'x_code': float(POSITION), 'x_from': 0.0, 'x_to': 20.0, 'x_count': 12.0,
         'y_code': float(DIRECTION), 'y_from': -1.0, 'y_to': 1.0, 'y_count': 2.0}


def reference(duration: float = 10.0) -> np.ndarray:
    """Return strokes (n,) that are fast, and one that creeps."""
    fast = strokes((16.0, 10.0, 20.0), rate=RATE, acceleration=500.0, dwell=0.15)
    slow = strokes((6.0,), rate=RATE, acceleration=12.0, dwell=0.15)
    return np.concatenate([fast, slow])[:round(duration * RATE)]


SCENE = Scene(duration=reference().size * TICK, largest_effort=0.2, largest_load=0.12, speed=60.0,
              sampling=TICK, position_range=(0.0, 20.0), disc_speed_range=(0.0, 60.0),
              temperature_range=(20.0, 200.0))


def drawn(effect: Effect, seed: int) -> dict[str, float]:
    """Return sensible values of an effect's parameters and constants, drawn by `seed`."""
    rng = np.random.default_rng([seed, zlib.crc32(effect.id.encode())])
    values = {parameter.name: _drawn(parameter, index == 0, rng)
              for index, parameter in enumerate(effect.parameters)}
    constants = dict(effect.variants[seed % len(effect.variants)])
    if effect.set_constants is not None:
        constants |= effect.set_constants(SCENE)
    for name, _ in effect.constants:
        values[name] = float(constants[name] if name in constants else TABLE[name])
    return values


def _drawn(parameter: Parameter, sizing: bool, rng: np.random.Generator) -> float:
    if parameter.name.startswith('value_'):
        return rng.uniform(-0.004, 0.004)
    if parameter.none is None and parameter.name in NOMINAL and sizing:
        return NOMINAL[parameter.name] * rng.uniform(1.1, 1.5)
    if parameter.name in PLACES and not parameter.starts:
        return PLACES[parameter.name]
    if not parameter.starts:
        return math.sqrt(parameter.low * parameter.high) if parameter.low > 0.0 else 1.0
    start = min(float(rng.choice(parameter.starts)), STABLE.get(parameter.name, math.inf))
    if sizing and not parameter.logarithmic:
        none = parameter.none or 0.0
        start = none + (start - none) * rng.uniform(0.8, 1.3)
    elif start == 0.0:
        start = rng.uniform(0.0, 0.3 * min(1.0, parameter.high))
    return float(np.clip(start, parameter.low, parameter.high))


def nothing(effect: Effect, seed: int) -> dict[str, float]:
    """Return values at which an effect vanishes, with all that it contains."""
    values = drawn(effect, seed)
    for entry in (effect.id, *effect.contains):
        for parameter in catalogue()[entry].parameters:
            if parameter.none is not None and parameter.name in effect.names:
                values[parameter.name] = parameter.none
    for parameter in effect.parameters:
        if parameter.none is None and parameter.name in NOMINAL:
            values[parameter.name] = NOMINAL[parameter.name]
    return values


def model_with(effect: Effect | None, values: dict[str, float] | None = None) -> Model:
    """Return MODEL with one effect (None: without)."""
    return MODEL if effect is None else with_effect(effect, dict(values or {}))


def looped(model: Model, duration: float = 10.0) -> tuple[np.ndarray, np.ndarray]:
    """Simulate the loop; return its samples (n, SAMPLE_SIZE) and the effort (n,) it held."""
    return simulated_loop(model, reference(duration))


def numbers(duration: float = 0.25) -> dict[str, np.ndarray]:
    """Return what simulation, inverse dynamics and each stage give for every effect."""
    found = {}
    common, _ = looped(model_with(None), duration)
    for effect in (entry for entry in catalogue().values() if entry.made_of is None):
        model = model_with(effect, drawn(effect, 1))
        samples, effort = looped(model, duration)
        found[f'{effect.id} simulated'] = samples[:, POSITION]
        found[f'{effect.id} needed'] = effort_needed(samples, model)
        physics = physics_of(model, inverse=False)
        for stage, functions in physics.stages.items():
            table = common.copy()
            needed_before = physics_of(model_with(None))
            effort_of_motion(table, TICK, needed_before)
            state = physics.fresh_state()
            for function, owner in functions:
                column = np.array([function(physics.parameters[owner], state[owner], row)
                                   for row in table])
                found[f'{effect.id} {stage} one by one'] = column
                state[:] = 0.0
                function.loop(physics.parameters[owner], state[owner], table, SAMPLE_SIZE - 1)
                found[f'{effect.id} {stage} in a loop'] = table[:, SAMPLE_SIZE - 1]
    return found


if __name__ == '__main__':
    np.savez(sys.argv[1], **numbers())
