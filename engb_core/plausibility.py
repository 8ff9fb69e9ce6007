# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whether a recording can be what it says: units, a signal that is missing, an angle that wraps.

A recording in degrees or amperes gets a name for physics that isn't there: scaled wrongly, every
effect looks like some other one. What tells it is the model file with no number refitted.

Effort: which one factor makes the file's torque of the motion and the recorded effort most alike
is known by projection. Where it is above 10 or below 0.1, or negative, and the two are alike then,
effort is no torque in N·m: no machine differs from its file like that, whatever it misses.

Position and time: the factors of the usual slips are known exactly. One is told where

- the file explains most of the effort with it, and far more than with the recording as it stands,
  or just more where another sign tells of a slip: as it stands that is no recording of such a
  machine (effort is another quantity, a second passes between samples), or effort is then in a
  known unit,
- no factor nearby does it (then: clearly) better, and those further off do it worse: the data
  determine it, and it is not a number of the file that is off by another factor,
- a free refit of inertia, friction and load to the recording as it stands explains hardly more:
  a cause within the machine is not needed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import dataclasses
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.command_law import command_law
from engb_core.errors import InputError
from engb_core.model import Joint, Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import load_torques, nominal_vector, physics_of
from engb_core.recording import Recording
from engb_core.signals.motion import Motion, motion_of

__all__ = ['Plausibility', 'refuse_implausible', 'refuse_unmeasured']

Array = NDArray[np.float64]

# What may be left of the effort, rms over rms, where the file explains it: three quarters of the
# variance are gone.
MOST = 0.5
# A slip leaves at most this part of what is left as it stands (both with the best factor of
# effort).
BETTER = 0.5
# Effort that is off by more than such a factor, or by less than its inverse, is another quantity.
OTHER_QUANTITY = 10.0
# Torque constants in data sheets hold within so much; a unit is named if the factor is that near.
LIKE = 1.25
# Encoders that are told apart differ by more.
NEAR = 1.05
# How much more a free refit may leave unexplained at least, as a part of the scaled model's rms.
NEAR_FREE = 0.3
# Factors beside a slip's own, in octaves, that tell whether the data determine it, and by how
# much the outermost must be worse, and others may be better where another sign tells of a slip:
# physics that the file lacks moves the best factor a little.
BESIDE, WORSE = (-1.5, -1.0, -0.5, 0.5, 1.0, 1.5), 1.1
# An encoder's counts in a turn: powers of two, and four times the usual lines of optical ones.
COUNTS = tuple(2 ** power for power in range(8, 25)) + tuple(
    4 * lines for lines in (100, 200, 250, 360, 400, 500, 1000, 1250, 2000, 2500, 3600, 5000))
# Sampling intervals of recordings [s]: 50 kHz to 17 Hz.
INTERVALS = 2e-5, 0.06
# Nobody records a motion with more than this from one sample to the next [s]: of what is faster
# than 1 Hz nothing would be seen.
SLOWEST = 0.5
# No encoder resolves a radian or a metre and no less: so many different whole numbers are counts.
WHOLE = 10
# Samples looked at: a diagnosis takes seconds, this must not.
LONGEST = 10_000
# A jump of the angle of at least this part of its range, against the motion, is a wrap.
OF_RANGE = 0.9
# Samples from one jump to the one back that a reading error takes at most.
MISREAD = 5


@dataclass(frozen=True)
class _Unit:
    """A usual slip: what one multiplies with to get SI units, what the numbers then are, and
    whether the factor is one that was known before the data were seen."""

    factor: float
    name: str
    known: bool = False


_SI = _Unit(1.0, '')
CLOCKS = (_Unit(1e-3, 'ms'), _Unit(1e-6, 'µs'), _Unit(1e-9, 'ns'))


@dataclass(frozen=True)
class _Likeness:
    """Of recorded effort and the file's torque: what is left of effort at best, rms over rms; the
    factor of effort that this takes; the motor's mean power [arbitrary unit]."""

    left: float
    factor: float
    power: float


@dataclass(frozen=True)
class Plausibility:
    """What one recording looks like beside a model."""

    recording: Recording
    model: Model

    def fault(self) -> str:
        """Return in one line what is wrong with the recording, and the remedy ('' for nothing)."""
        return self._missing() or self._wrapped() or self._units() or self._whole() or self._slow()

    def fault_alone(self) -> str:
        """Return the same of what needs no model to be told."""
        return self._missing() or self._wrapped() or self._whole() or self._slow()

    def _missing(self) -> str:
        effort = self.recording.effort
        # Where nothing moves, it is that which is told, by the one who needs the motion.
        if np.ptp(effort) == 0.0 and np.ptp(self.recording.position) > 0.0:
            unit = self._si('effort')
            return (f'effort is {effort[0] + 0.0:g} {unit} in all {effort.size} samples: nothing '
                    'was measured; record torque constant times measured current as effort')
        return ''

    def _wrapped(self) -> str:
        position = self.recording.position
        step = np.diff(position)
        span = float(np.ptp(position))
        jump = np.flatnonzero(np.abs(step) > OF_RANGE * span)
        # There and back within a few samples: those were misread, the angle didn't begin again.
        back = np.flatnonzero((np.diff(jump) < MISREAD) & (np.diff(np.sign(step[jump])) != 0.0))
        jump = np.delete(jump, np.union1d(back, back + 1))
        jump = jump[(jump > 0) & (jump < step.size - 1)]
        # The motion goes on behind it as before it: the angle began again.
        against = jump[(np.sign(step[jump - 1]) == -np.sign(step[jump]))
                       & (np.sign(step[jump + 1]) == -np.sign(step[jump]))]
        if against.size < 2:
            return ''
        return (f'position jumps by {np.median(np.abs(step[against])):.4g} '
                f'{self._si("position")} and begins again, {against.size} times: an angle within '
                'one turn; add the turns (numpy.unwrap) before recording or importing it')

    def _whole(self) -> str:
        position = self.recording.position
        if np.unique(position).size < WHOLE or not (position == np.rint(position)).all():
            return ''
        return (f'position holds whole numbers only: counts of an encoder, not '
                f'{self._si("position")}; record in SI units, or import the table with --unit '
                'position=N/rev, N the counts in a turn')

    def _slow(self) -> str:
        interval = self.recording.interval
        if interval <= SLOWEST:
            return ''
        unit = next((unit for unit in CLOCKS
                     if INTERVALS[0] <= interval * unit.factor <= INTERVALS[1]), None)
        looks = '' if unit is None else f': time looks like {unit.name}, not s'
        remedy = '' if unit is None else (
            f', or import the table with --scale time={unit.factor:.7g}')
        return (f'samples lie {interval:.4g} s apart, and between them a motion is not seen'
                f'{looks}; record faster{remedy}')

    def _units(self) -> str:
        if command_law(self.recording) is not None:
            # What was asked for need not be alike the torque of the motion, whatever its unit.
            return ''
        recording = self._short()
        stands = self._likeness(recording, 1.0, 1.0)
        position, time, found = _SI, _SI, stands
        slips = [(self._likeness(recording, place.factor, clock.factor), place, clock)
                 for place, clock in self._slips(recording)]
        # Nobody records effort in a unit that much larger, and position in a wrong one beside.
        best = min((entry for entry in slips if abs(entry[0].factor) <= OTHER_QUANTITY),
                   key=lambda entry: entry[0].left, default=(stands, _SI, _SI))
        # Two known factors at once are no chance, and one is less so where something is wrong.
        sure = not self._possible(stands) or self._effort_unit(best[0]).known
        better, near = (1.0, WORSE) if sure else (BETTER, 1.0)
        if best[0].left < MOST and best[0].left < better * stands.left \
                and self._determined(recording, *best, near) \
                and self._free(recording) >= NEAR_FREE * best[0].left:
            found, position, time = best
        if not found.left < MOST:
            return ''
        effort = self._effort_unit(found)
        if effort is _SI and position is _SI and time is _SI:
            return ''
        told, remedy = [], []
        for name, unit in (('position', position), ('effort', effort), ('time', time)):
            if unit is not _SI:
                told.append(f'{name} looks like {unit.name}, not {self._si(name)}')
                remedy.append(f'--scale {name}={unit.factor:.7g}')
        return (f'{" and ".join(told)}: scaled so, the model explains '
                f'{1.0 - found.left ** 2:.0%} of it with no number changed; record in SI units, '
                f'or import the table with {" ".join(remedy)}')

    def _possible(self, stands: _Likeness) -> bool:
        """Whether the recording, as it stands, could be one of such a machine at all."""
        return (1.0 / OTHER_QUANTITY <= abs(stands.factor) <= OTHER_QUANTITY
                and self.recording.interval <= SLOWEST)

    def _effort_unit(self, found: _Likeness) -> _Unit:
        """Return what effort is, told by the factor that makes it the torque of the motion."""
        if found.factor < 0.0 and found.power > 0.0:
            # The motor drives: it is the file's load that acts the other way.
            return _SI
        sign, opposite = (1.0, '') if found.factor > 0.0 else (-1.0, ' of the opposite sign')
        size = abs(found.factor)
        if 1.0 / OTHER_QUANTITY <= size <= OTHER_QUANTITY:
            return _Unit(-1.0, 'a torque of the opposite sign (or position is counted '
                         'backwards)') if opposite else _SI
        linear = self.model.joint.type == 'prismatic'
        constant = self.model.motor.torque_constant
        known = [_Unit(1e-3, 'mN'), _Unit(1e3, 'kN')] if linear else [
            _Unit(1e-3, 'mN·m'), _Unit(1e-2, 'N·cm'), _Unit(1e3, 'kN·m')]
        known += [_Unit(constant, 'amperes'), _Unit(1e-3 * constant, 'milliamperes')]
        near = min(known, key=lambda unit: abs(math.log(size / unit.factor)))
        # What the file doesn't explain may be alike what it does, and take part in the factor.
        if abs(math.log(size / near.factor)) < math.log(LIKE * (1.0 + found.left)):
            return _Unit(sign * near.factor, near.name + opposite, known=True)
        shown = float(f'{size:.2g}')
        per = 'N/A' if linear else 'N·m/A'
        return _Unit(sign * shown, (
            f'a current of a motor with {shown:g} {per} (the file says {constant:g})'
            if size < 1.0 else f'another quantity ({1.0 / size:.2g} of what the motion needs)')
            + opposite)

    def _si(self, name: str) -> str:
        linear = self.model.joint.type == 'prismatic'
        return {'position': 'm' if linear else 'rad', 'effort': 'N' if linear else 'N·m',
                'time': 's'}[name]

    def _short(self) -> Recording:
        """Return the recording, or its middle where it is long."""
        recording = self.recording
        if recording.time.size <= LONGEST:
            return recording
        begin = (recording.time.size - LONGEST) // 2
        return recording.between(recording.time[begin], recording.time[begin + LONGEST])

    def _slips(self, recording: Recording) -> Iterator[tuple[_Unit, _Unit]]:
        """Yield what position and time may be."""
        positions = [_Unit(1e-3, 'mm')] if self.model.joint.type == 'prismatic' else [
            _Unit(math.pi / 180.0, 'degrees'), _Unit(2.0 * math.pi, 'turns')]
        if self.model.joint.type != 'prismatic' and (
                recording.position == np.rint(recording.position)).all():
            positions += [_Unit(2.0 * math.pi / counts, f'counts of {_alike(counts)} in a turn')
                          for counts in COUNTS]
        times = [unit for unit in CLOCKS
                 if INTERVALS[0] <= recording.interval * unit.factor <= INTERVALS[1]]
        yield from ((position, _SI) for position in positions)
        yield from ((_SI, time) for time in times)
        yield from ((position, time) for position in positions[:2] for time in times)

    def _likeness(self, recording: Recording, position: float, time: float) -> _Likeness:
        """Return how alike effort and the torque that the file needs for the motion are."""
        motion = _motion(recording, position, time)
        effort = motion.effort[motion.known]
        with np.errstate(all='ignore'):
            wanted = effort_of_motion(motion.samples(), motion.step, physics_of(self.model))
            wanted = wanted[motion.known]
            both = float(effort @ wanted)
            sizes = float(np.linalg.norm(effort) * np.linalg.norm(wanted))
            cosine = both / sizes if sizes > 0.0 else 0.0
        if not math.isfinite(cosine) or both == 0.0:
            return _Likeness(1.0, 1.0, 1.0)
        return _Likeness(math.sqrt(max(1.0 - cosine ** 2, 0.0)), float(wanted @ wanted) / both,
                         float(effort @ motion.velocity[motion.known]))

    def _determined(self, recording: Recording, found: _Likeness, position: _Unit,
                    time: _Unit, near: float) -> bool:
        """Whether the data tell the factor of position: none nearby is better, by more than
        `near`, those further off are worse. (Factors of time are a thousand apart.)"""
        if position is _SI:
            return True
        left = [self._likeness(recording, position.factor * 2.0 ** octaves, time.factor).left
                for octaves in BESIDE]
        return min(left) * near >= found.left and min(left[0], left[-1]) > WORSE * found.left

    def _free(self, recording: Recording) -> float:
        """Return what a free refit of inertia, friction, load and offset leaves, rms over rms."""
        motion = _motion(recording, 1.0, 1.0)
        speed = motion.velocity / (np.abs(motion.velocity).max() or 1.0)
        angle = motion.position - motion.position.mean()
        angle /= np.abs(angle).max() or 1.0
        load = load_torques(nominal_vector(self.model), motion.position)
        columns = np.stack([motion.acceleration, speed, np.tanh(50.0 * speed), load,
                            np.ones(speed.size), *(angle ** power for power in (1, 2, 3))], 1)
        columns = columns[motion.known]
        columns = columns / np.maximum(np.abs(columns).max(axis=0), 1e-300)
        effort = motion.effort[motion.known]
        if not np.isfinite(columns).all():
            return 0.0
        fitted = columns @ np.linalg.lstsq(columns, effort, rcond=None)[0]
        return _part(effort - fitted, effort)


def _alike(counts: int) -> str:
    """Return encoders' counts that a file with honest errors cannot tell from these."""
    near = [other for other in COUNTS if other != counts and 1.0 / NEAR < other / counts < NEAR]
    return ' or '.join(map(str, (counts, *near)))


def refuse_implausible(recordings: Sequence[Recording], model: Model) -> None:
    """Raise InputError where a recording cannot be what it says; names it and the remedy."""
    for recording in recordings:
        fault = Plausibility(recording, model).fault()
        if fault:
            raise InputError(f'{recording.name}: {fault}')


def refuse_unmeasured(recordings: Sequence[Recording], joint: Joint) -> None:
    """Raise InputError where a recording cannot be one of any axis; names it and the remedy."""
    for recording in recordings:
        fault = Plausibility(recording, Model(joint=joint)).fault_alone()
        if fault:
            raise InputError(f'{recording.name}: {fault}')


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
