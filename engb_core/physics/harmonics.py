# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Waves with harmonics, as slots, discs and teeth make them: none of them is sinusoidal."""

from __future__ import annotations

import math

from engb_core.physics.compiled import compiled, Numbers

__all__ = ['toothed_wave', 'wave']


@compiled
def _with_second(sine: float, cosine: float, second_sine: float, second_cosine: float) -> float:
    """Return the wave at an angle of this sine and cosine. Those of its multiples follow from
    them: a sine takes longer than all else that most effects do."""
    return (sine + second_sine * 2.0 * sine * cosine
            + second_cosine * (1.0 - 2.0 * sine * sine))


@compiled
def wave(turn: float, second_sine: float, second_cosine: float) -> float:
    """Return the wave at the angle `turn` [rad], the second harmonic relative to the first."""
    return _with_second(math.sin(turn), math.cos(turn), second_sine, second_cosine)


@compiled
def toothed_wave(parameters: Numbers, angle: float) -> float:
    """Return the wave of slots or poles at the shaft angle [rad]; `parameters` are its size,
    order and phase, then sine and cosine of the second and the third harmonic, relative to the
    first."""
    turn = parameters[1] * angle + parameters[2]
    sine = math.sin(turn)
    cosine = math.cos(turn)
    return parameters[0] * (
        _with_second(sine, cosine, parameters[3], parameters[4])
        + parameters[5] * sine * (3.0 - 4.0 * sine * sine)
        + parameters[6] * cosine * (4.0 * cosine * cosine - 3.0))
