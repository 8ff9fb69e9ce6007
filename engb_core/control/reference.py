# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Where the set-point comes from: a command, limited in speed, or a trajectory."""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.control.trajectory import (
    file_reference,
    identification_strokes,
    joined,
    ReferenceBounds,
    Setpoint,
    slow_strokes,
    Trajectory,
)
from engb_core.errors import InputError

__all__ = ['MotionLimiter', 'REFERENCES', 'ReferenceSettings', 'ReferenceSource']

REFERENCES = ('command', 'strokes', 'file')

# Steps longer than this are taken as a stop of the clock, not as a motion [s].
_LONGEST_STEP = 0.1


class MotionLimiter:
    """Follows a set-point within limits of speed and acceleration, without overshoot.

    Args:
        apply_speed: limit while the angle grows [rad/s].
        release_speed: limit while it falls [rad/s].
        acceleration: [rad/s²].
    """

    def __init__(self, apply_speed: float, release_speed: float, acceleration: float) -> None:
        self.apply_speed = apply_speed
        self.release_speed = release_speed
        self.acceleration = acceleration
        self.position = self.velocity = 0.0

    def reset(self, position: float) -> None:
        """Stand still at `position` [rad]."""
        self.position, self.velocity = position, 0.0

    def step(self, target: float, dt: float) -> Setpoint:
        """Go on for `dt` [s] towards `target` [rad]."""
        if not 0.0 < dt <= _LONGEST_STEP:
            return Setpoint(self.position, self.velocity, 0.0)
        error = target - self.position
        brake = 0.5 * self.acceleration * dt
        # The speed from which this acceleration, in steps of dt, still stops at the target.
        wanted = math.sqrt(brake * brake + 2.0 * self.acceleration * abs(error)) - brake
        wanted = min(wanted, self.apply_speed if error > 0.0 else self.release_speed,
                     abs(error) / dt)
        wanted = math.copysign(wanted, error)
        change = self.acceleration * dt
        velocity = min(max(wanted, self.velocity - change), self.velocity + change)
        acceleration = (velocity - self.velocity) / dt
        self.position += velocity * dt
        self.velocity = velocity
        return Setpoint(self.position, velocity, acceleration)


@dataclass(frozen=True)
class ReferenceSettings:
    """Where the set-point comes from.

    Attributes:
        kind: one of REFERENCES.
        file: CSV file of kind 'file'.
        start_on_request: a trajectory waits for `start`.
        repeat: a trajectory begins again when it ends.
        amplitudes, acceleration, repetitions, stop_time: of the identification strokes
            [rad, rad/s², -, s].
        slow_speeds, slow_range: of the slow unloaded strokes before them [rad/s, rad].
        approach_acceleration, apply_speed, release_speed: limits of moves to a command or to a
            trajectory's start [rad/s², rad/s, rad/s].
    """

    kind: str = 'command'
    file: str = ''
    start_on_request: bool = False
    repeat: bool = False
    amplitudes: tuple[float, ...] = (12.0, 24.0, 36.0)
    acceleration: float = 60.0
    repetitions: int = 1
    stop_time: float = 0.6
    slow_speeds: tuple[float, ...] = (1.0, 4.0)
    slow_range: tuple[float, float] = (0.3, 3.0)
    approach_acceleration: float = 400.0
    apply_speed: float = 60.0
    release_speed: float = 60.0

    def trajectory(self, bounds: ReferenceBounds | None = None) -> Trajectory | None:
        """Return the trajectory of these settings, None for commands.

        Raises:
            InputError: there is none, or a brake of these bounds could not follow it.
        """
        if self.kind == 'command':
            return None
        if self.kind == 'file':
            if not self.file:
                raise InputError('reference is file, but reference_file is empty; name a CSV '
                                 'file of time,position')
            return file_reference(self.file, bounds)
        if self.kind != 'strokes':
            raise InputError(f'reference is {self.kind!r}; it must be one of '
                             f'{", ".join(REFERENCES)}')
        try:
            parts = []
            low, high = self.slow_range
            if self.slow_speeds and low != high:
                parts.append(slow_strokes(low, high, self.slow_speeds))
            parts.append(identification_strokes(
                self.amplitudes, self.acceleration, self.stop_time,
                repetitions=self.repetitions))
            strokes = joined(parts, self.acceleration)
        except ValueError as error:
            raise InputError(f'identification strokes: {error}') from error
        if bounds is not None:
            self._check_strokes(strokes, bounds)
        return strokes

    def _check_strokes(self, strokes: Trajectory, bounds: ReferenceBounds) -> None:
        slow = self.slow_range if self.slow_speeds else ()
        for name, angles in (('stroke_amplitudes', self.amplitudes), ('slow_range', slow)):
            for angle in angles:
                if told := bounds.out_of_range(angle):
                    raise InputError(f'parameter {name}: {told}; make the strokes shorter, or '
                                     'widen the range if the brake may go there')
        if told := bounds.too_fast(max(strokes.top_speeds())):
            raise InputError(f'the identification strokes take {told}; lower stroke_acceleration '
                             'or slow_speeds')


class ReferenceSource:
    """The set-point of each cycle, by time and by where the motor stands.

    After `reset` it holds the measured position; it moves to a command or to the trajectory's
    start within the limits, so nothing jumps. A trajectory that leaves `bounds` is refused; one
    that was ended (`hold`) goes on by `start` alone.
    """

    def __init__(self, settings: ReferenceSettings,
                 bounds: ReferenceBounds | None = None) -> None:
        self.settings = settings
        self._trajectory = settings.trajectory(bounds)
        self._limiter = MotionLimiter(settings.apply_speed, settings.release_speed,
                                      settings.approach_acceleration)
        self._target: float | None = None
        self.restart()

    @property
    def duration(self) -> float:
        """The trajectory's length [s], 0 for commands."""
        return self._trajectory.duration if self._trajectory else 0.0

    @property
    def finished(self) -> bool:
        """The trajectory has come to its end."""
        return self._finished

    @property
    def commanded_by_trajectory(self) -> bool:
        """Commands are not listened to: a trajectory is the reference."""
        return self._trajectory is not None

    @property
    def running(self) -> bool:
        """The trajectory, or the move to its start, is under way."""
        return self._trajectory is not None and self._requested and not self._finished

    def hold(self) -> None:
        """Stop where the set-point is; a trajectory ends here."""
        limiter = self._limiter
        stop = limiter.velocity * abs(limiter.velocity) / (2.0 * limiter.acceleration)
        self._target = None if self._time is None else limiter.position + stop
        self._requested = False

    @property
    def target(self) -> float:
        """Where a command is going, or where the set-point stands [rad]."""
        return self._limiter.position if self._target is None else self._target

    def hold_at(self, position: float) -> None:
        """Stand still at `position` [rad] at once; a trajectory ends here."""
        self._limiter.reset(position)
        self._target = position
        self._requested = False

    def restart(self) -> None:
        """Begin as at the first time (on activation): a trajectory begins, unless it waits."""
        self._requested = not self.settings.start_on_request
        self.reset()

    def reset(self) -> None:
        """Hold the position of the next sample; a trajectory that is asked for starts anew."""
        self._time: float | None = None
        self._target = None
        self._begin: float | None = None
        self._finished = False

    def command(self, position: float) -> None:
        """Track `position` [rad] from now on; without effect on a trajectory."""
        if self._trajectory is None:
            self._target = float(position)

    def start(self) -> None:
        """Begin the trajectory; InputError where there is none."""
        if self._trajectory is None:
            raise InputError('parameter reference is command: there is no trajectory to start')
        self._requested = True
        self._begin = None
        self._finished = False

    def at(self, time: float, position: float) -> Setpoint:
        """Return the set-point at the sample's `time` [s]; `position` is where the motor is."""
        if self._time is None:
            if not math.isfinite(time + position):
                return Setpoint(0.0)
            self._time = time
            self._limiter.reset(position)
        dt = time - self._time
        if not math.isfinite(dt):
            dt, time = 0.0, self._time
        else:
            self._time = time
        if self._trajectory is None or not self._requested:
            target = self._limiter.position if self._target is None else self._target
            return self._limiter.step(target, dt)
        if self._begin is None:
            start = self._trajectory.at(0.0).position
            setpoint = self._limiter.step(start, dt)
            if abs(setpoint.position - start) > 1e-9 or setpoint.velocity != 0.0:
                return setpoint
            self._begin = time
        elif not 0.0 <= dt <= _LONGEST_STEP:
            self._begin += dt   # the clock jumped: the trajectory goes on where it was
        setpoint = self._trajectory.at(time - self._begin)
        self._limiter.position, self._limiter.velocity = setpoint[:2]
        if time - self._begin >= self._trajectory.duration:
            self._limiter.reset(setpoint.position)
            if self.settings.repeat:
                self._begin = None
            else:
                self._finished = True
        return setpoint
