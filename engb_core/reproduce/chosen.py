# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Every number of the reproduction that the paper does not give: CHOSEN, here and nowhere else.

The mechanism's own chosen numbers are `engb_core.mechanism.kinematics.CHOSEN`. What of the paper's
numbers the brakes were made with, so that finding them again says nothing, is marked as *set*
wherever it is shown (numbers.py).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from engb_core.bench.settings import BenchSettings
from engb_core.control.pid import PidGains
from engb_core.mechanism.kinematics import CHOSEN as MECHANISM
from engb_core.model import Model, Motor

__all__ = ['ADDED_INERTIA', 'BRAKES', 'DISC_SPEED', 'FORM', 'GAINS', 'MECHANISM', 'MORE',
           'NOMINAL', 'PAD_FRICTION', 'POOR_GAINS', 'SENSORS', 'WEARING']

# Table 1 is a *classical* reading of the paper's motor, by a step test that knows no Coulomb
# friction: a motor with the friction below that reads so has these J and B. K_T is from there.
INERTIA, VISCOUS_FRICTION, TORQUE_CONSTANT = 5.62e-5, 9.3e-4, 0.0174

# Chapter 5's.
PAD_FRICTION = 0.249

# Friction that doesn't grow with load, and the speed below which friction falls off: the paper's
# Figures 14 to 16 show that it does.
COULOMB = 0.012
SATURATION_VELOCITY = 1.5

# Two waves of a motor with six slots and four poles.
COGGING = ((12.0, 4.0e-3, 0.7), (4.0, 1.5e-3, -1.1))

# The brake of the model's form: all that a fit looks for, and nothing else.
FORM = BenchSettings(
    mechanism=MECHANISM, inertia=INERTIA, viscous_friction=VISCOUS_FRICTION,
    torque_constant=TORQUE_CONSTANT, coulomb=COULOMB, saturation_velocity=SATURATION_VELOCITY,
    breakaway=COULOMB, friction_waviness=0.0, cogging=COGGING, hysteresis=0.0, creep=0.0,
    pad_friction=PAD_FRICTION, friction_by_speed=0.0, friction_by_force=0.0,
    friction_by_heat=0.0, runout=0.0)

# The same with what the model leaves out, each as large as brakes of this kind are said to have
# it: a magnet 4 % weaker than its data sheet (by which the drive goes on reckoning); friction that
# sticks and falls with speed; a screw that is not round; rubber, pads and caliper that lag and
# creep; pads whose friction depends on speed, force and heat; a disc that is not flat.
MORE = replace(
    FORM, torque_constant=0.96 * TORQUE_CONSTANT, saturation_velocity=0.0, breakaway=0.018,
    stribeck_velocity=2.0, friction_waviness=0.03, hysteresis=0.15, hysteresis_distance=1.0e-4,
    creep=0.15, creep_time=0.5, friction_by_speed=0.04, friction_by_force=0.05,
    friction_by_heat=4.0e-4, runout=1.0e-5)

BRAKES = {'form': FORM, 'more': MORE}

# The same with pads that wear and heat within a minute as others do within a month.
WEARING = replace(MORE, wear_rate=1.0e-9, heat_capacity=500.0)

# The drive: encoder, current noise.
SENSORS: dict[str, Any] = {
    'counts_per_revolution': 4096, 'effort_noise': 0.003, 'effort_resolution': 0.0002}

# The package's default gains, and gains so low that the tracking error is of the order of what
# the paper shows (its text: "low control precision").
GAINS = PidGains(p=0.4, i=1.5, d=0.006, u_clamp_max=0.75, u_clamp_min=-0.75, i_clamp_max=0.5,
                 i_clamp_min=-0.5)
POOR_GAINS = replace(GAINS, p=0.1, i=0.3, d=0.002)

# Of the wheel: some 40 km/h.
DISC_SPEED = 35.0

# A disc of known inertia, screwed to the motor's shaft to find its torque constant.
ADDED_INERTIA = 1.0e-4

# What is known before any identification: the motor's data sheet, from another brake's size.
NOMINAL = Model(motor=Motor(torque_constant=TORQUE_CONSTANT, inertia=1.0e-4,
                            viscous_friction=5.0e-4))
