"""A wave with harmonics, as slots, discs and teeth make it: none of them is sinusoidal."""

from __future__ import annotations

import math

from engb_core.compiled import compiled

__all__ = ['toothed_wave', 'wave']


@compiled
def wave(turn: float, second_sine: float, second_cosine: float) -> float:
    """Return the wave at the angle `turn` [rad], the second harmonic relative to the first."""
    return (math.sin(turn) + second_sine * math.sin(2.0 * turn)
            + second_cosine * math.cos(2.0 * turn))


@compiled
def toothed_wave(turn: float, harmonics) -> float:
    """Return the wave of slots or poles at `turn` [rad]; `harmonics` are sine and cosine of the
    second, then of the third, relative to the first."""
    return (wave(turn, harmonics[0], harmonics[1]) + harmonics[2] * math.sin(3.0 * turn)
            + harmonics[3] * math.cos(3.0 * turn))
