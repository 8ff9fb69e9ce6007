# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How friction grows with load. Plain Python, for the controller; dry_friction.py compiles it."""

from __future__ import annotations

__all__ = ['load_friction_gain']


def load_friction_gain(gain: float, curvature: float, reference: float, load: float) -> float:
    """Return friction per load at `load` [-].

    It is C₁ of (42) where friction goes with load in a straight line. It does so roughly: contact
    area grows less than load does (Hertz: with its power 2/3), lubricant films thin out.

    Args:
        gain: C₁, slope of the best straight line [-].
        curvature: by this part the curve is less steep than that without load [-], within ±1.
        reference: load at which the curve, a parabola, crosses the straight line [N·m]; from its
            top, or twice this load, it goes on straight.
        load: [N·m].
    """
    if curvature == 0.0:
        return gain
    size = abs(load)
    edge = 2.0 * reference
    if curvature < 0.0:
        edge = min(edge, reference * (1.0 - curvature) / (-2.0 * curvature))
    if size <= edge:
        return gain * (1.0 + curvature * (size / reference - 1.0))
    level = edge * (1.0 + curvature * (edge / reference - 1.0))
    slope = 1.0 + curvature * (2.0 * edge / reference - 1.0)
    return gain * (level + slope * (size - edge)) / size
