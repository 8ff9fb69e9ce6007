"""Whether a recording can be what it says: units, a signal that is missing, an angle that wraps.

A recording in degrees or amperes gets a name for physics that isn't there: scaled wrongly, every
effect looks like some other one. Each factor of a usual slip is known exactly. It is told where

- the model as it stands explains next to nothing of the effort (its residual is as large as the
  effort itself), and
- with the recording scaled by exactly that factor, and no number refitted, it explains most, and
- a free refit of inertia, friction and load to the unscaled recording explains hardly more:
  the scaled model leaves no room for a cause within the machine.

A wrong load stiffness or torque constant fails the first two: such a model is off by a part, and
no factor of 57 or 1000 makes it better.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import dataclasses
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.inverse_dynamics import effort_of_motion
from engb_core.model import Model
from engb_core.motion import Motion, motion_of
from engb_core.plant import load_torques, nominal_vector, physics_of
from engb_core.recording import Recording

__all__ = ['Plausibility', 'refuse_implausible']

Array = NDArray[np.float64]

# Residual over effort, rms: as it stands at least so much, with the right units at most so much.
# 0.9: less than a fifth of the variance is explained; 0.5: three quarters are.
NOTHING, MOST = 0.9, 0.5
# How much more a free refit may leave unexplained at least, as a part of the scaled model's rms.
NEAR_FREE = 0.3
# An encoder's counts in a turn: powers of two, and four times the usual lines of optical ones.
COUNTS = tuple(2 ** power for power in range(8, 25)) + tuple(
    4 * lines for lines in (100, 200, 250, 360, 400, 500, 1000, 1250, 2000, 2500, 3600, 5000))
# Samples looked at: a diagnosis takes seconds, this must not.
LONGEST = 10_000
# A jump of the angle of at least this part of its range, against the motion, is a wrap.
OF_RANGE = 0.9


@dataclass(frozen=True)
class _Unit:
    """A usual slip: what one multiplies with to get SI units, and what the numbers then are."""

    factor: float
    name: str


_SI = _Unit(1.0, '')


@dataclass(frozen=True)
class Plausibility:
    """What one recording looks like beside a model."""

    recording: Recording
    model: Model

    def fault(self) -> str:
        """Return in one line what is wrong with the recording, and the remedy ('' for nothing)."""
        return self._missing() or self._wrapped() or self._units()

    def _missing(self) -> str:
        effort, position = self.recording.effort, self.recording.position
        if np.ptp(effort) == 0.0:
            unit = self._si('effort')
            return (f'effort is {effort[0]:g} {unit} in all {effort.size} samples: nothing was '
                    'measured; record torque constant times measured current as effort')
        if np.ptp(position) == 0.0:
            return ('position never changes: nothing moves, or another column was meant; record '
                    'a motion')
        return ''

    def _wrapped(self) -> str:
        position = self.recording.position
        step = np.diff(position)
        span = float(np.ptp(position))
        jump = np.flatnonzero(np.abs(step) > OF_RANGE * span)
        jump = jump[(jump > 0) & (jump < step.size - 1)]
        # The motion goes on behind it as before it: the angle began again.
        against = jump[(np.sign(step[jump - 1]) == -np.sign(step[jump]))
                       & (np.sign(step[jump + 1]) == -np.sign(step[jump]))]
        if against.size < 2:
            return ''
        return (f'position jumps by {np.median(np.abs(step[against])):.4g} '
                f'{self._si("position")} and begins again, {against.size} times: an angle within '
                'one turn; add the turns (numpy.unwrap) before recording or importing it')

    def _units(self) -> str:
        recording = self._short()
        stands = self._left(recording, _SI, _SI, _SI)
        if not stands > NOTHING:
            return ''
        found = [(self._left(recording, *units), units) for units in self._slips(recording)]
        left, units = min(found, key=lambda entry: entry[0], default=(math.inf, ()))
        if not left < MOST or self._free(recording) < NEAR_FREE * left:
            return ''
        told, remedy = [], []
        for name, unit in zip(('position', 'effort', 'time'), units, strict=True):
            if unit is not _SI:
                told.append(f'{name} looks like {unit.name}, not {self._si(name)}')
                remedy.append(f'--scale {name}={unit.factor:.7g}')
        return (f'{" and ".join(told)}: as it stands the model explains nothing of it, scaled '
                f'it explains {1.0 - left ** 2:.0%}; record in SI units, or import the table with '
                f'{" ".join(remedy)}')

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

    def _slips(self, recording: Recording) -> Iterator[tuple[_Unit, _Unit, _Unit]]:
        """Yield what position, effort and time may be."""
        linear = self.model.joint.type == 'prismatic'
        positions = [_SI, *([_Unit(1e-3, 'mm')] if linear else [
            _Unit(math.pi / 180.0, 'degrees'), _Unit(2.0 * math.pi, 'turns')])]
        if not linear and (recording.position == np.rint(recording.position)).all():
            positions += [_Unit(2.0 * math.pi / counts, f'counts of {counts} in a turn')
                          for counts in COUNTS]
        efforts = [_SI, _Unit(1e-3, 'mN' if linear else 'mN·m'),
                   _Unit(self.model.motor.torque_constant, 'amperes')]
        times = [_SI, _Unit(1e-3, 'ms')]
        for position in positions:
            for effort in efforts:
                for time in times[:1] if position.name.startswith('counts') else times:
                    units = position, effort, time
                    if any(unit is not _SI for unit in units):
                        yield units

    def _left(self, recording: Recording, position: _Unit, effort: _Unit, time: _Unit) -> float:
        """Return what the file's model leaves of the effort, rms over rms, with these units."""
        motion = _motion(recording, position.factor, effort.factor, time.factor)
        with np.errstate(all='ignore'):
            wanted = effort_of_motion(motion.samples(), motion.step, physics_of(self.model))
            return _part((motion.effort - wanted)[motion.known], motion.effort[motion.known])

    def _free(self, recording: Recording) -> float:
        """Return what a free refit of inertia, friction, load and offset leaves, rms over rms."""
        motion = _motion(recording, 1.0, 1.0, 1.0)
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


def refuse_implausible(recordings: Sequence[Recording], model: Model) -> None:
    """Raise InputError where a recording cannot be what it says; names it and the remedy."""
    for recording in recordings:
        fault = Plausibility(recording, model).fault()
        if fault:
            raise InputError(f'{recording.name}: {fault}')


def _motion(recording: Recording, position: float, effort: float, time: float) -> Motion:
    return motion_of(dataclasses.replace(
        recording, time=recording.time * time, position=recording.position * position,
        effort=recording.effort * effort, velocity=None, reference=None, signals={}))


def _part(rest: Array, whole: Array) -> float:
    """Return rms over rms; infinite where there is nothing to compare with."""
    size = float(np.linalg.norm(whole))
    left = float(np.linalg.norm(rest))
    return left / size if size > 0.0 and math.isfinite(left) else math.inf
