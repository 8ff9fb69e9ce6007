# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Load of the truth plant: the curve itself, hysteresis, creep, and what the disc does to it.

Hysteresis: 1 Bouc-Wen (Wen 1976) tapered by load, 2 play operators (Prandtl-Ishlinskii) before
the curve. Creep: elements of a generalised Maxwell solid; kind 2 cannot pull. Disc: 1 pad
friction with an algebraic sign, 2 friction that builds up over 80 ms, 3 friction that falls with
pressure. Fade: 1 square of temperature, 2 a sigmoid of temperature, 3 exponential in disc speed.
Runout: 1 a force while in contact, 2 a displacement through the local stiffness.
"""
from __future__ import annotations

from math import cos, exp, pi, sin, sqrt

from numba import njit
import numpy as np

__all__ = ['curve', 'curves', 'disc_factor', 'fade_share', 'load_torque',
           'pressure_share']

_BUILD_UP = 0.08


@njit(cache=True)
def curve(p, theta):
    """Static load torque [N·m] at motor angle `theta` [rad].

    The bend is what no cubic follows: 1 a stiffer second stage, 2 a ledge, 3 a wave that fades.
    """
    s = theta
    if p.turn != 0.0:
        load = p.load[0] * sin(p.turn * s) + p.load[1] * cos(p.turn * s)
    else:
        if p.contact > -1e8:
            s = theta - p.contact
            if s < 0.0:
                return 0.0
        load = p.load[0] + s * (p.load[1] + s * (p.load[2] + s * p.load[3]))
    if p.bend_kind > 0:
        x = (s - p.bend_at) / p.bend_width
        if p.bend_kind == 1:
            load += p.bend * (0.5 * (x + sqrt(x * x + 0.02)))
        elif p.bend_kind == 2:
            load += p.bend * x / sqrt(1.0 + x * x)
        else:
            load += p.bend * sin(2.0 * x) / (1.0 + 0.1 * x * x)
    return load


@njit(cache=True)
def curves(plant, positions):
    """Static load torque [N·m] at many motor angles."""
    out = np.empty(positions.size)
    for i in range(positions.size):
        out[i] = curve(plant[0], positions[i])
    return out


@njit(cache=True)
def fade_share(p, speed, temperature):
    """How far the fade has come, 0 to about 1."""
    x = (temperature - p.fade_from) / (p.fade_to - p.fade_from)
    if p.fade_kind == 1:
        return x * abs(x)
    if p.fade_kind == 2:
        u = 4.0 * (x - 0.5)
        return 0.5 + 0.5 * u / sqrt(1.0 + u * u)
    return 1.0 - exp(-abs(speed) / p.fade_to)


@njit(cache=True)
def pressure_share(load):
    """Pad friction under this load torque, over that at 0.1 N·m: it falls as pressure rises."""
    return 1.5 / (1.0 + max(load, 0.0) / 0.2)


@njit(cache=True)
def disc_factor(p, states, load, speed, temperature, dt):
    """Load torque turning / standing, at this load, disc speed and pad temperature."""
    if p.self_kind == 0 and p.fade_kind == 0:
        return 1.0
    x = speed / p.self_speed
    turning = x / sqrt(1.0 + x * x)
    if p.self_kind == 2:
        states[0] += (turning - states[0]) * dt / _BUILD_UP
        turning = states[0]
    gain = p.self_gain
    if p.self_kind == 3:
        gain *= pressure_share(load)
    factor = 1.0 + gain * turning
    if p.fade_kind > 0:
        factor += p.fade * turning * fade_share(p, speed, temperature)
    return factor


@njit(cache=True)
def _with_hysteresis(p, states, theta, previous):
    if p.hyst_kind == 0:
        return curve(p, theta)
    if p.hyst_kind == 1:
        dx = (theta - previous) / p.hyst_length
        z = states[0]
        rising = 1.0 if dx * z > 0.0 else -1.0
        z += dx * (1.0 - z * z * (p.hyst_shape * rising + 1.0 - p.hyst_shape))
        z = min(1.0, max(-1.0, z))
        states[0] = z
        load = curve(p, theta)
        taper = max(load, 0.0) / (max(load, 0.0) + 0.15 * p.hyst_peak)
        return load + p.hyst * p.hyst_peak * taper * z
    total = 0.0
    for i in range(5):
        q = states[i]
        reach = p.play_radius[i] * p.hyst
        q = min(theta + reach, max(theta - reach, q))
        states[i] = q
        total += p.play_weight[i] * curve(p, q)
    return total


@njit(cache=True)
def load_torque(p, hyst, creep, disc, theta, previous, t, speed, angle, temperature, dt):
    """Load torque [N·m] with memory; advances the states `hyst`, `creep`, `disc` over dt.

    creep[5] holds the elastic load of the step before; `angle` is the disc's (not recorded).
    """
    load = _with_hysteresis(p, hyst, theta, previous)
    if p.creep_kind > 0:
        change = load - creep[5]
        creep[5] = load
        soft = 0.0
        whole = 0.0
        for i in range(5):
            part = p.creep_part[i]
            if part > 0.0:
                decay = dt / p.creep_time[i]
                creep[i] += part * change - creep[i] * decay
                soft += creep[i]
                whole += part
        relaxed = (1.0 - whole) * load + soft
        if p.creep_kind == 2 and relaxed < 0.0:
            relaxed = min(0.0, load)
        load = relaxed
    load *= disc_factor(p, disc, load, speed, temperature, dt)
    if p.runout_kind > 0 and abs(speed) > 0.0:
        turn = angle + p.runout_phase
        wave = sin(turn) + p.runout_second * sin(2.0 * turn + p.runout_shape)
        if p.runout_kind == 1:
            load += p.runout * wave * max(load, 0.0) / (max(load, 0.0) + 0.02)
        else:
            load += (curve(p, theta + p.runout * wave) - curve(p, theta))
    if p.dent_kind > 0:
        x = (theta - p.dent_at) / p.dent_width
        if p.dent_kind == 1:
            load += p.dent * exp(-x * x)
        else:
            load += p.dent * x * exp(0.5 - 0.5 * x * x)
    if p.fault_kind == 2 and p.fault_from < t < p.fault_to:
        load += p.fault * sin(pi * (t - p.fault_from) / (p.fault_to - p.fault_from)) ** 2
    return load
