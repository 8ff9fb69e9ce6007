# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Open-loop torques for identifying the nominal plant: steps and a sine sweep (section 3.2)."""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.errors import InputError

__all__ = ['Excitation', 'EXCITATIONS', 'ExcitationSettings']

EXCITATIONS = ('steps', 'sweep')

# A step test's levels, parts of the amplitude: both directions, and two sizes to part friction
# from drag.
LEVELS = (1.0, -1.0, 0.5, -0.5)


@dataclass(frozen=True)
class ExcitationSettings:
    """What to excite with.

    Attributes:
        kind: one of EXCITATIONS.
        amplitude: [N·m].
        hold: how long each step is held [s].
        first_frequency, last_frequency: of the sweep [Hz], linear in time.
        duration: of the whole [s]; afterwards the torque is 0.
    """

    kind: str = 'steps'
    amplitude: float = 4.0 * 0.0174
    hold: float = 0.5
    first_frequency: float = 0.0
    last_frequency: float = 10.0
    duration: float = 8.0

    def __post_init__(self) -> None:
        if self.kind not in EXCITATIONS:
            raise InputError(f'excitation is {self.kind!r}; it must be one of '
                             f'{", ".join(EXCITATIONS)}')
        for name in ('amplitude', 'hold', 'duration', 'last_frequency'):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(f'{name} is {value}; it must be above 0')
        if not 0.0 <= self.first_frequency < self.last_frequency:
            raise InputError(f'first_frequency {self.first_frequency} Hz must lie within 0 and '
                             'last_frequency')


class Excitation:
    """Torque over time."""

    def __init__(self, settings: ExcitationSettings) -> None:
        self.settings = settings

    def torque(self, time: float) -> float:
        """Return the torque [N·m] at `time` [s] from the start; 0 before and after."""
        settings = self.settings
        if not 0.0 <= time < settings.duration:
            return 0.0
        if settings.kind == 'steps':
            return settings.amplitude * LEVELS[int(time / settings.hold) % len(LEVELS)]
        rate = (settings.last_frequency - settings.first_frequency) / settings.duration
        phase = 2.0 * math.pi * time * (settings.first_frequency + 0.5 * rate * time)
        return settings.amplitude * math.sin(phase)
