# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Drive of the truth plant: what becomes of the measured torque-producing current.

Saturation: 1 inverse root, 2 tanh, 3 a soft knee. Lag: 1 dead time, 2 damped second order, 3 two
equal first orders, 4 mean over a window. Ripple and cogging: 1 a tone with weak odd harmonics, 2 a
skewed wave, 3 a pulse per period.
"""
from __future__ import annotations

from math import cos, exp, log, pi, sin, sqrt, tanh

from numba import njit

__all__ = ['cogging_torque', 'delivered', 'RING', 'ripple_factor', 'wave', 'weakened']

RING = 2048
_ZETA = 0.8


@njit(cache=True)
def wave(kind, a, second, second_phase):
    """One period in `a` = order·θ + phase; `second` shapes it."""
    if kind == 1:
        return sin(a) + second * (0.8 * sin(3.0 * a + second_phase)
                                  + 0.6 * sin(5.0 * a - second_phase))
    if kind == 2:
        return sin(a + second * sin(a))
    mean = term = 1.0
    for k in range(1, 12):      # the mean of exp(second·cos a)
        term *= (0.5 * second / k) ** 2
        mean += term
    return exp(second * (cos(a) - 1.0)) - exp(-second) * mean


@njit(cache=True)
def cogging_torque(p, theta, t):
    """Torque periodic in the shaft angle, and vibration of fixed frequency from outside."""
    torque = 0.0
    if p.cog_kind > 0:
        a = p.cog_order * theta + p.cog_phase
        torque = p.cog * wave(p.cog_kind, a, p.cog_second, p.cog_second_phase)
    if p.vibe_kind == 1:
        torque += p.vibe * sin(2.0 * pi * p.vibe_hertz * t + p.vibe_phase)
    elif p.vibe_kind == 2:
        beat = 1.0 + 0.5 * sin(2.0 * pi * 0.11 * t)
        torque += p.vibe * beat * sin(2.0 * pi * p.vibe_hertz * t + p.vibe_phase)
    return torque


@njit(cache=True)
def ripple_factor(p, theta):
    """Delivered / asked torque over one revolution (torque_ripple)."""
    if p.ripple_kind == 0:
        return 1.0
    a = p.ripple_order * theta + p.ripple_phase
    return 1.0 + p.ripple * wave(p.ripple_kind, a, p.ripple_second, 1.0)


@njit(cache=True)
def weakened(p, torque):
    """Torque per ampere falls at high current (torque_saturation)."""
    if p.weak_kind == 0:
        return torque
    size = abs(torque)
    if p.weak_kind == 1:
        size = size / sqrt(1.0 + (p.weak * size / p.weak_at) ** 2)
    elif p.weak_kind == 2:
        scale = p.weak_at / p.weak
        size = scale * tanh(size / scale)
    else:
        soft = 0.12 * p.weak_at
        size -= p.weak * soft * (log(1.0 + exp((size - p.weak_at) / soft))
                                 - log(1.0 + exp(-p.weak_at / soft)))
    return size if torque > 0.0 else -size


@njit(cache=True)
def delivered(p, states, ring, index, current, theta, heated, dt):
    """Torque on the shaft for the measured `current` [N·m]; advances lag states over dt."""
    torque = current
    if p.lag_kind == 1:
        late = int(p.lag / dt + 0.5)
        ring[index % ring.size] = current
        torque = ring[(index - late) % ring.size]
    elif p.lag_kind == 2:
        natural = 2.0 * _ZETA / p.lag
        states[1] += dt * (natural * natural * (current - states[0])
                           - 2.0 * _ZETA * natural * states[1])
        states[0] += dt * states[1]
        torque = states[0]
    elif p.lag_kind == 3:
        states[0] += (current - states[0]) * dt / (0.5 * p.lag)
        states[1] += (states[0] - states[1]) * dt / (0.5 * p.lag)
        torque = states[1]
    elif p.lag_kind == 4:
        window = int(2.0 * p.lag / dt + 0.5)
        states[0] += (current - ring[(index - window) % ring.size]) / window
        ring[index % ring.size] = current
        torque = states[0]
    torque = weakened(p, torque) * ripple_factor(p, theta)
    return torque * (1.0 - p.heat * heated)
