# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Open-loop torques for identifying the nominal plant: steps and a sine sweep (section 3.2)."""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.bench.sensors import VelocityFromPosition
from engb_core.control.loop import VELOCITY_CUTOFF
from engb_core.errors import InputError

__all__ = ['Excitation', 'EXCITATIONS', 'ExcitationRun', 'ExcitationSettings']

EXCITATIONS = ('steps', 'sweep')

# A step test's levels, parts of the amplitude: both directions, and two sizes to part friction
# from drag.
LEVELS = (1.0, -1.0, 0.5, -0.5)

# Stamps may be behind the steady clock by so much [s], as for the controller: then they stand
# still, or run too slowly to end anything.
STAMPS_BEHIND = 0.1


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


class ExcitationRun:
    """An excitation of a motor that turns freely, for which nothing else watches.

    It lets go for good as soon as the motor turns too fast, and where nobody could tell whether
    it does: a number that is none, stamps that stand still. Where the sample gives no velocity,
    that of the angles counts.

    Args:
        settings: what to excite with.
        highest_speed: [rad/s].
        real_time: the excitation also ends by the steady clock; False: time is simulated, and may
            pass more slowly.

    Attributes:
        fault: why it has let go before its time; '' where it has not.
    """

    def __init__(self, settings: ExcitationSettings, highest_speed: float,
                 real_time: bool = True) -> None:
        self._excitation = Excitation(settings)
        self._highest_speed = highest_speed
        self._real_time = real_time
        self.restart()

    def restart(self) -> None:
        """Begin with the next sample."""
        self.fault = ''
        self._derived = VelocityFromPosition(VELOCITY_CUTOFF)
        self._begin: tuple[float, float] | None = None
        self._stamp = self._advanced = -math.inf

    def step(self, now: float, stamp: float, position: float, velocity: float | None) -> float:
        """Return the torque [N·m] that answers a sample.

        Args:
            now: by a steady clock [s].
            stamp: of the sample [s].
            position: [rad].
            velocity: [rad/s]; None where the sample gives none.
        """
        if self._begin is None:
            self._begin = now, stamp
        if stamp > self._stamp:
            self._advanced = now
        self._stamp = stamp
        begin, first = self._begin
        if not self.fault:
            self.fault = self._fault(now, begin, first, position, velocity)
        return 0.0 if self.fault else self._excitation.torque(stamp - first)

    def _fault(self, now: float, begin: float, first: float, position: float,
               velocity: float | None) -> str:
        speed = self._derived.step(self._stamp, position) if velocity is None else velocity
        if not (math.isfinite(position) and math.isfinite(speed)):
            return 'angle or velocity is no number: nobody knows how fast the motor turns'
        if abs(speed) > self._highest_speed:
            return f'{speed:.0f} rad/s is too fast'
        if now - self._advanced > STAMPS_BEHIND:
            return f'the stamps of joint_states have not advanced for {STAMPS_BEHIND} s'
        duration = self._excitation.settings.duration
        if (self._real_time and now - begin > duration + STAMPS_BEHIND
                and self._stamp - first < duration):
            return (f'{duration:g} s are over by the steady clock, not by the stamps of '
                    'joint_states; for simulated time set use_sim_time')
        return ''
