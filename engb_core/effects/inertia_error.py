# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The model's inertia is wrong."""

from engb_core.effects.base import ACCELERATION, Effect, INERTIA, NUMBER_OFF, Parameter
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    return (parameters[0] - sample[INERTIA]) * sample[ACCELERATION]


EFFECT = Effect(
    id='inertia_error',
    title='Inertia is off',
    parameters=(Parameter('inertia', 'kg·m²', 1e-9, 1e12),),
    stages={'torque': _torque},
    equation='J dω/dt with the true J',
    reference='equation (1)',
    statement=lambda p: (
        NUMBER_OFF + 'the inertia is '
        f"{p['inertia']:.4g} kg·m², not the model's value."),
    reveals='acceleration',
    picture='torque_over_acceleration',
    seen='The residual is proportional to acceleration.',
    confused='a lag, a wrong torque constant',
    measure='fast strokes without load',
    number_only=True,
)
