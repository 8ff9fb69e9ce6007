# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A position that is measured wrong once per motor revolution; no cause is claimed."""

import math

from engb_core.effects.base import (
    ACCELERATION,
    Effect,
    INERTIA,
    Parameter,
    POSITION,
    VELOCITY,
    VISCOUS,
)
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _shift(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    return -parameters[0] * math.sin(sample[POSITION] + parameters[1])


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    # The true angle is θ − ε sin(θ + φ); its derivatives follow by the chain rule.
    turn = sample[POSITION] + parameters[1]
    speed = -parameters[0] * math.cos(turn) * sample[VELOCITY]
    rate = parameters[0] * (math.sin(turn) * sample[VELOCITY] * sample[VELOCITY]
                            - math.cos(turn) * sample[ACCELERATION])
    return sample[INERTIA] * rate + sample[VISCOUS] * speed


EFFECT = Effect(
    id='unexplained_eccentricity',
    title='Unexplained error of position once per revolution',
    parameters=(
        Parameter('error', 'rad', 0.0, 0.6, none=0.0, starts=(0.02,)),
        Parameter('phase', 'rad', -20.0, 20.0, starts=(0.0,), kind='phase'),
    ),
    stages={'shift': _shift, 'torque': _torque},
    equation='θ = θ_measured − error · sin(θ_measured + phase)',
    reference='none: what is left',
    statement=lambda p: (f"The load acts as if the position were off by ±{p['error']:.3g} rad "
                         'once per motor revolution; no effect of the library does that.'),
    reveals='motor_angle',
    applies=lambda scene: scene.joint_type == 'revolute',
    unnamed=True,
)
