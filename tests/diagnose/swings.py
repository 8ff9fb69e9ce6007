# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A smooth motion that is known to the last digit: a sum of sines."""

from collections.abc import Callable, Sequence
import math

import numpy as np

__all__ = ['swung']


def swung(time: np.ndarray, frequencies: Sequence[float], size: Callable[[float], float],
          rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return angle [rad], speed [rad/s] and acceleration [rad/s²], (n,) each, at `time` (n,) [s]:
    one sine of each of the frequencies [Hz], of the `size` [rad] that goes with it, its phase
    drawn."""
    angle, speed, acceleration = (np.zeros(time.size) for _ in range(3))
    for frequency in frequencies:
        turn, phase = 2.0 * math.pi * frequency, rng.uniform(0.0, 2.0 * math.pi)
        angle += size(frequency) * np.sin(turn * time + phase)
        speed += size(frequency) * turn * np.cos(turn * time + phase)
        acceleration -= size(frequency) * turn ** 2 * np.sin(turn * time + phase)
    return angle, speed, acceleration
