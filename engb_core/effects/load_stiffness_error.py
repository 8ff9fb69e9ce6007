# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The load torque is a constant factor off: caliper stiffness, or what the force acts on."""

from engb_core.effects.base import Effect, LOAD, NUMBER_OFF, Parameter
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _load(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    return parameters[0] * sample[LOAD]


EFFECT = Effect(
    id='load_stiffness_error',
    title='Load stiffness is off',
    parameters=(Parameter('scale', '-', 0.1, 10.0, none=1.0, starts=(1.1,)),),
    stages={'load': _load},
    equation='T_L = scale · T_L,model(θ)',
    reference='equations (11), (12)',
    statement=lambda p: (NUMBER_OFF + 'the load torque is '
                         f"{p['scale']:.3f} times the model's at every angle "
                         '(caliper stiffness).'),
    reveals='load',
    picture='load_over_position',
    seen='The load curve is off by one factor.',
    confused='a shifted contact, a wrong torque constant',
    measure='one full stroke, and a stroke without load',
    number_only=True,
    applies=lambda scene: scene.largest_load > 0,
)
