# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Elements that follow a motion until they slip: memory of every turning point not yet passed.

A sum of stop operators (Maxwell slip; Iwan, J. Appl. Mech. 33 (1966) 893; Prandtl-Ishlinskii).
Where an exponential memory forgets a turning point, they keep it until it is passed again.
"""

from __future__ import annotations

from engb_core.physics.compiled import compiled, Numbers

__all__ = ['ELEMENTS', 'moved_elements', 'start_elements']

ELEMENTS = 8
_BUILT_UP = 0.632


@compiled
def _built_up(way: float, widest: float, shape: float) -> float:
    """Return the part of a full turn-round, 0 to 1, that is done after `way` [rad]."""
    total = 0.0
    for index in range(ELEMENTS):
        total += min(0.5 * way / (widest * ((index + 0.5) / ELEMENTS) ** shape), 1.0)
    return total / ELEMENTS


@compiled
def _widest(shape: float) -> float:
    """Return the slip distance of the last element for which 63 % are done after 1 rad."""
    low, high = 0.05, 50.0
    for _ in range(40):
        middle = (low * high) ** 0.5
        if _built_up(1.0, middle, shape) > _BUILT_UP:
            low = middle
        else:
            high = middle
    return low


@compiled
def start_elements(state: Numbers, first: int, part: float) -> None:
    """Let the elements at state[first…first + ELEMENTS] have gone a part of the way, −1 to 1, to
    where they slip."""
    for index in range(ELEMENTS):
        state[first + index] = part


@compiled
def moved_elements(state: Numbers, first: int, way: float, distance: float, shape: float) -> float:
    """Move the elements at state[first…first + ELEMENTS] by `way` [rad]; return their mean.

    After a turn-round 63 % of the way from −1 to 1 are done after `distance` [rad]; above 1,
    `shape` lets the rest take longer. The ELEMENTS places behind them hold the inverse of their
    slip distances, and have to be 0 before the first call.
    """
    slips = first + ELEMENTS
    if state[slips] == 0.0:
        widest = _widest(shape) * distance
        for index in range(ELEMENTS):
            state[slips + index] = 1.0 / (widest * ((index + 0.5) / ELEMENTS) ** shape)
    # Once the last one slips, all others do.
    if way > 0.0 and state[slips - 1] >= 1.0:
        return 1.0
    if way < 0.0 and state[slips - 1] <= -1.0:
        return -1.0
    total = 0.0
    for index in range(ELEMENTS):
        place = state[first + index] + way * state[slips + index]
        place = min(max(place, -1.0), 1.0)
        state[first + index] = place
        total += place
    return total / ELEMENTS
