# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Pieces of a reference that tell look-alikes apart, within what a recording has already seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from engb_core.control.trajectory import Trajectory, TrajectoryBuilder
from engb_core.diagnose.experiment.room import Room

__all__ = ['Course', 'Move', 'STEP', 'Segment', 'course_of', 'segments_of']

Array = NDArray[np.float64]

# Step of the table [s], and how many of its rows the corners of the acceleration are rounded over.
STEP = 0.005
ROUNDED = 5
# No leg of a stroke lasts longer [s].
LONGEST_LEG = 3.0
LONGEST_SEGMENT = 14.0
REST = 0.4


class Move(NamedTuple):
    """Go to `target` [rad] at up to `speed` [rad/s], ±`acceleration` [rad/s²], then stand `stop`
    [s]."""

    target: float
    speed: float
    acceleration: float
    stop: float = 0.0


@dataclass(frozen=True)
class Segment:
    """A named piece of reference: what it is, in words, and its moves."""

    name: str
    text: str
    moves: tuple[Move, ...]


@dataclass(frozen=True)
class Course:
    """A reference: `time` (n,) [s], `position` (n,) [rad], and where each segment lies,
    `spans` of (begin, end) [s], the way to the segment included."""

    time: Array
    position: Array
    spans: tuple[tuple[float, float], ...]

    @property
    def duration(self) -> float:
        """[s]."""
        return float(self.time[-1])



def segments_of(room: Room) -> list[Segment]:
    """Return the family of segments that this room allows."""
    found: list[Segment | None] = [
        _strokes(room, 'fast full strokes', 1.0, 1.0),
        _strokes(room, 'slow full strokes', 0.3, 0.4),
    ]
    if room.free is not None:
        begin, end = room.free
        where = 'without load' if room.loaded else 'over the range'
        found += [
            _reversals(room, begin, end, f'reversals {where}'),
            _ladder(room, begin, end, f'speed ladder with creep {where}'),
            _creep(room, begin, end, f'slow strokes {where}'),
            _quick(room, begin, end, f'quick short strokes {where}'),
        ]
    if room.loaded:
        light, heavy = room.at(0.3), room.at(0.95)
        found += [
            _reversals(room, light, heavy, 'reversals under load'),
            _ladder(room, light, heavy, 'speed ladder with creep under load'),
            _quick(room, light, heavy, 'quick short strokes under load'),
            _partial_loops(room),
            _holds(room),
        ]
    return [segment for segment in found
            if segment is not None and _path(room, [segment])[0].duration < LONGEST_SEGMENT]


def course_of(room: Room, segments: Sequence[Segment]) -> Course:
    """String segments together, from rest at home to rest at home, smooth throughout."""
    trajectory, spans = _path(room, segments)
    time = np.arange(int(math.ceil(trajectory.duration / STEP)) + ROUNDED, dtype=np.float64) * STEP
    position, _, _ = trajectory.sample(time)
    # A mean of motions within the limits is within the limits, and its acceleration has no steps.
    padded = np.pad(position, ROUNDED // 2, mode='edge')
    position = np.convolve(padded, np.full(ROUNDED, 1.0 / ROUNDED), mode='valid')
    return Course(time, position, tuple(spans))


def _path(room: Room, segments: Sequence[Segment],
          ) -> tuple[Trajectory, list[tuple[float, float]]]:
    builder = TrajectoryBuilder(room.home).stop(REST)
    spans, begin = [], REST
    for segment in segments:
        builder.move(segment.moves[0].target, 0.6 * room.acceleration, 0.7 * room.speed)
        for move in segment.moves:
            builder.move(move.target, move.acceleration, move.speed).stop(move.stop)
        builder.stop(0.1)
        end = builder.build().duration
        spans.append((begin, end))
        begin = end
    builder.move(room.home, 0.6 * room.acceleration, 0.7 * room.speed).stop(REST)
    return builder.build(), spans


def _strokes(room: Room, name: str, speed: float, acceleration: float) -> Segment:
    begin, end = (room.low, room.high) if not room.loaded else (
        float(room.angle[0]), float(room.angle[-1]))
    pace = room.pace(speed)
    end = _within_leg(begin, end, pace)
    moves = [Move(begin, room.pace(0.7), 0.6 * room.acceleration)]
    for _ in range(2):
        moves += [Move(target, pace, acceleration * room.acceleration, 0.1)
                  for target in (end, begin)]
    return Segment(name, f'{name} from {_angles(room, begin, end)} at up to '
                         f'{pace:.3g} {room.unit}/s', tuple(moves))


def _reversals(room: Room, begin: float, end: float, name: str) -> Segment | None:
    amplitudes = _amplitudes(room, abs(end - begin))
    if not amplitudes:
        return None
    sign = math.copysign(1.0, end - begin)
    moves = [Move(begin, room.pace(0.5), 0.5 * room.acceleration, 0.1)]
    for amplitude in amplitudes:
        speed = min(room.speed, max(amplitude / 0.3, 1.5 * room.slowest))
        moves += [Move(target, speed, 0.5 * room.acceleration)
                  for target in (begin + sign * amplitude, begin) * 2]
    # The same from the far side, where the load or the last turning point is another one.
    for amplitude in amplitudes[-2::-1]:
        speed = min(room.speed, max(amplitude / 0.3, 1.5 * room.slowest))
        moves += [Move(target, speed, 0.5 * room.acceleration)
                  for target in (end, end - sign * amplitude)]
    sizes = ', '.join(f'{amplitude:.2g}' for amplitude in amplitudes)
    return Segment(name, f'{name}: {sizes} {room.unit}, from {begin:.3g} and from {end:.3g} '
                         f'{room.unit}', tuple(moves))


def _ladder(room: Room, begin: float, end: float, name: str) -> Segment:
    parts = (0.02, 0.05, 0.12, 0.3, 0.6, 1.0)
    speeds = sorted({room.pace(part) for part in parts})
    sign = math.copysign(1.0, end - begin)
    moves = [Move(begin, room.pace(0.5), 0.5 * room.acceleration, 0.1)]
    for speed in speeds:
        far = begin + sign * min(abs(end - begin), 0.6 * speed + speed ** 2 / room.acceleration)
        moves += [Move(far, speed, 0.8 * room.acceleration),
                  Move(begin, speed, 0.8 * room.acceleration)]
    return Segment(name, f'{name}: {", ".join(f"{speed:.2g}" for speed in speeds)} {room.unit}/s '
                         f'from {begin:.3g} {room.unit}', tuple(moves))


def _creep(room: Room, begin: float, end: float, name: str) -> Segment:
    pace = room.pace(0.04)
    end = _within_leg(begin, end, pace)
    moves = (Move(begin, room.pace(0.5), 0.5 * room.acceleration, 0.1),
             Move(end, pace, 0.5 * room.acceleration, 0.1),
             Move(begin, pace, 0.5 * room.acceleration))
    return Segment(name, f'{name} at {pace:.2g} {room.unit}/s from {_angles(room, begin, end)}',
                   moves)


def _quick(room: Room, begin: float, end: float, name: str) -> Segment | None:
    length = min(abs(end - begin), room.speed ** 2 / room.acceleration, 0.15 * room.width)
    if length < 4.0 * room.finest:
        return None
    far = begin + math.copysign(length, end - begin)
    moves = [Move(begin, room.pace(0.5), 0.5 * room.acceleration, 0.1)]
    moves += [Move(target, room.speed, room.acceleration) for target in (far, begin) * 6]
    return Segment(name, f'{name}: {length:.2g} {room.unit} at {room.acceleration:.3g} '
                         f'{room.unit}/s² from {begin:.3g} {room.unit}', tuple(moves))


def _partial_loops(room: Room) -> Segment:
    parts = (0.1, 0.95, 0.3, 0.85, 0.4, 0.75, 0.5, 0.65, 0.1)
    moves = tuple(Move(room.at(part), room.pace(0.3), 0.4 * room.acceleration, 0.05)
                  for part in parts)
    return Segment('partial loops under load',
                   'partial loops between 95, 30, 85, 40, 75, 50 and 65 % of the load at '
                   f'{room.pace(0.3):.3g} {room.unit}/s', moves)


def _holds(room: Room) -> Segment:
    moves = [Move(room.at(0.1), room.pace(0.7), 0.6 * room.acceleration, 0.3)]
    probe = max(0.03 * room.width, 2.0 * room.finest)
    back = math.copysign(probe, room.angle[0] - room.angle[-1])
    speed = min(room.speed, max(probe / 0.15, 1.5 * room.slowest))
    for part in (0.9, 0.5):
        target = room.at(part)
        moves.append(Move(target, room.pace(0.7), 0.6 * room.acceleration))
        for _ in range(4):
            moves += [Move(target, speed, 0.5 * room.acceleration, 0.5),
                      Move(target + back, speed, 0.5 * room.acceleration)]
    return Segment('holds under load',
                   f'holds at 90 and 50 % of the load, probed by strokes of {probe:.2g} '
                   f'{room.unit} every half second', tuple(moves))


def _amplitudes(room: Room, length: float) -> list[float]:
    smallest = max(0.004 * room.width, room.finest)
    if smallest > 0.3 * length:
        return []
    return list(np.geomspace(smallest, length, 6 if length > 20.0 * smallest else 4))


def _within_leg(begin: float, end: float, speed: float) -> float:
    return begin + math.copysign(min(abs(end - begin), LONGEST_LEG * speed), end - begin)


def _angles(room: Room, begin: float, end: float) -> str:
    return f'{begin:.3g} to {end:.3g} {room.unit}'
