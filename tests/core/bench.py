# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A brake bench for tests: plain Python, its own integrator and formulas.

It judges the diagnosis, so it shares nothing with the plant that the project simulates; friction
here is smooth (tanh), where the library's is a clipped line.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math

import numpy as np

from engb_core.recording import Recording, Reference

__all__ = ['Bench', 'strokes']


def strokes(tops: tuple[float, ...] = (20.0, 12.0, 18.0, 8.0, 20.0, 15.0), rate: float = 500.0,
            acceleration: float = 80.0, dwell: float = 0.25) -> np.ndarray:
    """Return a reference (n,): strokes 0 → top → 0, smooth (half cosines), with stops."""
    pieces = [np.zeros(round(dwell * rate))]
    for top in tops:
        size = round(math.pi * math.sqrt(top / (2.0 * acceleration)) * rate * 1.5)
        rise = 0.5 * top * (1.0 - np.cos(np.pi * np.arange(size) / size))
        stop = np.full(round(dwell * rate), top)
        pieces += [rise, stop, top - rise, np.zeros(round(dwell * rate))]
    return np.concatenate(pieces)


@dataclass
class Bench:
    """The truth: numbers, and two hooks for what the model leaves out.

    Attributes:
        rubbing: (friction level [N·m], velocity [rad/s]) → friction torque [N·m].
        further: (position, velocity) → a torque on top [N·m].
    """

    inertia: float = 6.813e-5
    viscous: float = 1.125e-3
    load: tuple[float, ...] = (0.0, 1e-3, 2e-4, 5e-6)
    coulomb: float = 0.012
    load_gain: float = 0.11
    width: float = 0.03
    rubbing: Callable[[float, float], float] | None = None
    further: Callable[[float, float], float] | None = None
    noise: float = 2e-3
    counts: int = 4096
    seed: int = 1

    def _torque(self, position: float, velocity: float) -> float:
        load = 0.0
        for coefficient in reversed(self.load):
            load = load * position + coefficient
        level = self.coulomb + self.load_gain * abs(load)
        if self.rubbing is None:
            friction = level * math.tanh(velocity / self.width)
        else:
            friction = self.rubbing(level, velocity)
        rest = 0.0 if self.further is None else self.further(position, velocity)
        return load + friction + self.viscous * velocity + rest

    def run(self, reference: np.ndarray, rate: float = 500.0, inner: int = 32,
            name: str = 'run') -> Recording:
        """Track `reference` (n,) with PID and nominal feedforward; return what is recorded."""
        rng = np.random.default_rng(self.seed)
        tick, step = 1.0 / rate, 1.0 / rate / inner
        speed = np.gradient(reference, tick)
        push = np.gradient(speed, tick) * 6.8e-5 + 1.1e-3 * speed
        count = 2.0 * math.pi / self.counts
        position, velocity, integral = float(reference[0]), 0.0, 0.0
        positions, efforts = np.empty(reference.size), np.empty(reference.size)
        for row in range(reference.size):
            seen = round(position / count) * count
            error = float(reference[row]) - seen
            integral = min(0.4, max(-0.4, integral + 1.0 * error * tick))
            effort = (0.3 * error + integral + 0.004 * (float(speed[row]) - velocity)
                      + float(push[row]))
            effort = min(0.6, max(-0.6, effort))
            positions[row], efforts[row] = seen, effort
            for _ in range(inner):
                # Heun: slope at both ends of the step.
                first = (effort - self._torque(position, velocity)) / self.inertia
                ahead = velocity + step * first
                second = (effort - self._torque(position + step * velocity, ahead)) / self.inertia
                fresh = velocity + 0.5 * step * (first + second)
                position += 0.5 * step * (velocity + fresh)
                velocity = fresh
        time = np.arange(reference.size) * tick
        return Recording.from_samples(
            name, time, positions, efforts + rng.normal(0.0, self.noise, time.size),
            reference=Reference(time, reference, speed, push))
