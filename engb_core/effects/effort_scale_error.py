# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Effort is off by one factor: torque constant, gear ratio, or what a drive calls torque."""

from engb_core.effects.base import Effect, EFFORT, NUMBER_OFF, Parameter
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _actuation(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    return parameters[0] * sample[EFFORT]


EFFECT = Effect(
    id='effort_scale_error',
    title='Effort scale is off',
    parameters=(Parameter('scale', '-', 0.2, 5.0, none=1.0, starts=(0.8, 1.25)),),
    stages={'actuation': _actuation},
    of_motion=True,
    proportional=lambda p: True,
    equation='T_M = scale · effort',
    reference='contract, additions; torque constant of a drive (Lynch and Park, Modern Robotics '
              '(2017), section 8.9)',
    statement=lambda p: (
        f"{NUMBER_OFF}the true torque is {p['scale']:.3f} times the recorded effort (torque "
        f"constant); inertia, load and friction seem {1.0 / p['scale']:.3f} times the model's."),
    reveals='effort',
    picture='torque_over_effort',
    seen='Inertia, load and friction all seem wrong by the same factor.',
    confused='a wrong inertia together with a wrong load',
    measure='a known weight on a known arm, held still at several angles',
    number_only=True,
)
