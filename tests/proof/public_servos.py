# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Sets of two hobby servos that others recorded, 16 loads in all: does each load tell the same?

The servos (Feetech STS3215 and STS3250 at 12 V) swing four masses on two arms. What the drive does
and how its gear rubs is the same whatever hangs on it, so that the diagnoses of the loads, which
know nothing of one another, must agree. The recordings are in the history of a public repository
(github.com/kscalelabs/sysid, commit d66b22c, data of 2025-03-17 and -18; no licence is stated, so
that they stay outside the project). In a clone of it, checked out at that commit:

    python -m tests.proof.public_servos CLONE OUT

writes OUT/NAME for each servo and load, as `engb prove --real OUT` reads it, and diagnoses each.
Then what was found of one load (effects and friction, with what it put the inertia off by) goes
into the files of the other loads of the same servo, and predicts what was held out there.
"""
from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
import json
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls
import yaml

from engb_core.diagnose.document import to_json
from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.evidence import quality_of_fit
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import Problem, problem_of
from engb_core.io.bags.write import JointTable, write_bag
from engb_core.library import load_model, read
from engb_core.model import Model
from engb_core.recording import Recording
from engb_core.signals.data_faults import cleaned

from .nominal import low_pass
from .real_sets import sets_in

__all__ = ['main', 'nominal_model', 'Pendulum', 'Regression', 'regression', 'Run', 'runs_in',
           'Servo', 'slow_strokes', 'Transfer', 'transferred', 'with_what_was_found', 'write_set']

_GRAVITY, _BUS = 9.81, 12.0     # m/s²; V, as the recordings say (the files' `vin` is 15)
_RATE = 100.0                   # Hz, of the resampled motion that the nominal model is fitted to
_BAND = 5.0                     # Hz: far above the slow motion, far below the counts' noise
_MOVES = 0.05                   # rad/s: eight counts of 1.5 mrad within a tenth of a second
_SLOW = 1.5                     # rad/s: the strokes, without the jump back to where they began
_TRAINED = (4, 8, 16, 32)       # P gains of the recordings that may be fitted
_REPEATED = ('up_and_down', 'sin_sin')  # of these two recordings each, as in the set of the README
_ARMS = {0.1: 0.036, 0.15: 0.050}       # kg, by length [m] (the recorders' configurations)


@dataclass(frozen=True)
class Servo:
    """What the recorders and the maker say: duty cycle per gain and error [1/rad], measured with
    a scope, and the armature [kg·m²] of their simplest model with load-dependent friction."""

    name: str
    folder: str
    duty: float
    armature: float


SERVOS = (Servo('sts3215', 'STS_3215_12V_20250317', 0.164890901, 0.0266),
          Servo('sts3250', 'STS_3250', 0.16382926, 0.0085))


@dataclass(frozen=True)
class Pendulum:
    """A point mass [kg] at the end of an arm [m] that has a mass of its own."""

    mass: float
    length: float

    @property
    def load(self) -> float:
        """The largest torque of its weight [N·m]."""
        return _GRAVITY * self.length * (self.mass + self._arm / 2.0)

    @property
    def inertia(self) -> float:
        """[kg·m²] about the servo's axis."""
        return self.length ** 2 * (self.mass + self._arm / 3.0)

    @property
    def _arm(self) -> float:
        return min(_ARMS.items(), key=lambda entry: abs(entry[0] - self.length))[1]


@dataclass(frozen=True)
class Run:
    """One recording: time [s], position and goal [rad], volts that the P controller asked for."""

    name: str
    pendulum: Pendulum
    gain: int
    trajectory: str
    time: np.ndarray
    position: np.ndarray
    goal: np.ndarray
    volts: np.ndarray

    def motion(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Position, velocity, acceleration and volts at even times, low-passed at 5 Hz."""
        time = np.arange(self.time[0], self.time[-1], 1.0 / _RATE)
        position, volts = (low_pass(np.interp(time, self.time, values), _RATE, _BAND)
                           for values in (self.position, self.volts))
        velocity = np.gradient(position, time)
        return position, velocity, np.gradient(velocity, time), volts


def runs_in(folder: Path, servo: Servo) -> list[Run]:
    """All recordings of a servo in which its drive is on, in order of their names."""
    return [run for run in (_run(path, servo) for path in sorted(folder.glob('*.json')))
            if run.trajectory != 'lift_and_drop']


def _run(path: Path, servo: Servo) -> Run:
    content = json.loads(path.read_text('utf8'))
    time, position, goal = (np.array([float(entry[name]) for entry in content['entries']])
                            for name in ('timestamp', 'position', 'goal_position'))
    duty = np.clip(content['kp'] * servo.duty * (goal - position), -1.0, 1.0)
    return Run(path.stem, Pendulum(content['mass'], content['length']), int(content['kp']),
               content['trajectory'], time, position, goal, _BUS * duty)


class Regression(NamedTuple):
    """What a regression tells: torque per volt [N·m/V], Coulomb friction [N·m], and friction per
    load [-]."""

    torque_per_volt: float
    coulomb: float
    load_gain: float


def slow_strokes(runs: Sequence[Run]) -> Regression:
    """Regression on the slow strokes, where inertia needs nothing."""
    return regression([run for run in runs if run.trajectory == 'up_and_down'], fastest=_SLOW)


def regression(runs: Sequence[Run], armature: float | None = None, fastest: float = math.inf,
               ) -> Regression:
    """Regression on what moves no faster [rad/s]: the weight is known exactly, with an armature
    [kg·m²] the inertia, too, and friction has another sign up than down."""
    rows, volts = [], []
    for run in runs:
        position, velocity, acceleration, asked = run.motion()
        moves = (np.abs(velocity) > _MOVES) & (np.abs(velocity) < fastest)
        load = run.pendulum.load * np.sin(position)
        needed = load if armature is None else load + (
            run.pendulum.inertia + armature) * acceleration
        sense = np.tanh(velocity / _MOVES)
        rows.append(np.stack([needed, sense, np.abs(load) * sense, velocity], axis=1)[moves])
        volts.append(asked[moves])
    terms = np.linalg.lstsq(np.concatenate(rows), np.concatenate(volts), rcond=None)[0]
    return Regression(*(float(term / terms[0]) for term in (1.0, *terms[1:3])))


def nominal_model(runs: Sequence[Run], servo: Servo, torque_per_volt: float) -> dict:
    """The model that an engineer would begin with: load and inertia from masses and lengths,
    friction by least squares on what may be fitted."""
    pendulum = runs[0].pendulum
    inertia = pendulum.inertia + servo.armature
    rows, gaps = [], []
    for run in runs:
        position, velocity, acceleration, volts = run.motion()
        moves = np.abs(velocity) > _MOVES
        rows.append(np.stack([np.tanh(velocity / _MOVES), velocity], axis=1)[moves])
        gaps.append((torque_per_volt * volts - pendulum.load * np.sin(position)
                     - inertia * acceleration)[moves])
    coulomb, viscous = nnls(np.concatenate(rows), np.concatenate(gaps))[0].tolist()
    return {'format': 'engb-model/1', 'joint': {'name': 'servo', 'type': 'revolute'},
            'motor': {'torque_constant': torque_per_volt, 'inertia': inertia,
                      'viscous_friction': viscous},
            'load_torque': {'form': 'sinusoid', 'amplitude': pendulum.load, 'phase': 0.0},
            'friction': {'coulomb': coulomb, 'load_gain': 0.0, 'saturation_velocity': _MOVES},
            'cogging': [], 'effects': []}


def _chosen(runs: Sequence[Run]) -> list[tuple[str, Run]]:
    """(name in the set, run): one of each gain and trajectory, of the slow ones that may be
    fitted two."""
    found: list[tuple[str, Run]] = []
    counts: dict[tuple[int, str], int] = {}
    for run in runs:
        key = (run.gain, run.trajectory)
        counts[key] = counts.get(key, 0) + 1
        trained = run.gain in _TRAINED
        if counts[key] <= (2 if trained and run.trajectory in _REPEATED else 1):
            part = 'train' if trained else 'holdout'
            found.append((f'{part}_kp{run.gain:02d}_{run.trajectory}_r{counts[key]}', run))
    return found


def write_set(home: Path, chosen: Sequence[tuple[str, Run]], servo: Servo,
              torque_per_volt: float) -> None:
    """Write a set of the chosen (name in the set, run)."""
    home.mkdir(parents=True, exist_ok=True)
    for name, run in chosen:
        if (home / name).exists():
            continue        # of a start that was broken off; each bag is whole or not there
        write_bag(home / name, {
            '/pendulum/joint_states': JointTable(run.time, run.position, None,
                                                 torque_per_volt * run.volts, 'servo'),
            '/pendulum/reference': JointTable(run.time, run.goal, None, None, 'servo')})
    model = nominal_model([run for name, run in chosen if name.startswith('train')], servo,
                          torque_per_volt)
    # Written last: it makes the folder a set.
    (home / 'nominal.yaml').write_text(yaml.safe_dump(model, sort_keys=False), 'utf8')


def _diagnosed(home: Path) -> dict:
    kept = home / 'diagnosis.json'
    if not kept.exists():
        model = load_model(home / 'nominal.yaml')
        train, holdout = _recordings(home, model)
        found = diagnose(train, model, holdout)
        found.model.save(home / 'model.yaml')
        # Written last: it says that all is there.
        kept.write_text(to_json(found), 'utf8')
    return dict(json.loads(kept.read_text('utf8')))


def _recordings(home: Path, model: Model) -> tuple[list[Recording], list[Recording]]:
    """Return what may be fitted of a set, and what is held out."""
    one, = sets_in(home)
    train, holdout = ([read(path, model) for path in paths] for paths in (one.train, one.holdout))
    return train, holdout


def _line(name: str, diagnosis: dict) -> str:
    told = ', '.join(
        f'{one["effect"]} {one["probability"]:.2f} (' + ', '.join(
            f'{key} {entry["value"]:.3g}' for key, entry in list(one['parameters'].items())[:1])
        + ')' for one in diagnosis['effects']) or 'nothing'
    return f'{name}: {told}'


def with_what_was_found(file: Model, first_file: Model, first: Model) -> Model:
    """Return a load's model file with what was found of another load of the same servo: effects,
    friction, and the inertia that the other file lacked. Its own weight stays."""
    inertia = file.motor.inertia + first.motor.inertia - first_file.motor.inertia
    motor = replace(file.motor, inertia=inertia, viscous_friction=first.motor.viscous_friction)
    return replace(file, motor=motor, friction=first.friction, effects=first.effects)


class Transfer(NamedTuple):
    """Errors on what was held out of a load, over that of its file: of the file with its numbers
    refitted, of the load's own corrected model, and the root mean square of those that were made
    of each other load of the servo."""

    name: str
    refitted: float
    own: float
    others: float


def transferred(homes: Sequence[Path]) -> list[Transfer]:
    """Return how what was found of each load of a servo predicts the others."""
    files, found = ({home: load_model(home / name) for home in homes}
                    for name in ('nominal.yaml', 'model.yaml'))
    rows = []
    for home in homes:
        # As a diagnosis does: without samples that cannot be true.
        train, holdout = ([cleaned(recording, files[home])[0] for recording in recordings]
                          for recordings in _recordings(home, files[home]))
        problem = problem_of(train, files[home], holdout)
        refit = Fitter(problem).base()
        others = [_left(problem, with_what_was_found(files[home], files[other], found[other]))
                  for other in homes if other is not home]
        rows.append(Transfer(
            home.name, _left(problem, refit.hypothesis.corrected(refit.vector)),
            _left(problem, found[home]), math.sqrt(float(np.mean(np.square(others))))))
    return rows


def _left(problem: Problem, model: Model) -> float:
    held = [entry for entry in quality_of_fit(problem, model, {}) if entry.quantity == 'effort']
    return math.sqrt(sum(entry.rms_after ** 2 for entry in held)
                     / sum(entry.rms_before ** 2 for entry in held))


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the sets that are not there yet, diagnose them, and print a line each."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n', 1)[0])
    parser.add_argument('clone', type=Path, help='of kscalelabs/sysid, at d66b22c')
    parser.add_argument('out', type=Path, help='where the sets go')
    given = parser.parse_args(arguments)
    for servo in SERVOS:
        folder = given.clone / 'data' / 'feetech' / servo.folder / 'raw'
        runs = runs_in(folder, servo)
        if not runs:
            parser.error(f'{folder}: no recordings; check out commit d66b22c')
        slow = slow_strokes(runs)
        print(f'{servo.name}, slow strokes: {slow.torque_per_volt:.3f} N·m/V, Coulomb friction '
              f'{slow.coulomb:.3f} N·m, friction per load {slow.load_gain:.3f}', flush=True)
        homes = []
        for pendulum in sorted({run.pendulum for run in runs},
                               key=lambda one: (one.length, one.mass)):
            home = given.out / (f'{servo.name}_{1e3 * pendulum.mass:.0f}g_'
                                f'{1e3 * pendulum.length:.0f}mm')
            if not (home / 'nominal.yaml').exists():
                write_set(home, _chosen([run for run in runs if run.pendulum == pendulum]), servo,
                          slow.torque_per_volt)
            homes.append(home)
            print(_line(home.name, _diagnosed(home)), flush=True)
        if len(homes) > 1:
            for one in transferred(homes):
                print(f'{one.name}: held out, over the error of its file: its numbers refitted '
                      f'{one.refitted:.2f}, own model {one.own:.2f}, made of another load '
                      f'{one.others:.2f}', flush=True)


if __name__ == '__main__':
    main()
