# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which units the numbers of a recording can be in, by what its model file says of the motion.

A reading says what position and time are; effort's unit then follows from the one factor that
makes effort and the file's torque most alike.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property, lru_cache
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.model import Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.nominal_torque import nominal_vector
from engb_core.physics.plant import load_torques, physics_of
from engb_core.recording import Recording
from engb_core.signals.motion import Motion, motion_of

__all__ = ['OTHER_QUANTITY', 'Reading', 'SI', 'Unit', 'UnitReadings', 'clocks']

Array = NDArray[np.float64]

# Effort that is off by more than such a factor, or by less than its inverse, is another quantity.
OTHER_QUANTITY = 10.0
# How far a file's numbers are off in good faith, as the logarithm of their factor: about 30 %. A
# unit can be one whose factor lies within two of that.
HONEST = 0.26
# No motor takes more [A]: effort is in a larger unit than N·m only where it needs no more.
MOST_CURRENT = 1e4
# An encoder's counts in a turn: powers of two, and four times the usual lines of optical ones.
COUNTS = tuple(2 ** power for power in range(8, 25)) + tuple(
    4 * lines for lines in (100, 200, 250, 360, 400, 500, 1000, 1250, 2000, 2500, 3600, 5000))
# Sampling intervals of recordings [s]: 50 kHz to 17 Hz.
INTERVALS = 2e-5, 0.06
# Samples looked at: a diagnosis takes seconds, this must not.
LONGEST = 10_000


@dataclass(frozen=True)
class Unit:
    """What one multiplies with to get SI units, and what the numbers then are."""

    factor: float
    name: str


SI = Unit(1.0, '')
_CLOCKS = (Unit(1e-3, 'ms'), Unit(1e-6, 'µs'), Unit(1e-9, 'ns'))


def clocks(interval: float) -> tuple[Unit, ...]:
    """Return the units of time in which samples would lie as far apart as in recordings."""
    return tuple(unit for unit in _CLOCKS
                 if INTERVALS[0] <= interval * unit.factor <= INTERVALS[1])


@dataclass(frozen=True)
class Reading:
    """How alike effort and the file's torque are, with position and time read so.

    Attributes:
        place: unit of position.
        clock: unit of time.
        left: what is left of effort at best, rms over rms.
        factor: of effort that this takes.
        efforts: what effort can be then, the likeliest first; nothing if it is no usual quantity.
    """

    place: Unit
    clock: Unit
    left: float
    factor: float
    efforts: tuple[Unit, ...]


class UnitReadings:
    """The readings of one recording beside a model, by its middle where it is long."""

    def __init__(self, recording: Recording, model: Model) -> None:
        if recording.time.size > LONGEST:
            begin = (recording.time.size - LONGEST) // 2
            recording = recording.between(recording.time[begin], recording.time[begin + LONGEST])
        self._recording, self._model = recording, model
        self._linear = model.joint.type == 'prismatic'
        self.read = lru_cache(maxsize=None)(self._read)

    @cached_property
    def speed(self) -> float:
        """How fast the motion is as it stands [rad/s or m/s]."""
        return _motion(self._recording, 1.0, 1.0).speed

    def places(self, counted: bool) -> tuple[Unit, ...]:
        """Return what position can be; `counted`: an encoder's counts."""
        if self._linear:
            return (Unit(1e-6, 'µm') if counted else SI, Unit(1e-3, 'mm'))
        if not counted:
            return (SI, Unit(math.pi / 180.0, 'degrees'), Unit(2.0 * math.pi, 'turns'))
        return tuple(Unit(2.0 * math.pi / counts, f'counts of {counts} in a turn')
                     for counts in COUNTS)

    def clocks(self) -> tuple[Unit, ...]:
        """Return what time can be."""
        return (SI, *clocks(self._recording.interval))

    def _read(self, place: Unit, clock: Unit) -> Reading:
        motion = _motion(self._recording, place.factor, clock.factor)
        effort = motion.effort[motion.known]
        with np.errstate(all='ignore'):
            wanted = effort_of_motion(motion.samples(), motion.step, physics_of(self._model))
            wanted = wanted[motion.known]
            both = float(effort @ wanted)
            sizes = float(np.linalg.norm(effort) * np.linalg.norm(wanted))
            cosine = both / sizes if sizes > 0.0 else 0.0
            if not math.isfinite(cosine) or both == 0.0:
                return Reading(place, clock, 1.0, 1.0, (SI,))
            factor = float(wanted @ wanted) / both
            power = float(effort @ motion.velocity[motion.known])
        left = math.sqrt(max(1.0 - cosine ** 2, 0.0))
        return Reading(place, clock, left, factor, self._efforts(factor, power))

    def _efforts(self, factor: float, power: float) -> tuple[Unit, ...]:
        """Return what effort can be, told by the factor that makes it the torque of the motion,
        and by the motor's mean power."""
        if factor < 0.0 and power > 0.0:
            # The motor drives: it is the file's load that acts the other way.
            return (SI,)
        sign, opposite = (1.0, '') if factor > 0.0 else (-1.0, ' of the opposite sign')
        size = abs(factor)
        if 1.0 / OTHER_QUANTITY <= size <= OTHER_QUANTITY:
            return (SI,) if factor > 0.0 else (Unit(
                -1.0, 'a torque of the opposite sign (or position is counted backwards)'),)
        constant = self._model.motor.torque_constant
        known = [Unit(1e-3, 'mN'), Unit(1e3, 'kN')] if self._linear else [
            Unit(1e-3, 'mN·m'), Unit(1e-2, 'N·cm'), Unit(1e3, 'kN·m')]
        known += [Unit(constant, 'amperes'), Unit(1e-3 * constant, 'milliamperes')]
        off = {unit: abs(math.log(size / unit.factor)) for unit in known}
        most = constant * MOST_CURRENT / float(np.abs(self._recording.effort).max())
        near = sorted((unit for unit in known if off[unit] < 2.0 * HONEST and (
            unit.factor < 1.0 or unit.factor < most)), key=off.__getitem__)
        if near:
            return tuple(Unit(sign * unit.factor, unit.name + opposite) for unit in near)
        if not 1.0 / OTHER_QUANTITY <= size / constant <= OTHER_QUANTITY:
            return ()
        shown = float(f'{size:.2g}')
        per = 'N/A' if self._linear else 'N·m/A'
        return (Unit(sign * shown, f'a current of a motor with {shown:g} {per} (the file says '
                     f'{constant:g}){opposite}'),)

    def left_by_free_refit(self) -> float:
        """Return what a free refit of inertia, friction, load and offset to the recording as it
        stands leaves, rms over rms."""
        motion = _motion(self._recording, 1.0, 1.0)
        speed = motion.velocity / (np.abs(motion.velocity).max() or 1.0)
        angle = motion.position - motion.position.mean()
        angle /= np.abs(angle).max() or 1.0
        load = load_torques(nominal_vector(self._model), motion.position)
        columns = np.stack([motion.acceleration, speed, np.tanh(50.0 * speed), load,
                            np.ones(speed.size), *(angle ** power for power in (1, 2, 3))], 1)
        columns = columns[motion.known]
        columns = columns / np.maximum(np.abs(columns).max(axis=0), 1e-300)
        effort = motion.effort[motion.known]
        if not np.isfinite(columns).all():
            return 0.0
        fitted = columns @ np.linalg.lstsq(columns, effort, rcond=None)[0]
        return _part(effort - fitted, effort)


def _motion(recording: Recording, position: float, time: float) -> Motion:
    # A grid begins at 0, the middle of a long recording doesn't.
    return motion_of(dataclasses.replace(
        recording, time=(recording.time - recording.time[0]) * time,
        position=recording.position * position, velocity=None, reference=None, signals={}))


def _part(rest: Array, whole: Array) -> float:
    """Return rms over rms; infinite where there is nothing to compare with."""
    size = float(np.linalg.norm(whole))
    left = float(np.linalg.norm(rest))
    return left / size if size > 0.0 and math.isfinite(left) else math.inf
