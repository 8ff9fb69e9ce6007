# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How the clocks of two recordings under the same commands go together: offset and drift.

A simulator's time begins where it likes, and a recorder's clock is off by some hundred parts in a
million. Both followed the same commands, so that

    real time = offset + (1 + drift) · simulated time

is where what was commanded (or, where that was not recorded, the motion) agrees best: begun at the
highest peak of the cross-correlation of speeds, then by least squares on the position. How sure
both are is the delete-a-block jackknife, as for a first model (first_model.py).

Some peak is highest between any two motions. Where the commands were other ones, each block of
time wants a rate of its own: a rate whose interval at 95 % is wider than any clock is off is none.
Commands are numbers that a program computed, and two logs of one differ by no more than it changes
from one entry to the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate, correlation_lags

from engb_core.recording import Recording

__all__ = ['ClockMatch', 'clock_match']

Array = NDArray[np.float64]

# [s] Finer does no clock matter here; least squares go between the steps.
_STEP = 2e-3
_ROUNDS, _BLOCKS = 12, 10
# Of the recorded motion's energy: both followed one command if more is common than is not.
_COMMON = 0.5
# No clock drifts more: crystals 100 ppm, a controller's RC oscillator one part in a hundred.
_LARGEST_DRIFT = 0.01
# Standard deviations of an interval at 95 %.
_SURE = 2.0
# [s] Finer no stamp of a recorder is to be trusted.
_STAMP = 1e-6
# [s] A shorter stretch holds no stroke.
_LEAST_OVERLAP = 1.0


@dataclass(frozen=True)
class ClockMatch:
    """The clock of a simulated recording against that of a real one.

    Attributes:
        offset, offset_std: real time at simulated time 0, both from the first sample [s].
        drift, drift_std: by which part real time runs faster [-].
        common: part of the motion's energy that agrees [-], −∞ to 1.
        of_commands: the commands were compared, not the motion.
        position, effort: root mean square by which the recordings differ once the clocks agree
            [rad], [N·m].
    """

    offset: float
    offset_std: float
    drift: float
    drift_std: float
    common: float
    of_commands: bool
    position: float
    effort: float

    def statement(self, real: str, simulated: str, unit: str = 'rad', torque: str = 'N·m') -> str:
        """Return it in a sentence.

        Args:
            real, simulated: names of the recordings.
            unit, torque: units of position and effort.
        """
        what = 'commands' if self.of_commands else 'motion'
        late = '' if self.of_commands else ' (in it is how much later one follows its commands)'
        return (f'{simulated} and {real} have the same {what} ({100.0 * self.common:.1f} % of its '
                f'energy): {simulated} begins {self.offset:+.4f} ± {self.offset_std:.1g} s{late} '
                f'on the clock of {real}, which runs {1e6 * self.drift:+.0f} ± '
                f'{1e6 * self.drift_std:.0f} ppm faster. Seen together they differ '
                f'by {self.position:.3g} {unit} and {self.effort:.3g} {torque} rms.')


def clock_match(real: Recording, simulated: Recording) -> ClockMatch | None:
    """Return how two recordings' clocks go together; None where they had other commands.

    Args:
        real, simulated: recordings under the same commands; their references are compared where
            both have one, else their motions.
    """
    commanded = real.reference is not None and simulated.reference is not None
    one, other = (_signal(run, commanded) for run in (real, simulated))
    start = _coarse(one, other)
    if start is None:
        return None
    found = _fitted(one, other, start)
    common, overlap = _common(one, other, found)
    if common < _COMMON or overlap < _LEAST_OVERLAP or abs(found[1]) > _LARGEST_DRIFT:
        return None
    estimates = np.array([_fitted(one, other, found, left_out=block) for block in range(_BLOCKS)])
    spread = np.sqrt((_BLOCKS - 1) / _BLOCKS * np.sum(
        (estimates - estimates.mean(axis=0)) ** 2, axis=0))
    if _SURE * spread[1] > _LARGEST_DRIFT:
        return None
    if commanded and not _within_an_entry(one, other, found):
        return None
    least = np.array([_STAMP, _STAMP / overlap, 0.0])
    spread = np.maximum(spread, least)
    return ClockMatch(float(found[0]), float(spread[0]), float(found[1]), float(spread[1]),
                      common, commanded, *_apart(real, simulated, found))


def _signal(run: Recording, commanded: bool) -> tuple[Array, Array]:
    if commanded:
        assert run.reference is not None
        return run.reference.time, run.reference.position
    return run.time, run.position


def _grid(signal: tuple[Array, Array]) -> tuple[float, Array]:
    """Return the first instant and the positions on an even grid."""
    time, values = signal
    grid = np.arange(time[0], time[-1], _STEP)
    return float(time[0]), np.interp(grid, time, values)


def _coarse(real: tuple[Array, Array], simulated: tuple[Array, Array]) -> Array | None:
    """Return (offset, drift, shift of the angle) at the highest peak of the correlation."""
    (first, one), (second, other) = _grid(real), _grid(simulated)
    speeds = [np.diff(values) for values in (one, other)]
    if min(entry.size for entry in speeds) < 2 or not all(np.any(entry) for entry in speeds):
        return None
    lags = correlation_lags(speeds[0].size, speeds[1].size) * _STEP
    lag = lags[int(np.argmax(correlate(speeds[0], speeds[1], method='fft')))]
    return np.array([first - second + lag, 0.0, 0.0])


def _fitted(real: tuple[Array, Array], simulated: tuple[Array, Array], start: Array,
            left_out: int | None = None) -> Array:
    """Return (offset, drift, shift) by Gauss and Newton on the positions."""
    time, values = real
    grid = np.arange(time[0], time[-1], _STEP)
    target = np.interp(grid, time, values)
    keep = np.ones(grid.size, dtype=bool)
    if left_out is not None:
        keep = np.arange(grid.size) * _BLOCKS // grid.size != left_out
    speed = np.gradient(simulated[1], simulated[0])
    found = start.copy()
    for _ in range(_ROUNDS):
        instant = (grid - found[0]) / (1.0 + found[1])
        inside = keep & (instant >= simulated[0][0]) & (instant <= simulated[0][-1])
        if np.count_nonzero(inside) < 4:
            break
        at = instant[inside]
        rate = np.interp(at, simulated[0], speed) / (1.0 + found[1])
        left = target[inside] - np.interp(at, *simulated) - found[2]
        columns = np.column_stack([-rate, -rate * at, np.ones(at.size)])
        step = np.linalg.lstsq(columns, left, rcond=None)[0]
        found = found + step
        if abs(step[0]) < 1e-9 and abs(step[1]) < 1e-10:
            break
    return found


def _common(real: tuple[Array, Array], simulated: tuple[Array, Array],
            found: Array) -> tuple[float, float]:
    """Return the part of the speed's energy that agrees, and for how long both are there [s]."""
    grid, inside = _overlap(real[0], simulated[0], found)
    if np.count_nonzero(inside) < 4:
        return -np.inf, 0.0
    at = grid[inside]
    one = np.gradient(np.interp(at, *real), _STEP)
    other = np.gradient(np.interp((at - found[0]) / (1.0 + found[1]), *simulated), _STEP)
    energy = float(np.sum(one ** 2))
    if energy == 0.0:
        return -np.inf, 0.0
    return 1.0 - float(np.sum((one - other) ** 2)) / energy, at.size * _STEP


def _overlap(real: Array, simulated: Array, found: Array) -> tuple[Array, NDArray[np.bool_]]:
    grid = np.arange(real[0], real[-1], _STEP)
    instant = (grid - found[0]) / (1.0 + found[1])
    return grid, (instant >= simulated[0]) & (instant <= simulated[-1])


def _within_an_entry(real: tuple[Array, Array], simulated: tuple[Array, Array],
                     found: Array) -> bool:
    """Whether two commands differ by no more than they change from entry to entry of the log that
    has fewer, root mean square."""
    grid, inside = _overlap(real[0], simulated[0], found)
    at = grid[inside]
    one = np.interp(at, *real)
    left = one - np.interp((at - found[0]) / (1.0 + found[1]), *simulated) - found[2]
    entry = max(_entry(*real), _entry(*simulated))
    moved = entry * float(np.sqrt(np.mean(np.gradient(one, _STEP) ** 2)))
    return float(np.sqrt(np.mean(left ** 2))) <= moved


def _entry(time: Array, values: Array) -> float:
    """Return the usual time [s] from one change of a command to the next: it may be logged more
    often than it is given."""
    changed = np.flatnonzero(np.diff(values))
    return float(np.median(np.diff(time[changed]))) if changed.size > 1 else 0.0


def _apart(real: Recording, simulated: Recording, found: Array) -> tuple[float, float]:
    """Return by how much position and effort differ on one clock, root mean square."""
    grid, inside = _overlap(real.time, simulated.time, found)
    at = grid[inside]
    if not at.size:
        return float('nan'), float('nan')
    instant = (at - found[0]) / (1.0 + found[1])

    def apart(one: Array, other: Array) -> float:
        return float(np.sqrt(np.mean((np.interp(at, real.time, one)
                                      - np.interp(instant, simulated.time, other)) ** 2)))
    return (apart(real.position, simulated.position), apart(real.effort, simulated.effort))
