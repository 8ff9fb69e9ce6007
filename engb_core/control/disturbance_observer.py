# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The lumped disturbance, equation (30): d̂ = q ∗ (J·ω̇ + B·ω − u)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engb_core.errors import InputError
from engb_core.model import Motor

__all__ = ['DisturbanceObserver']

# Beyond this a number is not a measurement but a fault, which the filter would never forget.
LARGEST = 1e9

# A gap longer than this many samples' worth of filter time starts the filters anew.
_RESTART = 20.0


class DisturbanceObserver:
    """Estimates d̂ = −(T_L + T_C + T_cog), filtered by the low-pass q.

    q(s) = 1/(τs + 1)^order with its −3 dB point at `cutoff`. The acceleration is never formed:
    q·s·ω is the difference between a signal and its low-pass, (ω − q₁ω)/τ. Discretised by the
    trapezoidal rule with the measured step, so samples may be uneven.

    Args:
        motor: J and B.
        cutoff: of q [Hz].
        order: 1 or 2.
    """

    def __init__(self, motor: Motor, cutoff: float = 20.0, order: int = 2) -> None:
        if order not in (1, 2):
            raise InputError(f'order is {order}; the observer\'s low-pass has order 1 or 2')
        if not (math.isfinite(cutoff) and cutoff > 0.0):
            raise InputError(f'cutoff is {cutoff}; it must be above 0 Hz')
        self.motor = motor
        self.cutoff = float(cutoff)
        self.order = order
        # |q| = (1 + (ω_c·τ)²)^(−order/2) = 1/√2 at the cutoff.
        self.time_constant = (math.sqrt(2.0 ** (1.0 / order) - 1.0)
                              / (2.0 * math.pi * self.cutoff))
        self.reset()

    def reset(self) -> None:
        """Forget the past; the next sample is taken as a standstill at its own values."""
        self.estimate = 0.0
        self.rejected = 0
        self._time: float | None = None
        self._velocity = self._effort = 0.0
        self._velocity_1 = self._velocity_2 = 0.0
        self._effort_1 = self._effort_2 = 0.0

    def step(self, time: float, velocity: float, effort: float) -> float:
        """Take one sample and return d̂ [N·m].

        A sample that is not finite, beyond LARGEST, or not later than the last one, is left out:
        the estimate is held.

        Args:
            time: the sample's stamp [s].
            velocity: ω [rad/s].
            effort: u, the torque that acted [N·m].
        """
        if not (math.isfinite(time) and abs(velocity) + abs(effort) < LARGEST):
            self.rejected += 1
            return self.estimate
        previous = self._time
        tau = self.time_constant
        if previous is None or abs(time - previous) > _RESTART * tau:
            self._velocity_1 = self._velocity_2 = velocity
            self._effort_1 = self._effort_2 = effort
            self.estimate = self.motor.viscous_friction * velocity - effort
        else:
            dt = time - previous
            if dt <= 0.0:
                self.rejected += 1
                return self.estimate
            keep = (2.0 * tau - dt) / (2.0 * tau + dt)
            gain = dt / (2.0 * tau + dt)
            velocity_1 = keep * self._velocity_1 + gain * (velocity + self._velocity)
            effort_1 = keep * self._effort_1 + gain * (effort + self._effort)
            if self.order == 1:
                acceleration = (velocity - velocity_1) / tau
                filtered_velocity, filtered_effort = velocity_1, effort_1
            else:
                self._velocity_2 = (keep * self._velocity_2
                                    + gain * (velocity_1 + self._velocity_1))
                self._effort_2 = keep * self._effort_2 + gain * (effort_1 + self._effort_1)
                acceleration = (velocity_1 - self._velocity_2) / tau
                filtered_velocity, filtered_effort = self._velocity_2, self._effort_2
            self._velocity_1, self._effort_1 = velocity_1, effort_1
            self.estimate = (self.motor.inertia * acceleration
                             + self.motor.viscous_friction * filtered_velocity
                             - filtered_effort)
        self._time, self._velocity, self._effort = time, velocity, effort
        return self.estimate

    def filter(self, time: ArrayLike, velocity: ArrayLike, effort: ArrayLike,
               ) -> NDArray[np.float64]:
        """Return d̂ (n,) [N·m] of a whole recording, sample for sample what `step` gives.

        Args:
            time, velocity, effort: (n,) [s, rad/s, N·m].
        """
        self.reset()
        step = self.step
        return np.fromiter(
            map(step, np.asarray(time, float).tolist(), np.asarray(velocity, float).tolist(),
                np.asarray(effort, float).tolist()), float, len(np.asarray(time)))
