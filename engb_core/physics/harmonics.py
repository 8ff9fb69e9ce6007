# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Waves with harmonics, as slots, discs and teeth make them: none of them is sinusoidal."""

from __future__ import annotations

import math

from engb_core.physics.compiled import compiled, Numbers

__all__ = ['toothed_wave', 'wave']


@compiled
def wave(turn: float, second_sine: float, second_cosine: float) -> float:
    """Return the wave at the angle `turn` [rad], the second harmonic relative to the first."""
    return (math.sin(turn) + second_sine * math.sin(2.0 * turn)
            + second_cosine * math.cos(2.0 * turn))


@compiled
def toothed_wave(parameters: Numbers, angle: float) -> float:
    """Return the wave of slots or poles at the shaft angle [rad]; `parameters` are its size,
    order and phase, then sine and cosine of the second and the third harmonic, relative to the
    first."""
    turn = parameters[1] * angle + parameters[2]
    return parameters[0] * (
        wave(turn, parameters[3], parameters[4])
        + parameters[5] * math.sin(3.0 * turn) + parameters[6] * math.cos(3.0 * turn))
