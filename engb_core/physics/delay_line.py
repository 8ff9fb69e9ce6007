# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a signal was some time ago, for effects that run forward in time."""

from __future__ import annotations

import math

from engb_core.effects.base import STATE_SIZE
from engb_core.physics.compiled import compiled, Numbers

__all__ = ['delayed']

# Places in the state: the past values' places filled so far, time and value·time gathered for the
# next; from _PAST on the past values, in a ring. Place 0 is the effect's own.
_FILLED, _TIME, _VALUE, _PAST = range(1, 5)
_RING = STATE_SIZE - _PAST


@compiled
def delayed(state: Numbers, value: float, step: float, delay: float) -> float:
    """Return the value of `delay` [s] ago, from means over stretches of a sixtieth of it."""
    stretch = step * max(1.0, math.ceil(delay / (_RING - 6) / step - 1e-9))
    if state[_FILLED] == 0.0:
        state[_PAST:] = value
        state[_FILLED] = 1.0
    state[_TIME] += step
    state[_VALUE] += value * step
    if state[_TIME] > stretch - 0.5 * step:
        state[_PAST + int(state[_FILLED]) % _RING] = state[_VALUE] / state[_TIME]
        state[_FILLED] += 1.0
        state[_TIME] = 0.0
        state[_VALUE] = 0.0
    # Now is half a step ago: a value is held over a step. A mean stands for its stretch's middle.
    back = max((delay + 0.5 * step - state[_TIME]) / stretch - 0.5, 0.0)
    whole = int(back)
    latest = int(state[_FILLED]) - 1
    newer = state[_PAST + (latest - whole) % _RING]
    older = state[_PAST + (latest - whole - 1) % _RING]
    return newer + (back - whole) * (older - newer)
