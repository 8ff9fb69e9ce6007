# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Feedforward, equation (27), with the identified load, friction and cogging torque added."""

from __future__ import annotations

from engb_core.control.trajectory import Setpoint
from engb_core.model import Model
from engb_core.physics.nominal_torque import (
    cogging_wave,
    friction_direction,
    load_friction_gain,
    load_torque,
    nominal_vector,
)

__all__ = ['Feedforward']


class Feedforward:
    """u_ff = J·ω̇_d + B·ω_d, equation (27), and, each by its switch, T_L(θ_d), T_C, T_cog.

    Plain numbers throughout: it runs once a control cycle. Its torques are those of
    `engb_core.physics.nominal_torque`.

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
        self._nominal = nominal_vector(model).tolist()

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
        if self.model.load_torque.form == 'sinusoid':
            return load_torque(self._nominal, position)
        return load_torque(self._nominal, position - self.shift) * self.load_ratio

    def friction_torque(self, load: float, velocity: float) -> float:
        """Return T_C [N·m] at load torque `load` [N·m] and `velocity` [rad/s]."""
        friction = self.model.friction
        gain = load_friction_gain(friction.load_gain, friction.load_curvature,
                                  friction.reference_load, load)
        return (friction.coulomb + gain * abs(load)) * friction_direction(
            velocity, friction.saturation_velocity)

    def cogging_torque(self, position: float) -> float:
        """Return T_cog [N·m] at `position` [rad]."""
        total = 0.0
        for entry in self.model.cogging:
            total += cogging_wave(entry.order, entry.amplitude, entry.phase, position)
        return total
