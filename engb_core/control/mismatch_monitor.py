# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Says online when model and measurement part, and where, so that a recording can be taken."""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.control.feedforward import Feedforward
from engb_core.errors import InputError
from engb_core.model import Model

__all__ = ['LONGEST_STEP', 'MismatchMonitor', 'MonitorSettings', 'ZONES']

# Where a sample lies, in the words of a brake engineer.
ZONES = ('standing', 'applying, unloaded', 'applying, under load', 'releasing, under load',
         'releasing, unloaded')


# Between two samples farther apart than this nothing is judged [s].
LONGEST_STEP = 0.1


@dataclass(frozen=True)
class MonitorSettings:
    """When a difference counts.

    Attributes:
        threshold: rms of the torque residual that is too much [N·m].
        window: memory of the running mean squares [s].
        cutoff: of the filter through which model and measurement pass [Hz].
        least_time: a zone is judged after so long in it [s].
    """

    threshold: float = 0.008
    window: float = 5.0
    cutoff: float = 10.0
    least_time: float = 0.3

    def __post_init__(self) -> None:
        for name in ('threshold', 'window', 'cutoff'):
            value = getattr(self, name)
            if not value > 0.0:
                raise InputError(f'{name} is {value}; it must be above 0')


class MismatchMonitor:
    """Compares the torque that the motion needed with the one that acted, zone by zone.

    The residual is d̂ of the observer fed with the effort less the model's load, friction and
    cogging torque: model and measurement pass the same filter, so the filter makes no mismatch.

    Attributes:
        residual: now [N·m], sign of (30).
    """

    def __init__(self, model: Model, settings: MonitorSettings | None = None) -> None:
        self.settings = settings or MonitorSettings()
        self._torques = Feedforward(model)
        self._standstill = 2.0 * model.friction.saturation_velocity
        self._observer = DisturbanceObserver(model.motor, self.settings.cutoff)
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self._observer.reset()
        self.residual = 0.0
        self._time: float | None = None
        self._squares = [0.0] * len(ZONES)
        self._times = [0.0] * len(ZONES)
        self._largest_load = 1e-6

    def step(self, time: float, position: float, velocity: float, effort: float) -> float:
        """Take one sample ([s], [rad], [rad/s], [N·m]) and return the residual [N·m]."""
        if not math.isfinite(time + position + velocity + effort):
            return self.residual
        dt = 0.0 if self._time is None else time - self._time
        self._time = time
        torques = self._torques
        load = torques.load_torque(position)
        known = load + torques.friction_torque(load, velocity) + torques.cogging_torque(position)
        self.residual = self._observer.step(time, velocity, effort - known)
        if 0.0 < dt < LONGEST_STEP:
            self._largest_load = max(self._largest_load, abs(load))
            self._remember(self._zone(load, velocity), dt)
        return self.residual

    def rms(self) -> dict[str, float]:
        """Return the residual's rms [N·m] in each zone that was long enough in sight."""
        return {zone: math.sqrt(square) for zone, square, seen in zip(
            ZONES, self._squares, self._times, strict=True) if seen >= self.settings.least_time}

    def parted(self) -> dict[str, float]:
        """Return the zones in which model and measurement have parted, with their rms [N·m].

        Standing still is not judged: friction may hold anything.
        """
        return {zone: value for zone, value in self.rms().items()
                if value > self.settings.threshold and zone != ZONES[0]}

    def verdict(self) -> str:
        """Return in words what `parted` says, the worst first, or that there is nothing yet."""
        parted = self.parted()
        if parted:
            worst_first = sorted(parted.items(), key=lambda entry: -entry[1])
            return 'model and measurement part: ' + ', '.join(
                f'{zone} ({1e3 * value:.1f} mN·m)' for zone, value in worst_first)
        if not set(self.rms()) - {ZONES[0]}:
            return 'nothing is judged yet: the brake stands, or has hardly moved'
        return 'model and measurement agree'

    def _zone(self, load: float, velocity: float) -> int:
        if abs(velocity) <= self._standstill:
            return 0
        loaded = abs(load) > 0.1 * self._largest_load
        if velocity > 0.0:
            return 2 if loaded else 1
        return 3 if loaded else 4

    def _remember(self, zone: int, dt: float) -> None:
        seen = self._times[zone] = min(self._times[zone] + dt, self.settings.window)
        self._squares[zone] += (self.residual**2 - self._squares[zone]) * dt / seen
