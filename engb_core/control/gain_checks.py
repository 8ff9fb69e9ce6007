# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a loop with given gains can do, before it is closed: hold a brake, and wait for samples."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engb_core.control.pid import PidGains
from engb_core.errors import InputError
from engb_core.model import Motor

__all__ = ['check_holding', 'delay_margin', 'holding_torque']

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


def delay_margin(gains: PidGains, motor: Motor) -> float:
    """Return by how much the torque may come late before the loop swings on [s]; inf: nothing
    limits it.

    The loop is opened at the torque: L(s) = (p + i/s + d·s/(1 + T_f·s))/(J·s² + B·s), of a motor
    without load, which holds it least. Where |L| = 1, at ω, with the phase margin φ (of L without
    delay), a delay of φ/ω takes the margin away. A crossover without a margin of its own swings at
    any rate, which is no matter of delay: it is left out.

    Samples that are as far apart leave no margin: a torque is held from one sample to the next,
    which delays it by half an interval in the mean, and a drive takes it up with its own next
    cycle, half an interval later in the mean.

    Args:
        gains: of the loop.
        motor: inertia J and viscous friction B.
    """
    p, i, d, filtered = gains.p, gains.i, gains.d, gains.derivative_filter_time
    inertia, viscous = motor.inertia, motor.viscous_friction
    numerator = np.array([p * filtered + d, p + i * filtered, i])
    denominator = np.polymul([inertia, viscous, 0.0, 0.0], [filtered, 1.0])
    margins = [math.inf]
    for square in np.roots(np.polysub(_squared(denominator), _squared(numerator))):
        if abs(square.imag) > 1e-9 * abs(square) or square.real <= 0.0:
            continue
        omega = math.sqrt(square.real)
        phase = (np.angle(np.polyval(numerator, 1j * omega))
                 - np.angle(np.polyval(denominator, 1j * omega)) + math.pi)
        margin = (phase + math.pi) % (2.0 * math.pi) - math.pi
        if margin > 0.0:
            margins.append(float(margin) / omega)
    return min(margins)


def _squared(polynomial: NDArray[Any]) -> Any:
    """Return |P(jω)|² as a polynomial of ω², highest power first."""
    mirrored = polynomial * (-1.0) ** np.arange(polynomial.size - 1, -1, -1)   # P(−s)
    even = np.polymul(polynomial, mirrored)[::2]                               # in s² = −ω²
    return even * (-1.0) ** np.arange(even.size - 1, -1, -1)
