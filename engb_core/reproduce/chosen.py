"""Every number of the reproduction that the paper does not give: CHOSEN, here and nowhere else.

The mechanism's own chosen numbers are `engb_core.kinematics.CHOSEN`. Nothing is chosen so that a
result comes near the paper's; the gains are the package's defaults.
"""

from __future__ import annotations

from dataclasses import replace

from engb_core.control.pid import PidGains
from engb_core.kinematics import CHOSEN as MECHANISM
from engb_core.model import Cogging, Friction, LoadTorque, Model, Motor
from engb_core.statics import load_polynomial

__all__ = ['ADDED_INERTIA', 'DISC_SPEED', 'free_motor', 'GAINS', 'MECHANISM', 'NOMINAL',
           'PAD_FRICTION', 'POOR_GAINS', 'SENSORS', 'STICKING_VELOCITY', 'true_brake']

# The motor is the paper's (Table 1); pad friction too (chapter 5).
MOTOR = Motor(torque_constant=0.0174, inertia=6.813e-5, viscous_friction=1.125e-3)
PAD_FRICTION = 0.249

# Friction that doesn't grow with load, and the speed below which friction falls off: the paper's
# Figures 14 to 16 show that it does. A brake that sticks, as (13) has it, saturates at so small a
# speed that below it only creeps.
COULOMB = 0.012
SATURATION_VELOCITY = 1.5
STICKING_VELOCITY = 0.02

# Two waves of a motor with six slots and four poles.
COGGING = (Cogging(12.0, 4.0e-3, 0.7), Cogging(4.0, 1.5e-3, -1.1))

# The drive: encoder, current noise.
SENSORS = {'counts_per_revolution': 4096, 'effort_noise': 0.003, 'effort_resolution': 0.0002}

# The package's default gains, and gains so low that the tracking error is of the order of what
# the paper shows (its text: "low control precision").
GAINS = PidGains(p=0.4, i=1.5, d=0.006, u_clamp_max=0.75, u_clamp_min=-0.75, i_clamp_max=0.5,
                 i_clamp_min=-0.5)
POOR_GAINS = replace(GAINS, p=0.1, i=0.3, d=0.002)

# Of the wheel: some 40 km/h.
DISC_SPEED = 35.0

# A disc of known inertia, screwed to the motor's shaft to find its torque constant.
ADDED_INERTIA = 1.0e-4

# What is known before any identification.
NOMINAL = Model(motor=MOTOR)


def true_brake(pad_friction: float = 0.0,
               saturation_velocity: float = SATURATION_VELOCITY) -> Model:
    """Return the brake that is simulated: the whole mechanism of chapter 2.

    Args:
        pad_friction: 0 with the disc standing, else μ signed by the disc's direction.
        saturation_velocity: [rad/s] of its friction.
    """
    chain = load_polynomial(MECHANISM, pad_friction)
    return Model(MOTOR, chain.load_torque, chain.friction(COULOMB, saturation_velocity), COGGING)


def free_motor(added_inertia: float = 0.0) -> Model:
    """Return the motor with the caliper taken off, `added_inertia` [kg·m²] on its shaft."""
    return Model(replace(MOTOR, inertia=MOTOR.inertia + added_inertia), LoadTorque(),
                 Friction(COULOMB, 0.0, SATURATION_VELOCITY), COGGING)
