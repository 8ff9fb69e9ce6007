# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A set of a small servo that others recorded: a Dynamixel XL330 that swings a mass on an arm.

Its recorders measured position and the duty cycle that the drive gave, about 190 times a second:
the effort is that duty cycle times the bus voltage times a torque per volt, which regression
against the exactly known weight and inertia tells. (The bus voltage that the servo reads swings by
15 %, as it is sampled within the pulses; its mean is taken.) The recordings are in the history of
a public repository (github.com/Rhoban/bam, commit af22604, Apache-2.0). In a clone of it, checked
out at that commit:

    python -m tests.proof.public_xl330 CLONE OUT
    engb prove --real OUT --out out/xl330

The first writes OUT/xl330, the second takes terms out of the best model found of it.
"""
from __future__ import annotations

import argparse
from collections.abc import Sequence
import json
from pathlib import Path

import numpy as np

from .public_servos import Pendulum, regression, Run, Servo, write_set

__all__ = ['main', 'PointMass', 'runs_in', 'torque_per_volt']

# Counts of the whole duty cycle, and from which on they are negative.
_FULL, _SIGN = 885.0, 32768
_ARMATURE = 0.0018      # kg·m², of the recorders' simplest model
_FOLDER = Path('bam') / 'data.bak' / 'raw'
_HELD_OUT = 200         # the P gain of what is held out


class PointMass(Pendulum):
    """A point mass [kg] at a distance [m] from the servo's axis: its arm is part of it."""

    @property
    def _arm(self) -> float:
        return 0.0


def runs_in(folder: Path) -> list[Run]:
    """All recordings in which the drive is on, in order of their names."""
    runs = [_run(path) for path in sorted(folder.glob('*.json'))]
    return [run for run in runs if run.trajectory != 'lift_and_drop']


def _run(path: Path) -> Run:
    content = json.loads(path.read_text('utf8'))
    time, position, goal, duty, volts = (
        np.array([float(entry[name]) for entry in content['entries']])
        for name in ('timestamp', 'position', 'goal_position', 'load', 'input_volts'))
    duty = np.where(duty < _SIGN, duty, duty - 2.0 * _SIGN) / _FULL
    return Run(path.stem, PointMass(content['mass'], content['length']), int(content['kp']),
               content['trajectory'], time, position, goal, float(volts.mean()) * duty)


def torque_per_volt(runs: Sequence[Run]) -> tuple[float, float]:
    """Return torque per volt [N·m/V] and friction per load [-] by regression on all motion."""
    found = regression(runs, _ARMATURE)
    return found.torque_per_volt, found.load_gain


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the set."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n', 1)[0])
    parser.add_argument('clone', type=Path, help='of Rhoban/bam, at af22604')
    parser.add_argument('out', type=Path, help='where the set goes')
    given = parser.parse_args(arguments)
    runs = runs_in(given.clone / _FOLDER)
    if not runs:
        parser.error(f'{given.clone / _FOLDER}: no recordings; check out commit af22604')
    per_volt, per_load = torque_per_volt(runs)
    print(f'regression: {per_volt:.4f} N·m/V, friction per load {per_load:.3f}')
    write_set(given.out / 'xl330', [
        (f"{'holdout' if run.gain == _HELD_OUT else 'train'}_kp{run.gain}_{run.trajectory}", run)
        for run in runs], Servo('xl330', str(_FOLDER), 0.0, _ARMATURE), per_volt)


if __name__ == '__main__':
    main()
