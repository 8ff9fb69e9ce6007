# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whether a recording can be what it says: units, a signal that is missing, an angle that wraps.

A recording in degrees or amperes gets a name for physics that isn't there: scaled wrongly, every
effect looks like some other one. What tells it is the model file with no number refitted.

Position, time and effort: the units that people take are readings of the recording, weighed
against each other by what the model file says of its torques (unit_slips.py).
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
from engb_core.recording import Recording
from engb_core.signals.motion import Motion, motion_of
from engb_core.unit_slips import Fit, LOSS, PRIORS, Reading, SI, Unit, USUAL_SPREAD, Weigher

__all__ = ['Plausibility', 'refuse_implausible', 'refuse_unmeasured']

Array = NDArray[np.float64]

# What the file leaves of the effort, rms over rms, where it can be said to explain it.
MOST = 0.5
# Encoders that are told apart differ by more.
NEAR = 1.05
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


CLOCKS = (Unit(1e-3, 'ms'), Unit(1e-6, 'µs'), Unit(1e-9, 'ns'))
# Logarithm of how likely it is that a number is in SI units which cannot be.
_HARDLY = -20.0


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
        if not self._only_whole(self.recording.position):
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
        usual = self._efforts()
        weigher = Weigher(_motion(recording), self.model, usual)
        fits = [fit for reading in self._readings(recording)
                for fit in weigher.weigh(reading, other_effort=True)]
        stands = [fit.log_odds for fit in fits if _plain(fit)]
        if not fits:
            return ''
        found = max(fits, key=lambda fit: fit.log_odds)
        if stands and found.log_odds < stands[0] + math.log(LOSS):
            return ''
        units = self._units_of(found, fits)
        if not units:
            return ''
        told = ' and '.join(f'{name} looks like {unit.name}, not {self._si(name)}'
                            for name, unit in units.items())
        remedy = ' '.join(f'--scale {name}={unit.factor:.7g}' for name, unit in units.items())
        # Of one machine's readings the data may leave two alike: both are said.
        others = [self._units_of(fit, fits) for fit in fits if not _plain(fit)
                  and found.log_odds > fit.log_odds > found.log_odds - math.log(LOSS)]
        others = [other for other in others
                  if {name: _quantity(unit) for name, unit in other.items()}
                  != {name: _quantity(unit) for name, unit in units.items()}]
        also = f' (or {_listed(others[0])})' if others else ''
        return (f'{told}{also}: scaled so, {_why(found, fits)}; record in SI units, '
                f'or import the table with {remedy}')

    def _units_of(self, fit: Fit, fits: list[Fit]) -> dict[str, Unit]:
        """Return what is in another unit, by what it is."""
        units = {'position': self._position_unit(fit, fits),
                 'effort': self._effort_unit(fit.factor, self._efforts()),
                 'time': fit.reading.time}
        return {name: unit for name, unit in units.items() if unit.name}

    def _efforts(self) -> list[Unit]:
        constant = self.model.motor.torque_constant
        units = [Unit(1e-3, 'mN'), Unit(1e3, 'kN')] if self._linear else [
            Unit(1e-3, 'mN·m'), Unit(1e-2, 'N·cm'), Unit(1e3, 'kN·m')]
        return [*units, Unit(constant, 'amperes'), Unit(1e-3 * constant, 'milliamperes')]

    def _effort_unit(self, factor: float, usual: list[Unit]) -> Unit:
        """Return what effort is, told by the factor that makes it the torque of the motion."""
        if factor == 1.0:
            return SI
        sign, opposite = (1.0, '') if factor > 0.0 else (-1.0, ' of the opposite sign')
        size = abs(factor)
        known = [*usual, Unit(1.0, '')] if opposite else usual
        near = min(known, key=lambda unit: abs(math.log(size / unit.factor)))
        if abs(math.log(size / near.factor)) < 3.0 * USUAL_SPREAD:
            if near.name == '':
                return Unit(-1.0, 'a torque of the opposite sign (or position is counted '
                            'backwards)')
            return Unit(sign * near.factor, near.name + opposite)
        shown = float(f'{size:.2g}')
        constant = self.model.motor.torque_constant
        per = 'N/A' if self._linear else 'N·m/A'
        return Unit(sign * shown, (
            f'a current of a motor with {shown:g} {per} (the file says {constant:g})'
            if size < 1.0 else f'another quantity ({1.0 / size:.2g} of what the motion needs)')
            + opposite)

    def _position_unit(self, found: Fit, fits: list[Fit]) -> Unit:
        """Return what position is; encoders' counts with the others that may be as well."""
        position = found.reading.position
        counts = _counts_of(position)
        if counts is None:
            return position
        alike = {other for other in COUNTS if 1.0 / NEAR < other / counts < NEAR}
        for fit in fits:
            other = _counts_of(fit.reading.position)
            if other is not None and fit.log_odds > found.log_odds - math.log(LOSS):
                alike.add(other)
        others = sorted(alike - {counts})
        return dataclasses.replace(position, name=f'counts of {counts} in a turn' + (
            f' (or of {", ".join(map(str, others))})' if others else ''))

    @property
    def _linear(self) -> bool:
        return self.model.joint.type == 'prismatic'

    def _si(self, name: str) -> str:
        units = {'position': 'm', 'effort': 'N'} if self._linear else {
            'position': 'rad', 'effort': 'N·m'}
        return {'time': 's', **units}[name]

    def _short(self) -> Recording:
        """Return the recording, or its middle where it is long."""
        recording = self.recording
        if recording.time.size <= LONGEST:
            return recording
        begin = (recording.time.size - LONGEST) // 2
        return recording.between(recording.time[begin], recording.time[begin + LONGEST])

    def _readings(self, recording: Recording) -> Iterator[Reading]:
        """Yield what position and time may be."""
        rare = math.log(PRIORS['position'])
        whole = self._only_whole(recording.position)
        positions = [dataclasses.replace(SI, log_prior=_HARDLY if whole else 0.0)]
        if self._linear:
            positions.append(Unit(1e-3, 'mm', rare))
        else:
            positions += [Unit(math.pi / 180.0, 'degrees', rare),
                          Unit(2.0 * math.pi, 'turns', rare)]
            if whole:
                positions += [Unit(2.0 * math.pi / counts, f'counts of {counts}',
                                   rare - math.log(len(COUNTS))) for counts in COUNTS]
        rare = math.log(PRIORS['time'])
        slow = recording.interval > SLOWEST
        times = [dataclasses.replace(SI, log_prior=_HARDLY if slow else 0.0)]
        times += [dataclasses.replace(clock, log_prior=rare) for clock in CLOCKS
                  if INTERVALS[0] <= recording.interval * clock.factor <= INTERVALS[1]]
        yield from (Reading(position, time) for position in positions for time in times)

    @staticmethod
    def _only_whole(position: Array) -> bool:
        return bool(np.unique(position).size >= WHOLE and (position == np.rint(position)).all())


def _plain(fit: Fit) -> bool:
    return fit.factor == 1.0 and not fit.reading.position.name and not fit.reading.time.name


def _counts_of(position: Unit) -> int | None:
    return round(2.0 * math.pi / position.factor) if position.name.startswith('counts') else None


def _quantity(unit: Unit) -> str:
    return unit.name.partition(' ')[0]


def _listed(units: dict[str, Unit]) -> str:
    return ' and '.join(f'{name} like {unit.name}' for name, unit in units.items())


def _why(found: Fit, fits: list[Fit]) -> str:
    """Say what speaks for a reading."""
    if found.left < MOST:
        return (f'the model explains {1.0 - found.left ** 2:.0%} of it with no number changed')
    stands = next((fit for fit in fits if _plain(fit)), None)
    if stands is None or not stands.off:
        return 'the model explains more of it'
    name, off = max(stands.off.items(), key=lambda item: abs(math.log(item[1])))
    return (f'the model explains more of it (as it stands, {name} of the file would be wrong by '
            f'a factor of {max(off, 1.0 / off):.2g})')


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


def _motion(recording: Recording) -> Motion:
    # A grid begins at 0, the middle of a long recording doesn't.
    return motion_of(dataclasses.replace(
        recording, time=recording.time - recording.time[0], velocity=None, reference=None,
        signals={}))
