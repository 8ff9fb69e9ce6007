# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a loop with given gains can do, before it is closed: hold a brake."""

from __future__ import annotations

from engb_core.control.pid import PidGains
from engb_core.errors import InputError

__all__ = ['check_holding', 'holding_torque']

# An error must have brought full torque by then [s].
HOLDING_TIME = 1.0


def holding_torque(gains: PidGains, error: float, limit: float) -> tuple[float, float]:
    """Return what an error brings within HOLDING_TIME [N·m]: at most while applying, and while
    releasing, both as magnitudes.

    It is the feedback alone: no feedforward answers an error, and a set-point may lie where the
    model knows no load. What lies within the deadband is not integrated, and the integral part
    goes no farther than its own limits.

    Args:
        gains: of the loop.
        error: that lasts [rad].
        limit: of the torque [N·m].
    """
    integrated = 0.0 if error < gains.error_deadband else gains.i * error * HOLDING_TIME
    return (min(gains.p * error + min(integrated, gains.i_clamp_max), gains.u_clamp_max, limit),
            min(gains.p * error + min(integrated, -gains.i_clamp_min), -gains.u_clamp_min, limit))


def check_holding(gains: PidGains, present: PidGains, error: float, limit: float) -> None:
    """Raise InputError where gains would hold no brake, changed while one may be applied.

    An error must bring full torque within HOLDING_TIME, as it does (or as near to it) with the
    present ones: without, one request lets a brake go, or leaves one that follows nothing.

    Args:
        gains: that are asked for.
        present: that are in use.
        error: the largest that is no fault [rad].
        limit: of the torque [N·m].
    """
    for found, before in zip(holding_torque(gains, error, limit),
                             holding_torque(present, error, limit), strict=True):
        if found < before:
            deadband = (f' with error_deadband {gains.error_deadband:g}'
                        if error < gains.error_deadband else '')
            raise InputError(
                f'p {gains.p:g} and i {gains.i:g}{deadband} would not hold the brake: an error of '
                f'{error:g} rad would bring {found:.3g} N·m within a second, and brings '
                f'{before:.3g} N·m now; restart with these gains on purpose')
