# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Mechanisms outside the library that no file of engb_core describes; one at a time in a plant.

`odd_kind` chooses one, `odd` is its size, `odd_a` and `odd_b` shape it; `s` holds its states.
Drive: 1 dead zone (a: width of its edge), 2 another torque per ampere for negative current, 3
torque per ampere that falls with speed (a: speed), 4 supply voltage that pulsates (a: Hz), 5 slew
of the current (odd: s per N·m), 6 remanence of the current sensor (a: width). Friction: 7 grows
with acceleration, 8 a film that builds above a and breaks below b, 9 a rub after each reversal
that goes with time (a: s), 10 follows the load late (a: s), 11 less of it while the disc turns (a:
disc speed). Drag: 12 in the pad, in contact, 13 of grease that thins with distance (a: rad). 14
inertia over the angle (a: cycles per rad, b: phase). Load: 15 contact that recedes with the work
done, 16 contact that moves with the pad's temperature.
"""
from __future__ import annotations

from math import cos, exp, pi, sin, sqrt, tanh

from numba import njit

__all__ = ['odd_drag', 'odd_drive', 'odd_friction', 'odd_inertia', 'odd_shift', 'STATES']

STATES = 6


@njit(cache=True)
def odd_drive(p, s, torque, omega, t, dt):
    """Torque on the shaft [N·m]."""
    kind = p.odd_kind
    if kind == 1:
        size = abs(torque)
        left = size - p.odd + p.odd * exp(-size / p.odd_a) if size > 0.0 else 0.0
        return max(0.0, left) * (1.0 if torque > 0.0 else -1.0)
    if kind == 2:
        return torque * (1.0 - p.odd) if torque < 0.0 else torque
    if kind == 3:
        return torque * (1.0 - p.odd * (1.0 - 1.0 / sqrt(1.0 + (omega / p.odd_a) ** 2)))
    if kind == 4:
        return torque * (1.0 + p.odd * sin(2.0 * pi * p.odd_a * t + p.odd_b))
    if kind == 5:
        most = dt / p.odd
        s[0] += min(most, max(-most, torque - s[0]))
        return s[0]
    if kind == 6:
        s[0] = min(torque + p.odd_a, max(torque - p.odd_a, s[0]))
        return torque - p.odd * (torque - s[0]) / p.odd_a
    return torque


@njit(cache=True)
def odd_friction(p, s, level, omega, acceleration, load, disc, dt):
    """Largest friction torque [N·m]; advances the states over dt."""
    kind = p.odd_kind
    if kind == 7:
        s[0] += (abs(acceleration) - s[0]) * dt / 0.004
        return level + p.odd * s[0]
    if kind == 8:
        if abs(omega) > p.odd_a:
            s[0] = 1.0
        elif abs(omega) < p.odd_b:
            s[0] = 0.0
        s[1] += (s[0] - s[1]) * dt / 0.03
        return level * (1.0 - p.odd * s[1])
    if kind == 9:
        sign = 1.0 if omega > 1e-3 else (-1.0 if omega < -1e-3 else 0.0)
        if sign * s[0] < 0.0:
            s[1] = 0.0
        if sign != 0.0:
            s[0] = sign
        s[1] += dt
        return level * (1.0 + p.odd * exp(-s[1] / p.odd_a))
    if kind == 10:
        s[0] += (abs(load) - s[0]) * dt / p.odd_a
        return level + p.odd * s[0]
    if kind == 11:
        return level * (1.0 - p.odd * tanh(abs(disc) / p.odd_a))
    return level


@njit(cache=True)
def odd_drag(p, s, omega, slope, dt):
    """Drag [N·m] beside that of the plant; `slope` of the load curve [N·m/rad]."""
    if p.odd_kind == 12:
        return p.odd * slope * omega
    if p.odd_kind == 13:
        s[0] += abs(omega) * dt
        return p.odd * omega * exp(-s[0] / p.odd_a)
    return 0.0


@njit(cache=True)
def odd_inertia(p, theta):
    """Inertia over its mean, and half its slope [1/rad], which acts on the speed squared."""
    if p.odd_kind != 14:
        return 1.0, 0.0
    turn = p.odd_a * theta + p.odd_b
    return 1.0 + p.odd * sin(turn), 0.5 * p.odd * p.odd_a * cos(turn)


@njit(cache=True)
def odd_shift(p, s, load, omega, temperature, dt):
    """How far the load curve has moved along the angle [rad]."""
    if p.odd_kind == 15:
        s[0] += abs(load * omega) * dt
        return p.odd * s[0]
    if p.odd_kind == 16:
        return -p.odd * (temperature - 40.0) / 50.0
    return 0.0
