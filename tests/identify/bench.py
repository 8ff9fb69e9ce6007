# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A brake bench for tests only: the equation of motion by Runge-Kutta, independent of engb_core.

It judges the identification, so it shares no code with the plant that the project simulates.
"""

import math

import numpy as np

from engb_core.recording import Recording

PAPER = {'inertia': 6.813e-5, 'viscous': 1.125e-3, 'load': (0.0, 1e-3, 2e-4, 5e-6),
         'contact': None, 'coulomb': 0.012, 'gain': 0.11, 'saturation': 1.5, 'cogging': ()}


def stroke_reference(top=20.0, acceleration=80.0, dwell=0.3, count=3, interval=1e-3, tops=None):
    """Position, velocity, acceleration of strokes 0 → top → 0 with constant acceleration."""
    tops = tops or [top] * count
    pieces = [np.zeros(round(dwell / interval))]
    for height in tops:
        half = max(2, round(math.sqrt(height / acceleration) / interval))
        up = np.r_[np.full(half, 1.0), np.full(half, -1.0)] * height / (half * interval) ** 2
        stop = np.zeros(round(dwell / interval))
        pieces += [up, stop, -up, stop]
    push = np.concatenate(pieces)
    speed = np.cumsum(push) * interval
    return np.cumsum(speed) * interval, speed, push


def simulate(position_reference, truth=None, seed=0, noise=3e-3, counts=4096, interval=1e-3,
             gains=(0.3, 1.0, 0.004), feedforward=True, limit=0.6, name='bench', open_loop=None):
    """Return a Recording of the bench under PID and nominal feedforward.

    `position_reference` is (position, velocity, acceleration) each (n,) at `interval`; with
    `open_loop` (n,) [N·m] the torque is given instead.
    """
    truth = PAPER | (truth or {})
    rng = np.random.default_rng(seed)
    inertia, viscous = truth['inertia'], truth['viscous']
    p0, p1, p2, p3 = truth['load']
    contact, coulomb = truth['contact'], truth['coulomb']
    gain, width, waves = truth['gain'], truth['saturation'], truth['cogging']

    def acceleration(theta, omega, torque):
        s = theta if contact is None else theta - contact
        load = p0 + s * (p1 + s * (p2 + s * p3)) if contact is None or s > 0 else 0.0
        rub = (coulomb + gain * abs(load)) * max(-1.0, min(1.0, omega / width))
        for order, amplitude, phase in waves:
            load += amplitude * math.sin(order * theta + phase)
        return (torque - viscous * omega - load - rub) / inertia

    target, target_speed, push = (np.asarray(part) for part in position_reference)
    step, inner = interval / 4, 4
    theta = float(target[0])
    omega = integral = 0.0
    count = 2 * math.pi / counts
    last = round(theta / count) * count
    speed = 0.0
    noises = rng.normal(0.0, noise, target.size)
    positions, efforts = np.empty(target.size), np.empty(target.size)
    for k in range(target.size):
        seen = round(theta / count) * count
        speed += 0.2 * ((seen - last) / interval - speed)
        last = seen
        if open_loop is None:
            error = target[k] - seen
            torque = gains[0] * error + integral + gains[2] * (target_speed[k] - speed)
            if feedforward:
                torque += PAPER['inertia'] * push[k] + PAPER['viscous'] * target_speed[k]
            if abs(torque) < limit:
                integral += gains[1] * error * interval
            torque = max(-limit, min(limit, torque))
        else:
            torque = float(open_loop[k])
        positions[k], efforts[k] = seen, torque + noises[k]
        for _ in range(inner):
            a1 = acceleration(theta, omega, torque)
            a2 = acceleration(theta + 0.5 * step * omega, omega + 0.5 * step * a1, torque)
            w2 = omega + 0.5 * step * a1
            w3 = omega + 0.5 * step * a2
            a3 = acceleration(theta + 0.5 * step * w2, w3, torque)
            w4 = omega + step * a3
            a4 = acceleration(theta + step * w3, w4, torque)
            theta += step / 6 * (omega + 2 * w2 + 2 * w3 + w4)
            omega += step / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return Recording.from_samples(name, np.arange(target.size) * interval, positions, efforts)
