"""A wave with a second harmonic, as slots, discs and teeth make it: none of them is sinusoidal."""

from __future__ import annotations

import math

from engb_core.compiled import compiled

__all__ = ['wave']


@compiled
def wave(turn: float, second_sine: float, second_cosine: float) -> float:
    """Return the wave at the angle `turn` [rad], the second harmonic relative to the first."""
    return (math.sin(turn) + second_sine * math.sin(2.0 * turn)
            + second_cosine * math.cos(2.0 * turn))
