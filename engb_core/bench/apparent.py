# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The bench brake as a perfect identification would see it through its drive."""

from __future__ import annotations

from dataclasses import replace

from engb_core.bench.settings import BenchSettings
from engb_core.mechanism.statics import load_polynomial
from engb_core.model import Cogging, Friction, Model, Motor

__all__ = ['apparent_model']

# Of a brake that sticks the model's form has no saturation velocity: it only creeps below this.
STICKING_VELOCITY = 0.02


def apparent_model(settings: BenchSettings) -> Model:
    """Return the model of the brake in the drive's units: torques as assumed K_T × current.

    A drive that reckons with another torque constant than the motor has shows every torque, and
    so inertia, drag, load and friction, too large by one over the other. The load is a polynomial
    fitted to the whole mechanism's (its error is below 1e-5 of its largest value). What the
    model's form has no place for is left out: hysteresis, creep, run-out, friction that falls
    with speed. The disc stands.
    """
    scale = settings.assumed_torque_constant / settings.torque_constant
    chain = load_polynomial(settings.mechanism)
    load = replace(chain.load_torque, coefficients=tuple(
        scale * value for value in chain.load_torque.coefficients))
    waves = tuple(Cogging(order, scale * amplitude, phase)
                  for order, amplitude, phase in settings.cogging)
    friction = Friction(scale * settings.coulomb, chain.load_gain,
                        settings.saturation_velocity or STICKING_VELOCITY)
    motor = Motor(settings.assumed_torque_constant, scale * settings.inertia,
                  scale * settings.viscous_friction)
    return Model(motor, load, friction, waves)
