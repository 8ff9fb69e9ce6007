# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reference trajectories: the identification strokes of the paper (step 0) and recorded tables."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
import csv
import math
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engb_core.errors import InputError

__all__ = ['ReferenceBounds', 'Setpoint', 'Trajectory', 'TrajectoryBuilder', 'file_reference',
           'identification_strokes', 'joined', 'slow_strokes']

# A reference takes no longer than a day: what does is time in another unit (a minute and a half
# in ms) [s].
LONGEST = 86_400.0

Array = NDArray[np.float64]


class Setpoint(NamedTuple):
    """What the loop tracks now: `position` [rad], `velocity` [rad/s], `acceleration` [rad/s²]."""

    position: float
    velocity: float = 0.0
    acceleration: float = 0.0


class ReferenceBounds(NamedTuple):
    """What a brake can follow: from `low` to `high` [rad], at most at `speed` [rad/s]."""

    low: float = -math.inf
    high: float = math.inf
    speed: float = math.inf

    def out_of_range(self, position: float) -> str:
        """Return what is wrong with a position [rad]; '' where it lies within the range."""
        if self.low <= position <= self.high:
            return ''
        name, end = (('position_max', self.high) if position > self.high
                     else ('position_min', self.low))
        return f'{position:.4g} rad lies beyond {name}, {end:.4g} rad'

    def too_fast(self, speed: float) -> str:
        """Return what is wrong with a speed [rad/s]; '' where the brake can follow."""
        if speed <= self.speed:
            return ''
        return (f'{speed:.4g} rad/s, and this brake can follow {self.speed:.4g} rad/s '
                '(largest_speed; effort_limit, the model\'s inertia and largest_error)')


class Trajectory:
    """A piecewise cubic of time, held at both ends.

    Args:
        times: n + 1 instants [s], increasing, from 0.
        pieces: n tuples (p0, p1, p2, p3): θ = p0 + p1·τ + p2·τ² + p3·τ³ with τ from the
            piece's begin [rad, rad/s, …].
    """

    def __init__(self, times: Sequence[float],
                 pieces: Sequence[tuple[float, float, float, float]]) -> None:
        if len(times) != len(pieces) + 1 or not pieces:
            raise ValueError('a trajectory needs one instant more than pieces, and one piece')
        self._begins = [float(time) for time in times[:-1]]
        self._pieces = [tuple(float(value) for value in piece) for piece in pieces]
        self.duration = float(times[-1])
        p0, p1, p2, p3 = self._pieces[-1]
        last = self.duration - self._begins[-1]
        self._end = Setpoint(p0 + last * (p1 + last * (p2 + last * p3)))
        self._start = Setpoint(self._pieces[0][0])

    def at(self, time: float) -> Setpoint:
        """Return the set-point at `time` [s]; before 0 and after the end it stands still."""
        if time < 0.0:
            return self._start
        if not time < self.duration:
            return self._end
        index = bisect_right(self._begins, time) - 1
        tau = time - self._begins[index]
        p0, p1, p2, p3 = self._pieces[index]
        return Setpoint(p0 + tau * (p1 + tau * (p2 + tau * p3)),
                        p1 + tau * (2.0 * p2 + 3.0 * tau * p3),
                        2.0 * p2 + 6.0 * tau * p3)

    def top_speeds(self) -> list[float]:
        """Return the highest speed of each piece, whatever its direction [rad/s]."""
        ends = [*self._begins[1:], self.duration]
        found = []
        for begin, end, (_, p1, p2, p3) in zip(self._begins, ends, self._pieces, strict=True):
            length = end - begin
            turn = -p2 / (3.0 * p3) if p3 else 0.0   # where the acceleration is none
            found.append(max(abs(p1 + tau * (2.0 * p2 + 3.0 * tau * p3))
                             for tau in (0.0, length, min(max(turn, 0.0), length))))
        return found

    def sample(self, times: ArrayLike) -> tuple[Array, Array, Array]:
        """Return position, velocity, acceleration at `times` (n,), each (n,)."""
        points = np.array([self.at(float(time)) for time in np.asarray(times, float)])
        points = points.reshape(-1, 3)
        return points[:, 0], points[:, 1], points[:, 2]


class TrajectoryBuilder:
    """Strings strokes and stops together.

    Args:
        start: position [rad] at time 0.
    """

    def __init__(self, start: float = 0.0) -> None:
        self._times = [0.0]
        self._pieces: list[tuple[float, float, float, float]] = []
        self.position = float(start)

    def stop(self, duration: float) -> TrajectoryBuilder:
        """Stand still for `duration` [s]."""
        if duration > 0.0:
            self._add(duration, self.position, 0.0, 0.0)
        return self

    def move(self, target: float, acceleration: float,
             speed: float = math.inf) -> TrajectoryBuilder:
        """Go to `target` [rad] at constant ±`acceleration` [rad/s²], at most `speed` [rad/s].

        Where the speed limit isn't met, the velocity is a triangle, as in step 0 of the paper:
        its values are spread evenly over the whole range.
        """
        if not (acceleration > 0.0 and speed > 0.0 and math.isfinite(acceleration)):
            raise ValueError('acceleration and speed must be above 0')
        distance = float(target) - self.position
        if distance == 0.0:
            return self
        sign = math.copysign(1.0, distance)
        length = abs(distance)
        peak = min(math.sqrt(length * acceleration), speed)
        ramp = peak / acceleration
        cruise = (length - peak * ramp) / peak
        start = self.position
        self._add(ramp, start, 0.0, 0.5 * sign * acceleration)
        at_speed = start + sign * 0.5 * peak * ramp
        if cruise > 1e-9:
            self._add(cruise, at_speed, sign * peak, 0.0)
        brake_at = at_speed + sign * peak * max(cruise, 0.0)
        self._add(ramp, brake_at, sign * peak, -0.5 * sign * acceleration)
        self.position = float(target)
        return self

    def build(self) -> Trajectory:
        """Return the trajectory."""
        return Trajectory(self._times, self._pieces)

    def _add(self, duration: float, p0: float, p1: float, p2: float) -> None:
        self._pieces.append((p0, p1, p2, 0.0))
        self._times.append(self._times[-1] + duration)


def identification_strokes(
    amplitudes: Sequence[float],
    acceleration: float = 60.0,
    stop: float = 0.5,
    start: float = 0.0,
    repetitions: int = 1,
    speed: float = math.inf,
) -> Trajectory:
    """Return symmetric clamp and release strokes of several amplitudes (step 0 of the paper).

    Each stroke goes from `start` to start + amplitude and back at constant acceleration, with a
    stop section after each half, in which the integral part brings the tracking error to zero.

    Args:
        amplitudes: strokes' lengths [rad], each repeated `repetitions` times.
        acceleration: [rad/s²].
        stop: length of the stop sections [s].
        start: position of rest [rad].
        repetitions: strokes of each amplitude.
        speed: not exceeded [rad/s].
    """
    if not amplitudes or repetitions < 1:
        raise ValueError('at least one amplitude and one repetition are needed')
    builder = TrajectoryBuilder(start).stop(stop)
    for amplitude in amplitudes:
        for _ in range(repetitions):
            builder.move(start + amplitude, acceleration, speed).stop(stop)
            builder.move(start, acceleration, speed).stop(stop)
    return builder.build()


def slow_strokes(
    low: float,
    high: float,
    speeds: Sequence[float],
    stop: float = 0.3,
    acceleration: float = 200.0,
) -> Trajectory:
    """Return strokes at constant low speeds between two angles, for cogging and friction at creep.

    Args:
        low, high: [rad], both where the brake carries no load.
        speeds: [rad/s], one stroke there and back for each.
        stop: [s] after each half.
        acceleration: at the turns [rad/s²].
    """
    if not speeds:
        raise ValueError('at least one speed is needed')
    builder = TrajectoryBuilder(low).stop(stop)
    for speed in speeds:
        builder.move(high, acceleration, speed).stop(stop)
        builder.move(low, acceleration, speed).stop(stop)
    return builder.build()


def joined(parts: Sequence[Trajectory], acceleration: float = 60.0) -> Trajectory:
    """Return the trajectories one after another, moved to the next one's start in between."""
    times = [0.0]
    pieces: list[Any] = []
    position = parts[0].at(0.0).position
    for part in parts:
        target = part.at(0.0).position
        if abs(target - position) > 1e-12:
            link = TrajectoryBuilder(position).move(target, acceleration).build()
            _append(times, pieces, link)
        _append(times, pieces, part)
        position = part.at(part.duration).position
    return Trajectory(times, pieces)


def _append(times: list[float], pieces: list[Any], part: Trajectory) -> None:
    offset = times[-1]
    times.extend(offset + begin for begin in part._begins[1:])
    times.append(offset + part.duration)
    pieces.extend(part._pieces)


def file_reference(path: str | os.PathLike[str],
                   bounds: ReferenceBounds | None = None) -> Trajectory:
    """Read a reference from a CSV file with the columns `time` [s] and `position` [rad].

    Between the rows it runs as a monotone cubic (PCHIP): it never overshoots them.

    Args:
        path: of the file.
        bounds: of the brake that shall follow; None: none are known.

    Raises:
        InputError: unreadable, a column missing, fewer than two rows, a value that is not a
            finite number, time not increasing or in another unit, out of bounds.
    """
    path = Path(path)
    try:
        with path.open(newline='', encoding='utf-8') as file:
            reader = csv.DictReader(file)
            names = [name.strip() for name in reader.fieldnames or []]
            reader.fieldnames = names
            for column in ('time', 'position'):
                if column not in names:
                    raise InputError(f'{path}: no column {column!r}; the first line must name '
                                     f'time,position')
            rows = [(row['time'], row['position'], reader.line_num) for row in reader]
    except OSError as error:
        raise InputError(f'{path}: cannot be read ({error.strerror}); give a CSV file with '
                         f'time,position') from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f'{path}: not a CSV file; give one with time,position') from error
    values, lines = np.empty((len(rows), 2)), [line for *_, line in rows]
    for index, (*cells, line) in enumerate(rows):
        try:
            values[index] = [float(cell) for cell in cells]
        except (TypeError, ValueError):
            raise InputError(f'{path}: line {line} holds no two numbers') from None
    if len(rows) < 2:
        raise InputError(f'{path}: fewer than two rows; a reference needs a begin and an end')
    if not np.isfinite(values).all():
        line = lines[int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])]
        raise InputError(f'{path}: a value is not finite at line {line}; every time and position '
                         'must be')
    time = values[:, 0] - values[0, 0]
    if np.any(np.diff(time) <= 0.0):
        line = lines[int(np.flatnonzero(np.diff(time) <= 0.0)[0]) + 1]
        raise InputError(f'{path}: time does not increase at line {line}; sort the rows')
    if time[-1] > LONGEST:
        index = int(np.flatnonzero(time > LONGEST)[0])
        raise InputError(f'{path}: line {lines[index]} comes {time[index]:.4g} s after the first '
                         f'row; a reference takes {LONGEST:.0f} s at most: give time in seconds')
    trajectory = _through(time, values[:, 1])
    if bounds is not None:
        _check_rows(trajectory, values[:, 1].tolist(), bounds, path, lines)
    return trajectory


def _through(time: Array, position: Array) -> Trajectory:
    """Return the trajectory through rows of time [s], from 0, and position [rad]."""
    times = time.tolist()
    if time.size == 2:
        return Trajectory(times, [(position[0], (position[1] - position[0]) / time[1], 0.0, 0.0)])
    from scipy.interpolate import PchipInterpolator  # here: a node without a file starts faster
    coefficients = PchipInterpolator(time, position).c
    return Trajectory(times, [tuple(column[::-1]) for column in coefficients.T])


def _check_rows(trajectory: Trajectory, positions: list[float], bounds: ReferenceBounds,
                path: Path, lines: list[int]) -> None:
    """Raise InputError at the first row that the brake could not follow."""
    for position, line in zip(positions, lines, strict=True):
        if told := bounds.out_of_range(position):
            raise InputError(f'{path}: line {line}: {told}; change the row, or the parameter if '
                             'the brake may go there')
    for speed, line in zip(trajectory.top_speeds(), lines[1:], strict=True):
        if told := bounds.too_fast(speed):
            raise InputError(f'{path}: the move to line {line} takes {told}; give it more time')
