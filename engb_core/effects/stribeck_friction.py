# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Friction falls as speed rises from zero."""

import math

from engb_core.effects.base import Effect, LEVEL, Parameter, VELOCITY
from engb_core.physics.compiled import effect_function, Numbers

# Friction near standstill, over that at speed, from which on a fall is believed.
LEAST = 1.03


@effect_function
def _level(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    speed = abs(sample[VELOCITY]) / parameters[1]
    return sample[LEVEL] * (1.0 + (parameters[0] - 1.0) * math.exp(-speed ** parameters[2]))


EFFECT = Effect(
    id='stribeck_friction',
    title='Stribeck friction',
    parameters=(
        Parameter('breakaway_ratio', '-', 1.0, 6.0, none=1.0, starts=(1.3,)),
        Parameter('stribeck_velocity', 'rad/s', 1e-3, 60.0,
                  starts=(0.5, 1.0, 2.0, 4.0, 8.0), logarithmic=True),
        Parameter('shape', '-', 0.6, 2.5, starts=(1.0, 2.0), kind='exponent'),
    ),
    stages={'level': _level},
    of_motion=True,
    equation='F(ω) = F (1 + (ratio − 1) exp(−|ω/ω_s|^shape))',
    reference='Stribeck, VDI-Z 46 (1902); Armstrong-Hélouvry et al., Automatica 30 (1994)',
    statement=lambda p: (
        f"Friction near standstill is {p['breakaway_ratio']:.2f} times that at speed and "
        f"falls off over about {p['stribeck_velocity']:.2g} rad/s."),
    reveals='velocity',
    picture='friction_over_speed',
    seen='Friction is highest near standstill and falls as speed rises.',
    confused='presliding friction, drag that thins',
    measure='a ladder of constant speeds that begins at creep',
    # So little is within what formulas of presliding miss.
    credence=lambda p: 1.0 if p['breakaway_ratio'] > LEAST else 0.3,
)
