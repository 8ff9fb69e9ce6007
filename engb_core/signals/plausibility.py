# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whether a recording can be what it says: units, a signal that is missing, an angle that wraps.

A recording in degrees or amperes gets a name for physics that isn't there: scaled wrongly, every
effect looks like some other one. What tells it is the model file with no number refitted.

Effort: which one factor makes the file's torque of the motion and the recorded effort most alike
is known by projection. Where it is above 10 or below 0.1, or negative, and the two are alike then,
something is in another unit: no machine differs from its file like that, whatever it misses. So it
is where position holds whole numbers only, where a second passes between samples, and where
nothing could turn that fast.

Which unit it is follows from what the file explains with the usual ones. Where several explain it,
all of them are told as a question: who is told a wrong unit with certainty is worse off than who
is asked.

Where nothing of this is so, the recording as it stands may be one of such a machine with other
numbers. Then a usual slip of position or time is told only where

- the file explains most of the effort with it, and far more than with the recording as it stands,
  or just more where effort is then in a known unit,
- no factor nearby does it clearly better, and those further off do it worse: the data determine
  it, and it is not a number of the file that is off by another factor,
- a free refit of inertia, friction and load to the recording as it stands explains hardly more:
  a cause within the machine is not needed.

Of two usual factors at once, of position and of effort, the last two are not asked: they are no
chance.
"""

from __future__ import annotations

from collections.abc import Sequence
import dataclasses
from dataclasses import dataclass
import math

import numpy as np

from engb_core.errors import InputError
from engb_core.model import Joint, Model
from engb_core.physics.command_law import command_law
from engb_core.recording import Recording
from engb_core.signals.unit_readings import clocks, OTHER_QUANTITY, Reading, SI, Unit, UnitReadings

__all__ = ['Plausibility', 'refuse_implausible', 'refuse_unmeasured']

# What may be left of the effort, rms over rms, where the file explains it: three quarters of the
# variance are gone.
MOST = 0.5
# Half of the effort is along what the file wants: the factor between them is then one.
ALIKE = math.sqrt(0.75)
# A slip leaves at most this part of what is left without it (both with the best factor of
# effort); of what fits that much worse nobody is asked.
BETTER = 0.5
# So many possibilities are told one by one.
TOLD = 3
# A free refit leaves at least this part of what the scaled model does.
NEAR_FREE = 0.3
# Factors beside a slip's own, in octaves, that tell whether the data determine it, and by how
# much the outermost must be worse, and the others may be better: physics that the file lacks, and
# numbers that are off by a third, move the best factor a little.
BESIDE, WORSE = (-1.5, -1.0, -0.5, 0.5, 1.0, 1.5), 1.1
# Nobody records a motion with more than this from one sample to the next [s]: of what is faster
# than 1 Hz nothing would be seen.
SLOWEST = 0.5
# Nothing turns faster [rad/s], nor moves so along an axis [m/s]: the fastest turbines of dentists'
# drills and linear motors of magnetic trains do not.
FASTEST = {'revolute': 1e5, 'prismatic': 200.0}
# No encoder resolves a radian or a metre and no less: so many different whole numbers are counts.
WHOLE = 10
# A jump of the angle of at least this part of its range, against the motion, is a wrap.
OF_RANGE = 0.9
# Samples from one jump to the one back that a reading error takes at most.
MISREAD = 5


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
        if not self._counted:
            return ''
        return (f'position holds whole numbers only: counts of an encoder, not '
                f'{self._si("position")}; record in SI units, or import the table with --unit '
                'position=N/rev, N the counts in a turn')

    def _slow(self) -> str:
        interval = self.recording.interval
        if interval <= SLOWEST:
            return ''
        unit = next(iter(clocks(interval)), None)
        looks = '' if unit is None else f': time looks like {unit.name}, not s'
        remedy = '' if unit is None else (
            f', or import the table with --scale time={unit.factor:.7g}')
        return (f'samples lie {interval:.4g} s apart, and between them a motion is not seen'
                f'{looks}; record faster{remedy}')

    @property
    def _counted(self) -> bool:
        position = self.recording.position
        # Numbers so large that no fraction has room in them are no counts either.
        return bool(np.unique(position).size >= WHOLE and (position == np.rint(position)).all()
                    and np.abs(position).max() < 2.0 ** 53)

    def _units(self) -> str:
        if command_law(self.recording) is not None:
            # What was asked for need not be alike the torque of the motion, whatever its unit.
            return ''
        if np.ptp(self.recording.position) == 0.0:
            return ''
        readings = UnitReadings(self.recording, self.model)
        stands = readings.read(SI, SI)
        slow = self.recording.interval > SLOWEST
        fast = not slow and readings.speed > FASTEST[self.model.joint.type]
        if slow or fast or self._counted or (stands.left < ALIKE and stands.efforts != (SI,)):
            return self._certainly_not_si(readings, stands, slow, fast)
        best = min((reading for place in readings.places(False) for clock in readings.clocks()
                    if (place, clock) != (SI, SI)
                    and _usual(reading := readings.read(place, clock))),
                   key=lambda reading: reading.left, default=None)
        if best is None or not best.efforts or not self._slipped(readings, stands, best):
            return ''
        return self._told([(best.place, best.clock, effort) for effort in best.efforts], best.left)

    def _slipped(self, readings: UnitReadings, stands: Reading, best: Reading) -> bool:
        """Whether a recording that could be one of such a machine is in other units."""
        # Two usual factors at once are no chance.
        two = best.efforts != (SI,)
        if not best.left < min(MOST, (1.0 if two else BETTER) * stands.left):
            return False
        if best.place is not SI:        # Factors of time are a thousand apart.
            beside = [readings.read(dataclasses.replace(
                best.place, factor=best.place.factor * 2.0 ** octaves), best.clock).left
                for octaves in BESIDE]
            if min(beside[0], beside[-1]) <= WORSE * best.left or (
                    not two and WORSE * min(beside) < best.left):
                return False
        return two or readings.left_by_free_refit() >= NEAR_FREE * best.left

    def _certainly_not_si(self, readings: UnitReadings, stands: Reading, slow: bool,
                          fast: bool) -> str:
        """Tell what a recording that cannot be in SI units is in; ask where several units fit."""
        fits = []
        for place in readings.places(self._counted):
            for clock in readings.clocks():
                if (fast and place is SI) or (slow and clock is SI):
                    continue
                reading = readings.read(place, clock)
                if reading.left < ALIKE and reading.efforts and _usual(reading):
                    fits.append(reading)
        least = min((self._cost(reading) for reading in fits if reading.left < MOST), default=0.0)
        fits = sorted((reading for reading in fits if BETTER * self._cost(reading) < least),
                      key=self._cost)
        units = [(reading.place, reading.clock, effort)
                 for reading in fits for effort in reading.efforts]
        if 0 < len(units) <= TOLD:
            return self._told(units, fits[0].left)
        if self._counted:
            remedies = [f' and --scale time={unit.factor:.7g}' for unit in clocks(
                self.recording.interval)] if slow else []
            return self._whole() + ''.join(remedies[:1])
        if fast:
            return (f'position moves at {readings.speed:.3g} {self._si("position")}/s, faster '
                    'than anything does: it is in another unit; record in SI units, or import '
                    'the table with --unit position=UNIT')
        if slow or not (units or stands.left < MOST):
            return ''       # The interval is told by itself.
        return (f'effort is {1.0 / abs(stands.factor):.2g} of what the motion needs: effort or '
                f'position is not in {self._si("effort")} and {self._si("position")}; record in '
                'SI units, or import the table with --unit position=UNIT effort=UNIT')

    @staticmethod
    def _cost(reading: Reading) -> float:
        """Return what is left, with what each further quantity in a wrong unit must be worth."""
        wrong = (reading.place is not SI) + (reading.clock is not SI) + (SI not in reading.efforts)
        return reading.left / BETTER ** wrong

    def _told(self, units: Sequence[tuple[Unit, Unit, Unit]], left: float) -> str:
        """Return the line for units of position, time and effort: one, or several that fit."""
        explained = f'{1.0 - left ** 2:.0%} of it with no number changed'
        wrong = [[(name, unit) for name, unit in (
            ('position', place), ('effort', effort), ('time', clock)) if unit is not SI]
            for place, clock, effort in units]
        remedies = [' '.join(f'--scale {name}={unit.factor:.7g}' for name, unit in one)
                    for one in wrong]
        if len(units) == 1:
            looks = ' and '.join(f'{name} looks like {unit.name}, not {self._si(name)}'
                                 for name, unit in wrong[0])
            return (f'{looks}: scaled so, the model explains {explained}; record in SI units, '
                    f'or import the table with {remedies[0]}')
        looks = ', or '.join(
            ' and '.join(f'{name} in {unit.name}' for name, unit in one) + f' ({remedy})'
            for one, remedy in zip(wrong, remedies, strict=True))
        return (f'not in SI units; it looks like {looks}: which, the motion does not tell, and '
                f'the model then explains up to {explained}; record in SI units, or import the '
                'table with what is right of these')

    def _si(self, name: str) -> str:
        linear = self.model.joint.type == 'prismatic'
        return {'position': 'm' if linear else 'rad', 'effort': 'N' if linear else 'N·m',
                'time': 's'}[name]


def _usual(reading: Reading) -> bool:
    """Whether effort isn't in a unit so much larger, which nobody takes beside another slip."""
    return (reading.place, reading.clock) == (SI, SI) or abs(reading.factor) <= OTHER_QUANTITY


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
