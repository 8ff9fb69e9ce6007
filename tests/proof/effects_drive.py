"""Drive of the truth plant: what becomes of the measured torque-producing current.

Saturation: 1 cubic loss, 2 tanh, 3 a knee. Lag: 1 dead time, 2 first order, 3 two equal first
orders. Ripple and cogging: 1 a tone with a weak second, 2 a skewed wave.
"""
from __future__ import annotations

from math import pi, sin, tanh

from numba import njit

__all__ = ['cogging_torque', 'delivered', 'ripple_factor', 'weakened']


@njit(cache=True)
def cogging_torque(p, theta, t):
    """Torque periodic in the shaft angle, and vibration of fixed frequency from outside."""
    torque = 0.0
    if p.cog_kind == 1:
        a = p.cog_order * theta
        torque = p.cog * (sin(a + p.cog_phase) + p.cog_second * sin(2.0 * a + p.cog_second_phase))
    elif p.cog_kind == 2:
        a = p.cog_order * theta + p.cog_phase
        torque = p.cog * sin(a + p.cog_second * sin(a))
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
    if p.ripple_kind == 1:
        return 1.0 + p.ripple * (sin(a) + 0.15 * sin(2.0 * a + 1.0))
    return 1.0 + p.ripple * sin(a + 0.3 * sin(a))


@njit(cache=True)
def weakened(p, torque):
    """Torque per ampere falls at high current (torque_saturation)."""
    if p.weak_kind == 0:
        return torque
    size = abs(torque)
    if p.weak_kind == 1:
        size = size * (1.0 - p.weak * (size / p.weak_at) ** 2)
    elif p.weak_kind == 2:
        scale = p.weak_at / p.weak
        size = scale * tanh(size / scale)
    elif size > p.weak_at:
        size = p.weak_at + (1.0 - p.weak) * (size - p.weak_at)
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
        states[0] += (current - states[0]) * dt / p.lag
        torque = states[0]
    elif p.lag_kind == 3:
        states[0] += (current - states[0]) * dt / (0.5 * p.lag)
        states[1] += (states[0] - states[1]) * dt / (0.5 * p.lag)
        torque = states[1]
    torque = weakened(p, torque) * ripple_factor(p, theta)
    return torque * (1.0 - p.heat * heated)
