# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Friction after a rest that grows with the rest's length; no cause is claimed."""

import math

from engb_core.effects.base import Effect, LEVEL, Parameter, TIME, TIME_STEP, VELOCITY
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _level(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    # state: how far the contact has aged: as the logarithm of the time at rest; slip renews it.
    if sample[TIME] <= 0.0:
        state[0] = 0.0
    speed = abs(sample[VELOCITY])
    if speed < parameters[3]:
        state[0] = math.log(math.exp(state[0]) + sample[TIME_STEP] / parameters[1])
    else:
        state[0] *= math.exp(-speed * sample[TIME_STEP] / parameters[2])
    return sample[LEVEL] * (1.0 + parameters[0] * state[0])


EFFECT = Effect(
    id='unexplained_rest',
    title='Unexplained friction after rest',
    parameters=(
        Parameter('growth', '-', -1.0, 20.0, none=0.0, starts=(0.1,)),
        Parameter('rest_time', 's', 1e-3, 100.0, starts=(0.1, 1.0), logarithmic=True),
        Parameter('distance', 'rad', 0.05, 100.0, starts=(0.1, 0.6, 2.5), logarithmic=True),
    ),
    stages={'level': _level},
    of_motion=True,
    equation='F (1 + growth · a), ȧ = e^(−a)/rest_time at rest, −a |ω|/distance in motion',
    reference='none claimed; the form is that of ageing contacts, Dieterich, JGR 84 (1979)',
    statement=lambda p: ('Friction after standing still is higher the longer it stood, and '
                         f"falls back within {p['distance']:.2g} rad; no effect of the "
                         'library does that.'),
    reveals='since_reversal',
    tells=lambda p: ('since_reversal', 'time_at_rest', 'direction'),
    remembers=lambda p: True,
    constants=(('standstill', 'rad/s'),),
    defaults={'standstill': 0.1},
    set_constants=lambda scene: {'standstill': max(0.002 * scene.speed, 1e-9)},
    unnamed=True,
)
