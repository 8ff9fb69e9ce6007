# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reference motions and the disc's profile for sealed cases.

A reference is a list of moves (where to, how fast) and holds, turned into positions and
velocities by trapezoids with limited acceleration. Angles in rad, times in s.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ['axis_motion', 'disc_profile', 'DiscProfile', 'joint_motion', 'Reference', 'rich',
           'routine', 'section', 'short_test']


@dataclass(frozen=True)
class Reference:
    """A sampled reference: `position` [rad], `velocity` [rad/s], `acceleration` [rad/s²]."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    rate: float

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return self.position.size / self.rate


@dataclass(frozen=True)
class DiscProfile:
    """Disc speed [rad/s] and pad temperature [°C] on the reference's grid."""

    speed: np.ndarray
    temperature: np.ndarray


class _Path:
    """Collects acceleration-limited moves on a fixed grid."""

    def __init__(self, rate: float, acceleration: float) -> None:
        self.rate = rate
        self.limit = acceleration
        self.at = 0.0
        self.pieces: list[np.ndarray] = []

    def hold(self, seconds: float) -> _Path:
        self.pieces.append(np.zeros(max(1, int(round(seconds * self.rate)))))
        return self

    def to(self, target: float, speed: float) -> _Path:
        """Move to `target` with a trapezoid of velocity that ends exactly there."""
        distance = target - self.at
        if abs(distance) < 1e-9:
            return self
        speed = min(speed, float(np.sqrt(self.limit * abs(distance))))
        ramp = max(2, int(round(speed / self.limit * self.rate)))
        flat = max(0, int(round(abs(distance) / speed * self.rate)) - ramp)
        up = np.arange(1, ramp + 1) / ramp
        shape = np.concatenate([up, np.ones(flat), up[::-1][1:], [0.0]])
        self.pieces.append(shape * distance / (shape.sum() / self.rate))
        self.at = target
        return self

    def wave(self, half_width: float, speeds: list[float], pause: float) -> _Path:
        centre = self.at
        for speed in speeds:
            self.to(centre + half_width, speed).hold(pause).to(centre - half_width, speed)
            self.hold(pause)
        return self.to(centre, speeds[-1])

    def seconds(self) -> float:
        return sum(piece.size for piece in self.pieces) / self.rate

    def done(self) -> Reference:
        velocity = np.concatenate(self.pieces)
        position = np.cumsum(velocity) / self.rate
        acceleration = np.gradient(velocity) * self.rate
        return Reference(position, velocity, acceleration, self.rate)


def _stroke(path: _Path, rng: np.random.Generator, top: float, speed: float) -> None:
    path.to(top, speed).hold(rng.uniform(0.4, 1.2)).to(0.0, speed * rng.uniform(0.8, 1.1))
    path.hold(rng.uniform(0.4, 0.7))


def _section(path: _Path, rng: np.random.Generator, kind: str, top: float) -> None:
    if kind == 'slow_stroke':
        path.to(top, rng.uniform(9, 15)).hold(rng.uniform(1.0, 1.6))
        path.to(0.0, rng.uniform(8, 13)).hold(0.5)
    elif kind == 'fast_strokes':
        for _ in range(rng.integers(1, 4)):
            path.to(top * rng.uniform(0.92, 1.0), rng.uniform(54, 75)).hold(0.4)
            path.to(0.0, rng.uniform(52, 70)).hold(rng.uniform(0.5, 0.8))
    elif kind == 'middle_strokes':
        for _ in range(rng.integers(1, 3)):
            _stroke(path, rng, top * rng.uniform(0.5, 0.75), rng.uniform(18, 30))
    elif kind == 'creep_at_load':
        start = top * rng.uniform(0.8, 0.86)
        path.to(start, 20.0).hold(0.3)
        path.to(start + rng.uniform(4, 5.5), rng.uniform(2.0, 3.0)).hold(0.2)
        path.to(start, rng.uniform(1.8, 2.8)).hold(0.4)
    elif kind == 'small_waves':
        path.to(top * rng.uniform(0.35, 0.85), rng.uniform(15, 22)).hold(0.5)
        path.wave(rng.uniform(0.3, 1.3), list(rng.uniform(3.0, 5.0, 2)), 0.12)
        path.wave(rng.uniform(0.8, 2.0), list(rng.uniform(3.0, 6.0, 2)), 0.12)
        path.hold(0.3)
    elif kind == 'stairs':
        for level in rng.uniform(0.3, 0.9, 3) * top:
            path.to(level, rng.uniform(13, 18)).hold(rng.uniform(1.6, 4.0))
    else:  # clearance_chirp
        path.to(rng.uniform(1.4, 1.8), 15.0).hold(0.2)
        width = rng.uniform(3.5, 7.0)
        for speed in (4.0, 12.0, 25.0, 45.0):
            path.to(path.at + width, speed).hold(0.15).to(path.at - width, speed).hold(0.15)


def rich(rng: np.random.Generator, rate: float = 1000.0) -> Reference:
    """Identification run of about 60 s: strokes of all speeds, creep, waves, holds, chirps."""
    path = _Path(rate, rng.uniform(600, 1100))
    path.hold(0.6)
    top = rng.uniform(33, 41)
    kinds = ['slow_stroke', 'fast_strokes', 'middle_strokes', 'creep_at_load', 'small_waves',
             'stairs', 'clearance_chirp']
    rest = kinds[1:]
    rng.shuffle(rest)
    for kind in [kinds[0], *rest]:
        _section(path, rng, kind, top)
    while path.seconds() < 54.0:
        _section(path, rng, str(rng.choice(kinds[1:])), top)
    return path.to(0.0, 25.0).hold(0.6).done()


def routine(rng: np.random.Generator, rate: float = 1000.0) -> Reference:
    """Plain braking of about 55 s: applies, holds, releases, now and then a modulated stop."""
    path = _Path(rate, rng.uniform(700, 1000))
    path.hold(0.6)
    park = rng.uniform(4.0, 6.5)
    while path.seconds() < 50.0:
        top, speed = rng.uniform(14, 28), rng.uniform(27, 40)
        path.to(top, speed).hold(rng.uniform(1.2, 2.8))
        if rng.random() < 0.15:  # as an antilock system does
            for _ in range(4):
                path.to(top - rng.uniform(3, 6), 40.0).hold(0.08).to(top, 40.0).hold(0.15)
        path.to(park if rng.random() < 0.25 else 0.0, speed).hold(rng.uniform(0.9, 1.8))
    return path.done()


def section(rng: np.random.Generator, count: int, seconds: float, mixed: bool = False,
            rate: float = 1000.0) -> list[Reference]:
    """`count` recordings of different manoeuvres, one kind each (`mixed`: all kinds in turn)."""
    kinds = ['slow_stroke', 'fast_strokes', 'middle_strokes', 'small_waves', 'stairs',
             'clearance_chirp', 'creep_at_load']
    rng.shuffle(kinds)
    found = []
    for number in range(count):
        path, turn = _Path(rate, rng.uniform(600, 1100)), number
        path.hold(0.6)
        top = rng.uniform(30, 40)
        while path.seconds() < seconds - 1.5:
            _section(path, rng, kinds[turn % len(kinds)], top)
            turn += 1 if mixed else 0
        found.append(path.to(0.0, 25.0).hold(0.5).done())
    return found


def joint_motion(rng: np.random.Generator, seconds: float, rate: float = 1000.0) -> Reference:
    """A joint that swings to both sides: from pose to pose, small waves, slow sweeps."""
    path = _Path(rate, rng.uniform(250, 500))
    path.hold(0.5)
    while path.seconds() < seconds - 2.0:
        kind = rng.integers(0, 3)
        if kind == 0:
            for target in rng.uniform(-30, 30, 3):
                path.to(target, rng.uniform(20, 58)).hold(rng.uniform(0.1, 0.5))
        elif kind == 1:
            path.wave(rng.uniform(1.5, 6.0), list(rng.uniform(4.0, 25.0, 2)), 0.05)
        else:
            path.to(rng.uniform(10, 28), rng.uniform(8, 16)).to(-rng.uniform(10, 28), 12.0)
    return path.to(0.0, 25.0).hold(0.4).done()


def axis_motion(rng: np.random.Generator, seconds: float, rate: float = 1000.0) -> Reference:
    """A linear axis: full strokes to and fro, jerky steps, slow travel, dither about a place."""
    path = _Path(rate, rng.uniform(350, 700))
    path.hold(0.5)
    top = rng.uniform(28, 40)
    while path.seconds() < seconds - 2.0:
        kind = rng.integers(0, 4)
        if kind == 0:
            speed = rng.uniform(35, 60)
            path.to(top, speed).hold(0.2).to(0.0, speed).hold(0.2)
        elif kind == 1:
            for target in np.sort(rng.uniform(0, top, 4)):
                path.to(target, rng.uniform(30, 55)).hold(rng.uniform(0.05, 0.3))
        elif kind == 2:
            path.to(path.at + (10.0 if path.at < top / 2 else -10.0), rng.uniform(3.0, 9.0))
        else:
            path.wave(rng.uniform(0.8, 3.0), list(rng.uniform(4.0, 20.0, 2)), 0.05)
    return path.to(0.0, 40.0).hold(0.4).done()


def short_test(rng: np.random.Generator, plain: bool, rate: float = 1000.0,
               length: float | None = None) -> Reference:
    """Another reference of 24 to 30 s (or `length`) to judge the corrected model on."""
    path = _Path(rate, rng.uniform(500, 1000))
    path.hold(0.6)
    reach = (20, 25) if plain else (30, 39)
    length = rng.uniform(23.0, 27.5) if length is None else length
    while path.seconds() < length:
        path.to(rng.uniform(0.3, 1.0) * rng.uniform(*reach), float(np.exp(rng.uniform(2, 4))))
        path.hold(rng.uniform(0.4, 1.3))
        if rng.random() < 0.6:
            path.wave(rng.uniform(0.8, 1.5), [rng.uniform(3.0, 5.0), rng.uniform(3.0, 7.0)], 0.1)
            path.hold(0.2)
        path.to(rng.uniform(2.0, 9.0), float(np.exp(rng.uniform(2, 4)))).hold(rng.uniform(.3, 1.))
        if rng.random() < 0.4:
            path.wave(rng.uniform(0.7, 1.2), list(rng.uniform(3.0, 6.0, 2)), 0.1).hold(0.2)
    return path.to(0.0, 25.0).hold(0.5).done()


def disc_profile(
    rng: np.random.Generator, reference: Reference, reversing: bool = False
) -> DiscProfile:
    """Stops from 30 to 85 rad/s; the pads heat while the disc turns under the brake, then cool.

    With `reversing`, some of the stops are driven backwards (negative speed).
    """
    rate, count = reference.rate, reference.position.size
    speed = np.zeros(count)
    at = rng.uniform(3.0, 6.0)
    while at < reference.duration - 2.0:
        peak, length = rng.uniform(40, 85), rng.uniform(3.5, 7.5)
        left = peak * rng.uniform(0.25, 0.85)
        sign = -0.6 if reversing and rng.random() < 0.4 else 1.0
        knots = at + np.array([0.0, 0.45, length, length + 0.5])
        local = np.interp(np.arange(count) / rate, knots, [0.0, peak, left, 0.0])
        speed += sign * local
        at = knots[-1] + rng.uniform(2.5, 6.0)
    load = np.clip(reference.position / 30.0, 0.0, 1.3) ** 1.7
    heat = rng.uniform(0.25, 0.7) * load * np.abs(speed)
    cool, slow = rng.uniform(0.004, 0.012), rng.uniform(0.6, 1.5)
    temperature, felt = np.empty(count), np.empty(count)
    core = skin = ambient = rng.uniform(25, 50)
    for k in range(count):
        core += (heat[k] - cool * (core - ambient)) / rate
        skin += (core - skin) / slow / rate
        temperature[k], felt[k] = core, skin
    return DiscProfile(speed, felt)
