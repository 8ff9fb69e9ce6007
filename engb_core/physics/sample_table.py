# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the torque balance reads of a motion, as one table."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engb_core.effects.base import (
    ACCELERATION,
    DISC_ANGLE,
    DISC_SPEED,
    PAD_TEMPERATURE,
    POSITION,
    SAMPLE_SIZE,
    TIME,
    TIME_STEP,
    VELOCITY,
)

__all__ = ['sample_table']


def sample_table(step: float, time: ArrayLike, position: ArrayLike, velocity: ArrayLike,
                 acceleration: ArrayLike, disc_speed: ArrayLike = 0.0,
                 disc_angle: ArrayLike = 0.0,
                 pad_temperature: ArrayLike = 20.0) -> NDArray[np.float64]:
    """Return the table (n, SAMPLE_SIZE), as effects/base.py orders it; the columns of the torque
    balance's stages are still empty.

    Args:
        step: time step [s].
        time, position, velocity, acceleration: the motion, (n,) or one value for all [s, rad,
            rad/s, rad/s²].
        disc_speed, disc_angle, pad_temperature: (n,) or one value for all [rad/s, rad, °C].
    """
    columns = {TIME_STEP: step, TIME: time, POSITION: position, VELOCITY: velocity,
               ACCELERATION: acceleration, DISC_SPEED: disc_speed, DISC_ANGLE: disc_angle,
               PAD_TEMPERATURE: pad_temperature}
    table = np.zeros((np.size(time), SAMPLE_SIZE))
    for column, values in columns.items():
        table[:, column] = values
    return table
