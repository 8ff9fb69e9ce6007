# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How fast each part of the mechanism turns with the joint: the orders of what it repeats.

An order is in turns of the part per radian of motor turned through 2π, i.e. sin(order·θ_M): the
motor has order 1, the screw 1/N_g (equation (14) corrected). Lever and non-circular gear turn by a
fraction of a turn over the whole stroke, and not evenly (equations (16) to (20)): theirs is a
range. On a linear axis position is the nut's travel [m], and orders are per metre.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from engb_core.mechanism.kinematics import Mechanism

__all__ = ['Turning', 'turning_parts']

# Poles and slots of a motor, lines of its encoder.
MOTOR_HARMONICS = 48
# What is eccentric repeats once per turn, what is bent or oval twice; beyond four, tooth counts,
# which a mechanism file does not hold, would have to say more.
HARMONICS = 4
_POINTS = 400


@dataclass(frozen=True)
class Turning:
    """A part, one of its harmonics, and from which to which order it repeats [1/rad or 1/m]."""

    part: str
    harmonic: int
    low: float
    high: float


def turning_parts(mechanism: Mechanism, joint_type: str) -> tuple[Turning, ...]:
    """Return every part's harmonics.

    Args:
        mechanism: of the brake.
        joint_type: 'revolute' (position is the motor's angle) or 'prismatic' (the nut's travel).
    """
    angle = np.linspace(0.0, mechanism.stroke, _POINTS)
    posture = mechanism.posture(angle)
    per_position = 1.0 if joint_type == 'revolute' else \
        2.0 * math.pi * mechanism.gear_ratio / mechanism.screw_lead
    found = []
    for part, rate, count in (
            ('motor', np.ones(1), MOTOR_HARMONICS),
            ('screw', np.full(1, 1.0 / mechanism.gear_ratio), HARMONICS),
            ('lever', np.abs(np.gradient(posture.lever_angle, angle)), HARMONICS),
            ('gear', np.abs(np.gradient(posture.gear_angle, angle)), HARMONICS)):
        low, high = float(rate.min()) * per_position, float(rate.max()) * per_position
        found += [Turning(part, harmonic, harmonic * low, harmonic * high)
                  for harmonic in range(1, count + 1)]
    return tuple(found)
