# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Effort that is a command: the law behind it, and what the drive makes of its set-point.

Servos log no torque. What stands as effort is then what the position loop asked for,

    effort = clip(gain · (reference − position) + offset, lowest, highest),

which carries no noise but what position counts make of it. The drive may act on its set-point
late, or move it no faster than it likes: it then acts on another effort than was recorded. By how
much follows from the recorded reference and position alone.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

from engb_core.effects.base import POSITION, REFERENCE
from engb_core.physics.plant import Physics
from engb_core.physics.sample_table import sample_table
from engb_core.recording import Recording

__all__ = ['Commanded', 'CommandLaw', 'command_law', 'commanded_of']

Array = NDArray[np.float64]

# How much of the effort's variance a command computed from the reference may leave: rounding of
# what was logged; a measured current carries noise that no reference knows of.
COMPUTED_LEAVES = 1e-3
# Part of the largest effort from which on it may be the drive's limit.
NEAR_LIMIT = 0.98
LEAST_SAMPLES = 50
# Samples at which the law asks for more than was given that make it a limit; one or two may be
# stamps that are a little off.
LIMITED = 3


@dataclass(frozen=True)
class CommandLaw:
    """A proportional law: `gain` [N·m/rad], `offset`, `lowest` and `highest` effort [N·m]."""

    gain: float
    offset: float
    lowest: float
    highest: float

    def __call__(self, reference: Array, position: Array) -> Array:
        """Return the effort (n,) [N·m] that the law asks for."""
        return np.clip(self.gain * (reference - position) + self.offset, self.lowest,
                       self.highest)


@dataclass(frozen=True)
class Commanded:
    """What the effort of a recording was computed from, on an even grid.

    Attributes:
        law: that it follows.
        table: (k, SAMPLE_SIZE) with the recorded set-point and position.
        taps: smoothing that the motion's effort has passed.
        time: (k,) [s].
    """

    law: CommandLaw
    table: Array
    taps: Array
    time: Array

    def recorded_beyond_acted(self, physics: Physics) -> Array:
        """Return by how much the recorded effort exceeds the one on which the drive acts, (k,)
        [N·m] at `time`, not smoothed."""
        table, state = self.table.copy(), physics.fresh_state()
        reference = self.table[:, REFERENCE]
        for function, effect in physics.stages['command']:
            function.loop(physics.parameters[effect], state[effect], table, REFERENCE)
        position = self.table[:, POSITION]
        beyond: Array = self.law(reference, position) - self.law(table[:, REFERENCE], position)
        return beyond

    def smoothed(self, physics: Physics, time: Array) -> Array:
        """Return the same at other times (n,), as the motion's effort is smoothed."""
        smooth: Array = convolve1d(self.recorded_beyond_acted(physics), self.taps, mode='nearest')
        return np.interp(time, self.time, smooth)


def command_law(recording: Recording) -> CommandLaw | None:
    """Return the law that the recorded effort follows, None where it is no command."""
    reference, effort = recording.reference, recording.effort
    if reference is None:
        return None
    error = np.interp(recording.time, reference.time, reference.position) - recording.position
    inside = np.abs(effort) < NEAR_LIMIT * np.max(np.abs(effort))
    if inside.sum() < LEAST_SAMPLES or float(np.ptp(error[inside])) == 0.0:
        return None
    design = np.stack([error, np.ones_like(error)], axis=1)
    solution, *_ = np.linalg.lstsq(design[inside], effort[inside], rcond=None)
    left = effort - design @ solution
    if float(np.var(left[inside])) > COMPUTED_LEAVES * float(np.var(effort[inside])):
        return None
    # The law asks for more than it was given: the drive's limit.
    off = max(5.0 * float(np.std(left[inside])), 1e-6 * float(np.max(np.abs(effort))))
    near = ~inside
    above = int(np.sum(near & (effort > 0.0) & (left < -off))) >= LIMITED
    below = int(np.sum(near & (effort < 0.0) & (left > off))) >= LIMITED
    return CommandLaw(float(solution[0]), float(solution[1]),
                      float(effort.min()) if below else -math.inf,
                      float(effort.max()) if above else math.inf)


def commanded_of(recording: Recording, time: Array, taps: Array) -> Commanded | None:
    """Return what the effort was computed from at `time` (k,), None where it is no command; `taps`
    are those that its smoothing has on this grid."""
    law, reference = command_law(recording), recording.reference
    if law is None or reference is None:
        return None
    table = sample_table(float(time[1] - time[0]), time,
                         np.interp(time, recording.time, recording.position), 0.0, 0.0)
    table[:, REFERENCE] = np.interp(time, reference.time, reference.position)
    return Commanded(law, table, taps, time)
