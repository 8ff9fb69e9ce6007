# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Effort whose sign is the other way round than the position's, told without any model.

Inertia and friction are never negative, so that a motor puts work into an axis that it moves to
and fro. Drives count current and angle in directions of their own; where both disagree the motor
seems to be turned by its own friction, and of a fit with numbers that are not negative nothing is
left but their bounds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from engb_core.identify.load_forms import FilteredColumns

__all__ = ['reversed_effort']

Array = NDArray[np.float64]

# Part of the mean square that effort as it stands leaves, which it leaves at most turned round:
# as for a slip of units (plausibility.py).
BETTER = 0.5


def reversed_effort(data: FilteredColumns) -> tuple[float, float] | None:
    """Return which part of the effort's variance an axis explains with the effort as it stands and
    turned round, where its sign is the wrong one; None where it is not.

    The axis has inertia, viscous and dry friction, and a load that is a straight line over the
    position. A load that drives the axis for longer than it is driven looks alike only if it turns
    with the direction of motion, as a brake does: then another machine drives it.
    """
    if float(data.effort @ data.velocity) >= 0.0:
        return None
    columns = np.stack([data.acceleration, data.velocity, data.direction,
                        np.ones_like(data.effort), data.position], axis=1)
    scale = np.sqrt(np.mean(columns ** 2, axis=0))
    columns = columns / np.where(scale > 0.0, scale, 1.0)
    low = np.array([0.0, 0.0, 0.0, -np.inf, -np.inf])

    def left(effort: Array) -> float:
        found = lsq_linear(columns, effort, (low, np.inf), method='bvls').x
        return float(np.mean((effort - columns @ found) ** 2))

    variance = float(np.var(data.effort))
    stands, turned = left(data.effort), left(-data.effort)
    if variance == 0.0 or turned > BETTER * stands:
        return None
    return 1.0 - stands / variance, 1.0 - turned / variance
