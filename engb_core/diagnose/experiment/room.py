# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a reference may use: the range, speeds and accelerations that a recording has seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.problem import Problem, Run
from engb_core.errors import InputError
from engb_core.model import Model
from engb_core.physics.nominal_torque import nominal_vector
from engb_core.physics.plant import load_torques
from engb_core.signals.gaussian import filtered, gaussian_kernel

__all__ = ['Room', 'room_of']

Array = NDArray[np.float64]

# Parts of the recorded extremes that are used: a loop overshoots, a quantile is no limit.
OF_RANGE = 0.97
OF_SPEED = 0.95
# A load below this part of the largest counts as none.
UNLOADED = 0.06


@dataclass(frozen=True)
class Room:
    """What a reference may use, from what was recorded.

    Attributes:
        low, high: [rad].
        speed, acceleration: highest [rad/s, rad/s²].
        slowest: below this the shaft counts as standing [rad/s].
        finest: smallest stroke that the encoder resolves [rad].
        home: where the reference begins and ends [rad].
        angle: positions on the way from least to largest load, (k,) [rad].
        load: |T_L| there, as part of the largest, (k,); all 0 where the joint carries none.
        unit: of positions.
    """

    low: float
    high: float
    speed: float
    acceleration: float
    slowest: float
    finest: float
    home: float
    angle: Array
    load: Array
    unit: str

    @property
    def width(self) -> float:
        """[rad]."""
        return self.high - self.low

    @property
    def loaded(self) -> bool:
        """Whether there is any load within the range."""
        return bool(self.load.max() > 0.0)

    def at(self, part: float) -> float:
        """Return the first position that carries `part` of the largest load [rad]."""
        return float(self.angle[int(np.argmax(self.load >= part * self.load.max()))])

    def pace(self, part: float) -> float:
        """Return this part of the highest speed, but not a speed that can't be judged [rad/s]."""
        return min(self.speed, max(part * self.speed, 1.5 * self.slowest))

    @property
    def free(self) -> tuple[float, float] | None:
        """The stretch that carries no load [rad, rad], None where it is too short to use."""
        if not self.loaded:
            return self.low, self.high
        end = self.at(UNLOADED)
        if abs(end - self.angle[0]) < max(0.04 * self.width, 10.0 * self.finest):
            return None
        return float(self.angle[0]), end


def room_of(problem: Problem, model: Model, slowest: float) -> Room:
    """Return what these recordings allow; the load is that of `model`.

    Raises:
        InputError: there is no motion in them.
    """
    motions = [run.motion for run in (*problem.runs, *problem.held_out)]
    low, high = problem.scene.position_range
    margin = 0.5 * (1.0 - OF_RANGE) * (high - low)
    low, high = low + margin, high - margin
    acceleration = max(_acceleration(run) for run in (*problem.runs, *problem.held_out))
    nominal = nominal_vector(model)
    grid = np.linspace(low, high, 400)
    load = np.abs(load_torques(nominal, grid))
    largest = float(load.max())
    if largest < 1e-3 * problem.scene.largest_effort:
        load, largest = np.zeros_like(load), 1.0
    least, most = int(np.argmin(load)), int(np.argmax(load))
    if not load.any():
        most = grid.size - 1
    way = np.arange(least, most + 1) if most > least else np.arange(least, most - 1, -1)
    if not (acceleration > 0.0 and problem.scene.speed > 0.0 and high > low):
        raise InputError('no motion that a reference could keep within')
    finest = 12.0 * max(motion.quantum for motion in motions) + 1e-4 * (high - low)
    return Room(low, high, OF_SPEED * problem.scene.speed, acceleration, slowest, finest,
                float(motions[0].position[0]), grid[way], load[way] / largest,
                'rad' if problem.model.joint.type == 'revolute' else 'm')


def _acceleration(run: Run) -> float:
    """Return the acceleration that the reference asked for, or that was usual [rad/s²]."""
    motion, reference = run.motion, run.recording.reference
    values = motion.acceleration
    if reference is not None and np.ptp(reference.position) > 0.5 * np.ptp(motion.position):
        wanted = np.interp(motion.time, reference.time, reference.position)
        values = filtered(wanted, gaussian_kernel(15.0, motion.step, 2))
    values = np.abs(values)
    moving = np.abs(motion.velocity) > 0.02 * np.max(np.abs(motion.velocity))
    usual = float(np.quantile(np.abs(motion.acceleration[moving]), 0.9))
    return float(np.clip(np.quantile(values[moving], 0.98), 0.2 * usual, 2.0 * usual))
