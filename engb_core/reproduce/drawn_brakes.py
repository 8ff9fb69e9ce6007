"""Brakes of the paper's kind whose numbers are drawn by chance: nobody chose what is to be found.

Every number lies within ±30 % of the paper's or the chosen one, the contact anywhere between 2
and 9 rad. The load is the whole mechanism's, not the cubic that the identification fits.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from engb_core.kinematics import Mechanism
from engb_core.model import Cogging, Friction, Model, Motor
from engb_core.reproduce import chosen
from engb_core.statics import clamp_force, load_polynomial, torque_of_clamp_force

__all__ = ['draw_brake', 'DrawnBrake']

# Numbers lie within this part of the paper's either way; the contact between these angles [rad].
SPREAD = 0.3
CONTACTS = (2.0, 9.0)

# Cogging orders of common motors: slots × poles / their greatest common divisor, per turn.
ORDERS = (6.0, 8.0, 12.0, 24.0)

# The load at the strokes' end is within SPREAD of this [N·m], as in the chosen mechanism.
LARGEST_LOAD = 0.12


@dataclass(frozen=True)
class DrawnBrake:
    """One brake: `model` with all its numbers, the `mechanism` behind its load and friction."""

    model: Model
    mechanism: Mechanism


def draw_brake(seed: int, top: float = 20.0) -> DrawnBrake:
    """Return the brake of this seed.

    Args:
        seed: any whole number.
        top: the strokes' largest angle [rad], at which the load is LARGEST_LOAD ± 30 %.
    """
    random = np.random.default_rng([2017, seed])

    def about(value: float, spread: float = SPREAD) -> float:
        return float(value * random.uniform(1.0 - spread, 1.0 + spread))

    base = chosen.MECHANISM
    # Lengths of one design differ less than stiffness and friction do, or the lever would jam.
    mechanism = replace(base, lever_input=about(base.lever_input, 0.1),
                        lever_output=about(base.lever_output, 0.1),
                        gear_ratio=about(base.gear_ratio, 0.1),
                        efficiency=1.0 - about(1.0 - base.efficiency))
    contact = float(random.uniform(*CONTACTS))
    mechanism = replace(mechanism, clearance=float(mechanism.posture(contact).pad_onto))
    linear, square = base.clamp_stiffness
    mechanism = replace(mechanism, clamp_stiffness=(about(linear), about(square)))
    load = float(torque_of_clamp_force(mechanism, clamp_force(mechanism, top), top))
    scale = about(LARGEST_LOAD) / load
    mechanism = replace(mechanism, clamp_stiffness=tuple(
        scale * value for value in mechanism.clamp_stiffness))
    chain = load_polynomial(mechanism)
    motor = Motor(about(chosen.MOTOR.torque_constant), about(chosen.MOTOR.inertia),
                  about(chosen.MOTOR.viscous_friction))
    cogging = Cogging(float(random.choice(ORDERS)), about(4e-3),
                      float(random.uniform(-np.pi, np.pi)))
    friction = Friction(about(chosen.COULOMB), chain.load_gain, about(chosen.SATURATION_VELOCITY))
    return DrawnBrake(Model(motor, chain.load_torque, friction, (cogging,)), mechanism)
