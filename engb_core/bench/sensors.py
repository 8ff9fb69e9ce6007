# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a drive measures of the motor: counts, a velocity made of them, a noisy current."""

from __future__ import annotations

from dataclasses import dataclass
import math
import random

from engb_core.errors import InputError

__all__ = ['SensorChain', 'SensorSettings', 'VelocityFromPosition']


@dataclass(frozen=True)
class SensorSettings:
    """The sensor chain's numbers.

    Attributes:
        counts_per_revolution: of the encoder; 0: no quantisation.
        velocity_cutoff: of the drive's low-pass on the differenced counts [Hz]; 0: none.
        effort_noise: standard deviation of K_T × measured current [N·m].
        effort_resolution: of the current measurement, as torque [N·m]; 0: none.
        seed: of the noise.
    """

    counts_per_revolution: int = 8192
    velocity_cutoff: float = 100.0
    effort_noise: float = 0.002
    effort_resolution: float = 0.0002
    seed: int = 1

    def __post_init__(self) -> None:
        for name in ('counts_per_revolution', 'velocity_cutoff', 'effort_noise',
                     'effort_resolution'):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise InputError(f'{name} is {value}; it must not be below 0')


class VelocityFromPosition:
    """Differenced position through a first-order low-pass, as a drive derives its velocity.

    Args:
        cutoff: [Hz]; 0: the bare difference.

    Attributes:
        time_constant: of the low-pass [s].
        velocity: [rad/s].
    """

    def __init__(self, cutoff: float) -> None:
        self.time_constant = 1.0 / (2.0 * math.pi * cutoff) if cutoff > 0.0 else 0.0
        self._time: float | None = None
        self._position = 0.0
        self.velocity = 0.0

    def step(self, time: float, position: float) -> float:
        """Take one sample ([s], [rad]) and return the velocity [rad/s]."""
        if not math.isfinite(time + position):
            return self.velocity
        if self._time is None:
            self._time, self._position = time, position
            return self.velocity
        dt = time - self._time
        if dt <= 0.0:
            return self.velocity
        raw = (position - self._position) / dt
        self.velocity += (raw - self.velocity) * dt / (dt + self.time_constant)
        self._time, self._position = time, position
        return self.velocity


class SensorChain:
    """From the motor's true state to what the drive reports; the same seed, the same noise."""

    def __init__(self, settings: SensorSettings) -> None:
        self.settings = settings
        counts = settings.counts_per_revolution
        self._count = 2.0 * math.pi / counts if counts else 0.0
        self._velocity = VelocityFromPosition(settings.velocity_cutoff)
        self._random = random.Random(settings.seed)

    def measure(self, time: float, position: float, effort: float,
                ) -> tuple[float, float, float]:
        """Return (position [rad], velocity [rad/s], effort [N·m]) as measured.

        Args:
            time: [s].
            position: true angle [rad].
            effort: torque that the current makes [N·m].
        """
        settings = self.settings
        if self._count:
            position = self._count * math.floor(position / self._count + 0.5)
        velocity = self._velocity.step(time, position)
        if settings.effort_noise:
            effort += self._random.gauss(0.0, settings.effort_noise)
        if settings.effort_resolution:
            effort = settings.effort_resolution * round(effort / settings.effort_resolution)
        return position, velocity, effort
