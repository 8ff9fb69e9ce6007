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
from engb_core.physics.compiled import compiled, effect_function, Numbers

# Steps from a reading to the true angle: each doubles the digits that are right.
NEWTON_STEPS = 6


@compiled
def _true_turn(reading: float, error: float, phase: float) -> float:
    """Return the true angle, from where the error is zero [rad]: the reading is θ + ε sin(θ + φ),
    and Newton's steps from there settle to rounding."""
    turn = reading + phase
    seen = turn
    for _ in range(NEWTON_STEPS):
        turn -= (turn + error * math.sin(turn) - seen) / (1.0 + error * math.cos(turn))
    return turn


@effect_function
def _shift(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    turn = _true_turn(sample[POSITION], parameters[0], parameters[1])
    return -parameters[0] * math.sin(turn)


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    turn = _true_turn(sample[POSITION], parameters[0], parameters[1])
    # Derivatives of the reading by the chain rule, solved for those of the true angle.
    slope = 1.0 + parameters[0] * math.cos(turn)
    velocity = sample[VELOCITY] / slope
    acceleration = (sample[ACCELERATION]
                    + parameters[0] * math.sin(turn) * velocity * velocity) / slope
    return (sample[INERTIA] * (acceleration - sample[ACCELERATION])
            + sample[VISCOUS] * (velocity - sample[VELOCITY]))


EFFECT = Effect(
    id='unexplained_eccentricity',
    title='Unexplained error of position once per revolution',
    parameters=(
        Parameter('error', 'rad', 0.0, 0.6, none=0.0, starts=(0.02,)),
        Parameter('phase', 'rad', -20.0, 20.0, starts=(0.0,), kind='phase'),
    ),
    stages={'shift': _shift, 'torque': _torque},
    equation='θ_measured = θ + error · sin(θ + phase)',
    reference='none: what is left',
    statement=lambda p: (f"The load acts as if the position were off by ±{p['error']:.3g} rad "
                         'once per motor revolution; no effect of the library does that.'),
    reveals='motor_angle',
    applies=lambda scene: scene.joint_type == 'revolute',
    unnamed=True,
)
