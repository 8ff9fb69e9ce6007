# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The model's Coulomb friction is wrong."""

from engb_core.effects.base import COULOMB, Effect, LEVEL, NUMBER_OFF, Parameter
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _level(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    return sample[LEVEL] + parameters[0] - sample[COULOMB]


EFFECT = Effect(
    id='coulomb_friction_error',
    title='Coulomb friction is off',
    parameters=(Parameter('coulomb', 'N·m', 0.0, 1e12),),
    stages={'level': _level},
    equation='C₀ sat(ω) with the true C₀',
    reference='equation (13)',
    statement=lambda p: (NUMBER_OFF + 'the Coulomb friction is '
                         f"{p['coulomb']:.4g} N·m, not the model's value."),
    reveals='velocity',
    picture='friction_over_speed',
    seen='The same step at every reversal, at all loads and speeds.',
    confused='Stribeck friction seen at low speeds only',
    measure='slow strokes without load, both ways',
    number_only=True,
)
