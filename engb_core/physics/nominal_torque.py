# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The nominal torques of equation (1), once: load, dry friction and cogging of a model file.

Plain Python on a vector of numbers, for the controller, which computes them once a cycle; plant.py
compiles the same functions for simulation and inverse dynamics.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from engb_core.model import Model

if TYPE_CHECKING:
    # The controller needs nothing compiled.
    from engb_core.physics.compiled import Numbers

__all__ = ['MAXIMUM_LOAD_TERMS', 'NOMINAL_SIZE', 'cogging_wave', 'friction_direction',
           'load_friction_gain', 'load_torque', 'nominal_vector']

# Places in the nominal vector.
(N_INERTIA, N_VISCOUS, N_COULOMB, N_LOAD_GAIN, N_LOAD_CURVATURE, N_REFERENCE_LOAD, N_SATURATION,
 N_CONTACT, N_FORM, N_AMPLITUDE, N_PHASE, N_DELAY, N_TERMS) = range(13)
MAXIMUM_LOAD_TERMS = 12
NOMINAL_SIZE = N_TERMS + 1 + MAXIMUM_LOAD_TERMS


def nominal_vector(model: Model) -> NDArray[np.float64]:
    """Return the model's nominal numbers as the kernels read them, (NOMINAL_SIZE,)."""
    vector = np.zeros(NOMINAL_SIZE)
    load = model.load_torque
    vector[N_INERTIA] = model.motor.inertia
    vector[N_VISCOUS] = model.motor.viscous_friction
    vector[N_COULOMB] = model.friction.coulomb
    vector[N_LOAD_GAIN] = model.friction.load_gain
    vector[N_LOAD_CURVATURE] = model.friction.load_curvature
    vector[N_REFERENCE_LOAD] = model.friction.reference_load
    vector[N_SATURATION] = model.friction.saturation_velocity
    vector[N_CONTACT] = math.nan if load.contact_angle is None else load.contact_angle
    vector[N_FORM] = float(load.form == 'sinusoid')
    vector[N_AMPLITUDE] = load.amplitude
    vector[N_PHASE] = load.phase
    vector[N_TERMS] = len(load.coefficients)
    vector[N_TERMS + 1:N_TERMS + 1 + len(load.coefficients)] = load.coefficients
    return vector


def load_torque(nominal: Numbers, position: float) -> float:
    """Return T_L(θ) of the nominal model [N·m]."""
    if nominal[N_FORM] > 0.5:
        return nominal[N_AMPLITUDE] * math.sin(position + nominal[N_PHASE])
    travel = position
    if not math.isnan(nominal[N_CONTACT]):
        travel = position - nominal[N_CONTACT]
        if travel < 0.0:
            return 0.0
    total = 0.0
    for index in range(int(nominal[N_TERMS]) - 1, -1, -1):
        total = total * travel + nominal[N_TERMS + 1 + index]
    return total


def friction_direction(velocity: float, saturation: float) -> float:
    """Return the direction of dry friction, −1 to 1: sat(ω/ω_s) at `velocity` [rad/s] with
    ω_s `saturation` [rad/s]."""
    return min(1.0, max(-1.0, velocity / saturation))


def cogging_wave(order: float, amplitude: float, phase: float, position: float) -> float:
    """Return one order of T_cog(θ) [N·m] at `position` [rad]."""
    return amplitude * math.sin(order * position + phase)


def load_friction_gain(gain: float, curvature: float, reference: float, load: float) -> float:
    """Return friction per load at `load` [-].

    It is C₁ of (42) where friction goes with load in a straight line. It does so roughly: contact
    area grows less than load does (Hertz: with its power 2/3), lubricant films thin out.

    Args:
        gain: C₁, slope of the best straight line [-].
        curvature: by this part the curve is less steep than that without load [-], within ±1.
        reference: load at which the curve, a parabola, crosses the straight line [N·m]; from its
            top, or twice this load, it goes on straight.
        load: [N·m].
    """
    if curvature == 0.0:
        return gain
    size = abs(load)
    edge = 2.0 * reference
    if curvature < 0.0:
        edge = min(edge, reference * (1.0 - curvature) / (-2.0 * curvature))
    if size <= edge:
        return gain * (1.0 + curvature * (size / reference - 1.0))
    level = edge * (1.0 + curvature * (edge / reference - 1.0))
    slope = 1.0 + curvature * (2.0 * edge / reference - 1.0)
    return gain * (level + slope * (size - edge)) / size
