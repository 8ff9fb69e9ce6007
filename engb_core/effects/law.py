# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A law: a formula of the restricted grammar (engb_core/laws), in the model file.

Where it acts is part of it: a torque, a gain on friction, load or effort, an inertia over the
angle, an error of the measured position, a delay. The formula lies among the parameters as a
program for one stack machine, so that every law shares the functions below.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from engb_core.effects.base import (
    ACCELERATION,
    Effect,
    EFFORT,
    INERTIA,
    LEVEL,
    LOAD,
    Parameter,
    POSITION,
    TIME,
    TIME_STEP,
    VELOCITY,
    VISCOUS,
)
from engb_core.errors import InputError
from engb_core.laws.grammar import coordinates_of, is_followed, parameters_of, parse
from engb_core.laws.machine import ACTS_AS, LONGEST, MODE, MOST_PARAMETERS, program_of, value_of
from engb_core.laws.whole_motion import values_of
from engb_core.model import EffectSetting
from engb_core.physics.compiled import compiled, effect_function, Numbers

__all__ = ['EFFECT', 'law_effect', 'law_value']

# Step of a difference quotient over position, as a part of a radian, and over time [s].
_ANGLE_STEP, _TIME_STEP = 1e-3, 1e-3
_RING = 46


@compiled
def _late(state: Numbers, effort: float, step: float, delay: float, longest: float) -> float:
    """Return the effort of `delay` [s] ago, from means over stretches of a fortieth of the
    longest delay."""
    stretch = step * max(1.0, math.ceil(longest / (_RING - 6) / step - 1e-9))
    if state[0] == 0.0:
        for place in range(_RING):
            state[3 + place] = effort
        state[0] = 1.0
    state[1] += step
    state[2] += effort * step
    if state[1] > stretch - 0.5 * step:
        state[3 + int(state[0]) % _RING] = state[2] / state[1]
        state[0] += 1.0
        state[1] = 0.0
        state[2] = 0.0
    back = min(max((delay + 0.5 * step - state[1]) / stretch - 0.5, 0.0), _RING - 3.0)
    whole = int(back)
    latest = int(state[0]) - 1
    newer = state[3 + (latest - whole) % _RING]
    older = state[3 + (latest - whole - 1) % _RING]
    return newer + (back - whole) * (older - newer)


@compiled
def _seen_late(state: Numbers, position: float, step: float, delay: float, longest: float,
               ) -> float:
    """Return the position of `delay` [s] ago, on straight lines between instants a fortieth of the
    longest delay apart, the latest of which is now."""
    stretch = step * max(1.0, math.ceil(longest / (_RING - 6) / step - 1e-9))
    if state[0] == 0.0:
        for place in range(_RING):
            state[3 + place] = position
        state[0] = 1.0
    else:
        state[1] += step
        if state[1] > stretch - 0.5 * step:
            state[3 + int(state[0]) % _RING] = position
            state[0] += 1.0
            state[1] = 0.0
    age = state[1]
    latest = int(state[0]) - 1
    if delay <= age:
        along = delay / age if age > 0.0 else 0.0
        return position + along * (state[3 + latest % _RING] - position)
    back = min((delay - age) / stretch, _RING - 3.0)
    whole = int(back)
    newer = state[3 + (latest - whole) % _RING]
    older = state[3 + (latest - whole - 1) % _RING]
    return newer + (back - whole) * (older - newer)


@effect_function
def law_value(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    """Return the value of the formula alone."""
    return value_of(parameters, state, sample, sample[POSITION])


@effect_function
def _act(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    mode = int(parameters[99])
    value = value_of(parameters, state, sample, sample[POSITION])
    if mode == 0:
        return value
    if mode == 1:
        return sample[LEVEL] * max(1.0 + value, 0.0)
    if mode == 2:
        return sample[LOAD] * (1.0 + value)
    if mode == 3:
        return sample[EFFORT] * (1.0 + value)
    if mode == 4:
        # J(θ) a + ½ J′(θ) ω²: the equation of Lagrange for an inertia over the angle.
        ahead = value_of(parameters, state, sample, sample[POSITION] + _ANGLE_STEP)
        behind = value_of(parameters, state, sample, sample[POSITION] - _ANGLE_STEP)
        slope = (ahead - behind) / (2.0 * _ANGLE_STEP)
        sample[INERTIA] += max(value, -0.9 * sample[INERTIA])
        return 0.5 * slope * sample[VELOCITY] * sample[VELOCITY]
    if sample[TIME] <= 0.0:
        state[0] = 0.0
        state[1] = 0.0
        state[2] = 0.0
    return _late(state, sample[EFFORT], sample[TIME_STEP], max(value, 0.0), parameters[98])


# Quantities of a sample that come about in the stages; friction's direction, where a law is told
# that (machine.py).
_PASSING = ('load', 'effort')
_TOLD_DIRECTION = ('torque', 'friction_gain')


def _act_on_all(parameters: NDArray[np.float64], state: NDArray[np.float64],
                samples: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values (n,) of `_act` for samples (n, SAMPLE_SIZE)."""
    acts_as = ACTS_AS[int(parameters[MODE])]
    if acts_as == 'torque':
        return values_of(parameters, state, samples)
    if acts_as == 'effort_gain':
        return samples[:, EFFORT] * (1.0 + values_of(parameters, state, samples))
    if acts_as == 'load_gain':
        return samples[:, LOAD] * (1.0 + values_of(parameters, state, samples))
    if acts_as == 'friction_gain':
        return samples[:, LEVEL] * np.maximum(1.0 + values_of(parameters, state, samples), 0.0)
    return _act.sample_by_sample(parameters, state, samples)


law_value.whole, _act.whole = values_of, _act_on_all


@effect_function
def _shift(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    return value_of(parameters, state, sample, sample[POSITION])


@effect_function
def _late_reading(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    if sample[TIME] <= 0.0:
        state[0] = 0.0
        state[1] = 0.0
    late = value_of(parameters, state, sample, sample[POSITION])
    return _seen_late(state, sample[POSITION], sample[TIME_STEP], max(late, 0.0), parameters[98])


@effect_function
def _shift_torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    # The true angle is θ + e(θ); its derivatives follow from where the shaft is a moment on.
    moved = sample[VELOCITY] * _TIME_STEP
    curved = 0.5 * sample[ACCELERATION] * _TIME_STEP * _TIME_STEP
    here = value_of(parameters, state, sample, sample[POSITION])
    ahead = value_of(parameters, state, sample, sample[POSITION] + moved + curved)
    behind = value_of(parameters, state, sample, sample[POSITION] - moved + curved)
    speed = (ahead - behind) / (2.0 * _TIME_STEP)
    rate = (ahead - 2.0 * here + behind) / (_TIME_STEP * _TIME_STEP)
    return sample[INERTIA] * rate + sample[VISCOUS] * speed


_STAGES = {
    'torque': {'torque': _act},
    'friction_gain': {'level': _act},
    'load_gain': {'load': _act},
    'effort_gain': {'actuation': _act},
    'inertia': {'torque': _act},
    'position_shift': {'shift': _shift, 'torque': _shift_torque},
    'delay': {'actuation': _act},
    # The load is met elsewhere; the shaft itself moves as it was measured.
    'load_shift': {'shift': _shift},
    # The brake itself knows nothing of a sensor that is late; its controller knows nothing else.
    'position_delay': {'sensing': _late_reading},
}
_EQUATIONS = {
    'torque': 'T = f', 'friction_gain': 'T_C = T_C (1 + f)', 'load_gain': 'T_L = T_L (1 + f)',
    'effort_gain': 'T_M = effort (1 + f)', 'inertia': 'T = f(θ) a + ½ f′(θ) ω²',
    'position_shift': 'θ = θ_measured + f', 'delay': 'T_M(t) = effort(t − f)',
    'position_delay': 'θ(t − f) = θ_measured(t)', 'load_shift': 'T_L = T_L(θ + f)',
}
# What a law of these places may not look at: it isn't known yet when they act, or it has no
# derivative.
_NOT_THERE = {
    'torque': ('effort',), 'friction_gain': ('effort',), 'load_gain': ('effort', 'acceleration'),
    'position_shift': ('effort',), 'position_delay': ('effort',),
    'load_shift': ('effort', 'acceleration'),
}


def law_effect(formula: str, acts_as: str, parameters: tuple[Parameter, ...],
               within: dict[str, tuple[float, float]], largest: float = 0.0) -> Effect:
    """Return the effect of a law.

    Args:
        formula: of the grammar; its parameters in order of appearance are `parameters`.
        acts_as: where it acts.
        parameters: of the formula, in that order.
        within: coordinate → (lowest, highest) value at which it was seen.
        largest: delay that may come about [s], of a law that is one.

    Raises:
        InputError: the formula is not of the grammar, or can't act there.
    """
    expression = parse(formula)
    program = program_of(expression, acts_as, within)
    used = coordinates_of(expression)
    if acts_as == 'inertia' and (set(used) - {'position'} or is_followed(expression)):
        raise InputError('law: an inertia takes a formula of position alone')
    if acts_as in ('delay', 'position_delay') and is_followed(expression):
        raise InputError('law: a delay takes a formula without memory or rate')
    hidden = [name for name in used if name in _NOT_THERE.get(acts_as, ())]
    if hidden:
        raise InputError(f'law: a formula that acts as {acts_as} cannot depend on {hidden[0]}')
    program[LONGEST] = largest
    program[MODE] = ACTS_AS.index(acts_as)
    count = len(parameters)
    constants = tuple((f'code_{place:03d}', '-') for place in range(count, program.size))
    return Effect(
        id='law', title='Law', parameters=parameters, stages=_STAGES[acts_as],
        equation=f'{_EQUATIONS[acts_as]}, f = {formula}', reference='none: found in recordings',
        statement=lambda p: f'{_EQUATIONS[acts_as]}, f = {formula}.',
        reveals=used[0] if used else 'time', constants=constants,
        defaults=dict(zip((name for name, _ in constants), program[count:].tolist(),
                          strict=True)),
        proportional=lambda p: acts_as == 'effort_gain' and 'effort' not in used,
        of_motion=acts_as != 'inertia' and not set(_PASSING) & set(used) and not (
            acts_as in _TOLD_DIRECTION and 'direction' in used),
        variants=({},), unnamed=True, warp=law_value if acts_as == 'delay' else None,
        correction=law_value if acts_as in ('position_shift', 'position_delay') else None,
        late_position=acts_as == 'position_delay',
        written=lambda values: EffectSetting('law', {
            entry.name: values[entry.name] for entry in parameters}, formula, acts_as,
            {name: (float(low), float(high)) for name, (low, high) in within.items()
             if name in (*used, 'position', 'velocity')}))


def _made_of(setting: EffectSetting) -> tuple[Effect, list[float]]:
    """Return the effect and the values of a law that stands in a model file."""
    if not setting.formula:
        raise InputError('effects: law needs a formula such as "a * abs(load)"')
    names = parameters_of(parse(setting.formula))
    missing = [name for name in names if name not in setting.parameters]
    unknown = [name for name in setting.parameters if name not in names]
    if missing or unknown:
        raise InputError(f'effects: law {setting.formula!r}: '
                         + (f'no value for {missing[0]}' if missing
                            else f'parameter {unknown[0]!r} does not stand in the formula'))
    if len(names) > MOST_PARAMETERS:
        raise InputError(f'effects: law has more than {MOST_PARAMETERS} parameters')
    values = [float(setting.parameters[name]) for name in names]
    effect = law_effect(setting.formula, setting.acts_as or 'torque', tuple(
        Parameter(name, '-', -1e30, 1e30) for name in names), dict(setting.within),
        largest=_LONGEST_DELAY)
    return effect, [*values, *effect.defaults.values()]


# Of a law in a model file [s].
_LONGEST_DELAY = 0.1

EFFECT = Effect(
    id='law',
    title='Law',
    parameters=(),
    stages={},
    equation='a formula of position, velocity, load, …',
    reference='none: found in recordings',
    statement=lambda p: 'A formula stands for what no known effect explains.',
    reveals='position',
    unnamed=True,
    made_of=_made_of,
)
