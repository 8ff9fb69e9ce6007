# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Friction of the truth plant: capacity over speed, load, time and place; bristle states.

Each function takes the plant record `p` (plant_record.PLANT) and is compiled.
Stribeck curves: 1 hyperbolic secant, 2 inverse square, 3 Lorentzian (Hess and Soom 1990), 4 tanh
(Makkar 2005); not the exponentials of the library. Bristles: 1 LuGre with bristle damping (Canudas
de Wit 1995), 2 Maxwell-slip elements (Lampaert 2003), 3 elastoplastic (Dupont 2002).
"""
from __future__ import annotations

from math import acosh, atanh, cosh, exp, log, pi, sin, sqrt, tanh

from numba import njit
import numpy as np

__all__ = ['advance_bristle', 'asymmetry_share', 'capacity', 'drag_torque', 'stribeck_excess',
           'warmth']

# a tanh curve has fallen to 1/e where tanh x = 1 - 1/e
_TANH_AT = atanh(1.0 - exp(-1.0))
_LORENTZ_AT = sqrt(exp(1.0) - 1.0)
_SECANT_AT = acosh(exp(1.0))
_SQUARE_AT = exp(0.5) - 1.0


@njit(cache=True)
def stribeck_excess(kind, ratio):
    """Share of the breakaway excess left at speed/Stribeck speed = `ratio` (1/e at 1)."""
    if kind == 1:
        return 1.0 / cosh(min(_SECANT_AT * ratio, 300.0))
    if kind == 2:
        x = 1.0 + _SQUARE_AT * ratio
        return 1.0 / (x * x)
    if kind == 3:
        x = _LORENTZ_AT * ratio
        return 1.0 / (1.0 + x * x)
    return 1.0 - tanh(_TANH_AT * ratio)


@njit(cache=True)
def warmth(p, t):
    """Factor on all friction at time `t` (friction_drift); 1 at the start.

    1 as the root of time (heat that diffuses), 2 logistic (a film that gives way).
    """
    if p.drift_kind == 0:
        return 1.0
    if p.drift_kind == 1:
        return 1.0 + p.drift * sqrt(t / p.drift_time)
    start = 1.0 / (1.0 + exp(p.drift_at / p.drift_time))
    now = 1.0 / (1.0 + exp((p.drift_at - t) / p.drift_time))
    return 1.0 + p.drift * (now - start) / (1.0 - start)


@njit(cache=True)
def asymmetry_share(p, omega):
    """How much of the asymmetry acts at this speed (1 where it does not depend on speed)."""
    if p.asym_speed <= 0.0:
        return 1.0
    return 0.5 + 0.5 * tanh(abs(omega) / p.asym_speed)


@njit(cache=True)
def capacity(p, coulomb, gain, load, theta, omega, sign, t, rested, slipped):
    """Largest friction torque [N·m] in direction `sign`, for load torque `load`."""
    size = abs(load)
    loaded = gain * size
    if p.gain_knee > 0.0:
        loaded = gain * size / (1.0 + size / p.gain_knee)
    elif p.gain_power != 1.0 and size > 0.0:
        loaded = gain * p.gain_scale * (size / p.gain_scale) ** p.gain_power
    uneven = sign * asymmetry_share(p, omega)
    level = coulomb * (1.0 + p.asym_coulomb * uneven) + loaded * (1.0 + p.asym_load * uneven)
    if p.stribeck_kind > 0:
        x = abs(omega) / p.stribeck_velocity
        level *= 1.0 + (p.stribeck_ratio - 1.0) * stribeck_excess(p.stribeck_kind, x)
    level *= warmth(p, t)
    if p.patch_kind == 1:
        level *= 1.0 + p.patch * sin(2.0 * pi * (theta - p.patch_at) / p.patch_length)
    elif p.patch_kind == 2:
        x = (theta - p.patch_at) / p.patch_length
        level *= 1.0 + p.patch / (1.0 + x * x * x * x)
    if p.age > 0.0:
        level *= 1.0 + p.age * log(1.0 + rested / p.age_time) * exp(-slipped / p.age_slip)
    if p.fault_kind == 1 and p.fault_from < t < p.fault_to:
        level *= 1.0 + p.fault * sin(pi * (t - p.fault_from) / (p.fault_to - p.fault_from)) ** 2
    if p.spur != 0.0:
        level += p.spur * size * abs(omega) / (1.0 + abs(omega) / p.spur_speed)
    return level


@njit(cache=True)
def drag_torque(p, omega):
    """Drag beyond the linear one: 1 churning from a speed on, 2 power law, 3 thinning square."""
    speed = abs(omega)
    if p.drag_kind == 0 or speed == 0.0:
        return 0.0
    if p.drag_kind == 1:
        size = p.drag * speed * speed * (1.0 - exp(-speed / p.drag_shape))
    elif p.drag_kind == 2:
        size = p.drag * 900.0 * (speed / 30.0) ** p.drag_shape
    else:
        size = p.drag * speed * speed / (1.0 + speed / p.drag_shape)
    return size if omega > 0.0 else -size


@njit(cache=True)
def advance_bristle(p, states, omega, dt):
    """Advance the bristle states over dt; returns friction / capacity, about within ±1."""
    dx = omega * dt
    if p.bristle_kind == 1:
        step = abs(dx) / p.bristle_length
        z = states[0] * exp(-step)
        z += (1.0 - exp(-step)) * (1.0 if dx > 0.0 else -1.0)
        rate = (z - states[0]) / dt
        states[0] = z
        return z + p.bristle_damping * rate
    if p.bristle_kind == 2:
        total = 0.0
        for i in range(6):
            z = states[i] + dx / p.slip_length[i]
            z = min(1.0, max(-1.0, z))
            states[i] = z
            total += p.slip_weight[i] * z
        return total
    z = states[0]
    sign = 1.0 if dx > 0.0 else -1.0
    plastic = 0.0
    if z * sign > p.bristle_elastic:
        x = (z * sign - p.bristle_elastic) / (1.0 - p.bristle_elastic)
        plastic = 1.0 if x >= 1.0 else 0.5 - 0.5 * np.cos(pi * x)
    z += dx / p.bristle_length * (1.0 - plastic * z * sign)
    z = min(1.0, max(-1.0, z))
    states[0] = z
    return z
