# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Feedforward, equation (27), with the identified load, friction and cogging torque added."""

from __future__ import annotations

import math

from engb_core.control.trajectory import Setpoint
from engb_core.model import Model
from engb_core.physics.load_friction import load_friction_gain

__all__ = ['Feedforward']


class Feedforward:
    """u_ff = J·ω̇_d + B·ω_d, equation (27), and, each by its switch, T_L(θ_d), T_C, T_cog.

    Plain numbers throughout: it runs once a control cycle. That its torques are those of
    `engb_core.physics.plant` is held by a test.

    Attributes:
        shift: the load curve is moved by this [rad] (wear; positive: contact comes later).
        load_ratio: the load is multiplied by this (a turning disc helps or hinders).

    Args:
        model: its nominal terms are used; `effects` are not.
        load: add T_L(θ_d).
        friction: add T_C(θ_d, ω_d).
        cogging: add T_cog(θ_d).
    """

    def __init__(self, model: Model, load: bool = True, friction: bool = True,
                 cogging: bool = True) -> None:
        self.model = model
        self.load = load
        self.friction = friction
        self.cogging = cogging
        self.shift = 0.0
        self.load_ratio = 1.0
        self._coefficients = tuple(reversed(model.load_torque.coefficients))

    def torque(self, setpoint: Setpoint) -> float:
        """Return u_ff [N·m] for a set-point."""
        position, velocity, acceleration = setpoint
        motor = self.model.motor
        total = motor.inertia * acceleration + motor.viscous_friction * velocity
        if self.load or self.friction:
            load = self.load_torque(position)
            if self.load:
                total += load
            if self.friction and velocity != 0.0:
                total += self.friction_torque(load, velocity)
        if self.cogging and self.model.cogging:
            total += self.cogging_torque(position)
        return total

    def load_torque(self, position: float) -> float:
        """Return T_L [N·m] at `position` [rad]."""
        load = self.model.load_torque
        if load.form == 'sinusoid':
            return load.amplitude * math.sin(position + load.phase)
        position -= self.shift
        if load.contact_angle is not None:
            position -= load.contact_angle
            if position < 0.0:
                return 0.0
        total = 0.0
        for coefficient in self._coefficients:
            total = total * position + coefficient
        return total * self.load_ratio

    def friction_torque(self, load: float, velocity: float) -> float:
        """Return T_C [N·m] at load torque `load` [N·m] and `velocity` [rad/s]."""
        friction = self.model.friction
        saturation = min(max(velocity / friction.saturation_velocity, -1.0), 1.0)
        gain = load_friction_gain(friction.load_gain, friction.load_curvature,
                                  friction.reference_load, load)
        return (friction.coulomb + gain * abs(load)) * saturation

    def cogging_torque(self, position: float) -> float:
        """Return T_cog [N·m] at `position` [rad]."""
        total = 0.0
        for entry in self.model.cogging:
            total += entry.amplitude * math.sin(entry.order * position + entry.phase)
        return total
