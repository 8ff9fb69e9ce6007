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
from dataclasses import dataclass
import json
from pathlib import Path

import numpy as np
import yaml

from engb_core.io.bags.write import JointTable, write_bag

from .public_servos import nominal_model, Run, Servo

__all__ = ['main', 'PointMass', 'runs_in', 'torque_per_volt']

_GRAVITY = 9.81         # m/s²
# Counts of the whole duty cycle, and from which on they are negative.
_FULL, _SIGN = 885.0, 32768
_ARMATURE = 0.0018      # kg·m², of the recorders' simplest model
_FOLDER = Path('bam') / 'data.bak' / 'raw'
_HELD_OUT = 200         # the P gain of what is held out
_MOVES = 0.05           # rad/s


@dataclass(frozen=True)
class PointMass:
    """A point mass [kg] at a distance [m] from the servo's axis."""

    mass: float
    length: float

    @property
    def load(self) -> float:
        """The largest torque of its weight [N·m]."""
        return _GRAVITY * self.length * self.mass

    @property
    def inertia(self) -> float:
        """[kg·m²] about the servo's axis."""
        return self.length ** 2 * self.mass


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
    """Return torque per volt [N·m/V] and friction per load [-] by regression on all motion: what
    weight and inertia need is known, and friction has another sign up than down."""
    rows, volts = [], []
    for run in runs:
        position, velocity, acceleration, asked = run.motion()
        moves = np.abs(velocity) > _MOVES
        load, sense = run.pendulum.load * np.sin(position), np.tanh(velocity / _MOVES)
        needed = load + (run.pendulum.inertia + _ARMATURE) * acceleration
        rows.append(np.stack([needed, sense, np.abs(load) * sense, velocity], axis=1)[moves])
        volts.append(asked[moves])
    terms = np.linalg.lstsq(np.concatenate(rows), np.concatenate(volts), rcond=None)[0]
    return float(1.0 / terms[0]), float(terms[2] / terms[0])


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
    home = given.out / 'xl330'
    home.mkdir(parents=True, exist_ok=True)
    fitted = [run for run in runs if run.gain != _HELD_OUT]
    for run in runs:
        part = 'train' if run in fitted else 'holdout'
        bag = home / f'{part}_kp{run.gain}_{run.trajectory}'
        if not bag.exists():    # of a start that was broken off; each bag is whole or not there
            write_bag(bag, {
                '/servo/joint_states': JointTable(run.time, run.position, None,
                                                  per_volt * run.volts, 'servo'),
                '/servo/reference': JointTable(run.time, run.goal, None, None, 'servo')})
    model = nominal_model(fitted, Servo('xl330', str(_FOLDER), 0.0, _ARMATURE), per_volt)
    # Written last: it makes the folder a set.
    (home / 'nominal.yaml').write_text(yaml.safe_dump(model, sort_keys=False), 'utf8')


if __name__ == '__main__':
    main()
