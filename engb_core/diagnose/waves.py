# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Waves over the motor angle: which are lines among the orders, and which come too seldom."""

from __future__ import annotations

import numpy as np

from engb_core.diagnose.fit import Fitter
from engb_core.effects.base import Effect

__all__ = ['is_line', 'repeats']

# So often a wave must repeat along the stroke to be told from what stands in some places once.
REPEATS = 5.0


def repeats(fitter: Fitter, effect: Effect, values: dict[str, float]) -> bool:
    """Return whether a wave over the motor angle, if that is what the effect is, comes often
    enough to be told from the form of the load curve; one without an order comes once a turn."""
    if effect.reveals != 'motor_angle':
        return True
    low, high = fitter.problem.scene.position_range
    return values.get('order', 1.0) * (high - low) >= 2.0 * np.pi * REPEATS


def is_line(fitter: Fitter, effect: Effect, values: dict[str, float]) -> bool:
    """Return whether an effect is a wave over the motor angle that comes often enough to be a line
    among the orders."""
    return effect.reveals == 'motor_angle' and 'order' in values and repeats(
        fitter, effect, values)
