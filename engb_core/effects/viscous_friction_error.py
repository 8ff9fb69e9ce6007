# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The model's viscous friction coefficient is wrong."""

from engb_core.effects.base import Effect, NUMBER_OFF, Parameter, VELOCITY, VISCOUS
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    return (parameters[0] - sample[VISCOUS]) * sample[VELOCITY]


EFFECT = Effect(
    id='viscous_friction_error',
    title='Viscous friction is off',
    parameters=(Parameter('viscous_friction', 'N·m·s/rad', 0.0, 1e12),),
    stages={'torque': _torque},
    equation='B ω with the true B',
    reference='equation (1)',
    statement=lambda p: (NUMBER_OFF + 'the viscous friction '
                         'coefficient is '
                         f"{p['viscous_friction']:.4g} N·m·s/rad, not the model's value."),
    reveals='velocity',
    picture='friction_over_speed',
    seen='The residual is proportional to speed.',
    confused='a lag at one frequency, back-EMF in a voltage drive',
    measure='constant speeds without load',
    number_only=True,
)
