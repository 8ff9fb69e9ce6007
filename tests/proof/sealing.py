# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Write a case's folder, and its truth elsewhere with a digest.

Truth of one case is one `.npz`: `truth` (JSON text) and arrays on the 1 ms grid of the runs.
`test_nominal` and `test_oracle` are what the nominal model, and what the true equations, say of
the *recorded* motion of the test run; `test_effort` is the noise-free torque that it needed.
`train_added`, `test_added`: what the hidden effects add to the lacking model, at 500 Hz.
Torques and angles are in the machine's own units; `unit_of_angle` tells its standstill. Several
recordings are `train_1`, `train_2`, … in the folder as in the arrays.
The digest of a set is the SHA-256 over its sorted truth files' names and SHA-256 sums.
"""
from __future__ import annotations

from dataclasses import asdict
import hashlib
import json
from pathlib import Path

import numpy as np

from .bagfile import Bench, LAYOUTS, write_model, write_recording
from .cases import Case, Take
from .effects_load import curves
from .locate import BIN
from .machines import native
from .nominal import load_of, low_pass, moving, Nominal, rms, torque_of
from .plant_record import settings_of
from .sensors import motion_of

__all__ = ['digest_of', 'open_truth', 'write_case']


def _cutoff(case: Case) -> float:
    """The band in which the hidden effects are judged [Hz]."""
    return min(max([20.0, *(one.cutoff for one in case.hidden)]), 0.4 * case.bench.sensors.rate)


def _names(case: Case) -> list[str]:
    count = len(case.trains)
    return ['train'] if count == 1 else [f'train_{k + 1}' for k in range(count)]


def _added(case: Case, take: Take, acting: slice = slice(None)) -> np.ndarray:
    """Torque [N·m] that the hidden effects add to the lacking model, at each tick."""
    added = take.run.effort - torque_of(case.lacking, take.run)
    if case.shape_ratio:    # the load curve's own form is no hidden effect
        place = take.run.position
        added -= curves(case.plant, place) - load_of(case.base, place)
    kept = np.zeros_like(added)
    kept[acting] = added[acting]
    return kept


def _acting(case: Case, index: int) -> slice:
    """The ticks of a training recording in which the effects act."""
    if case.onset is None or index > case.onset[0]:
        return slice(None)
    return slice(case.onset[1], None) if index == case.onset[0] else slice(0)


def _energy(case: Case, added: np.ndarray, take: Take) -> np.ndarray:
    """Energy [(N·m)²·s] per BIN of what the hidden effects add to the lacking model."""
    move = moving(take.run.velocity)
    square = (low_pass(move * added, cutoff=_cutoff(case)) * move) ** 2 * 1e-3
    return _per_bin(square).sum(axis=1)


def _per_bin(values: np.ndarray) -> np.ndarray:
    per = int(round(BIN / 1e-3))
    return values[:values.size // per * per].reshape(-1, per)


def _tags(case: Case) -> list[str]:
    sensors, request = case.bench.sensors, case.request
    told = {'low_rate': sensors.rate <= 250.0, 'anti_alias': sensors.anti_alias,
            'other_machine': case.machine.kind != 'brake', case.machine.kind: True,
            'several_recordings': len(case.trains) > 1, 'load_shape': case.shape_ratio > 0.5,
            'mid_onset': case.onset is not None, 'coarse_counts': sensors.counts < 2048.0,
            'sensor_fault': bool(sensors.faults), 'jitter_and_losses': sensors.lost > 0.0,
            'clock': sensors.clock != 0.0, 'refitted': request.refitted}
    return [name for name, holds in told.items() if holds]


def _facts(case: Case, bench: Bench) -> dict[str, object]:
    def model(one: Nominal) -> dict[str, object]:
        return asdict(one)

    unit, sensors = case.machine.torque, case.bench.sensors
    effects = []
    for one, size, ratio, values in zip(case.hidden, case.magnitudes, case.ratios,
                                        case.parameters, strict=True):
        effects.append({
            'effect': one.effect, 'formulation': one.formulation, 'ratio': ratio,
            'magnitude': size,
            'parameters': {k: native(case.machine, k, v) for k, v in values.items()}})
    outside = [one for one in case.hidden if one.effect.startswith('outside_')]
    fair = {name for one in outside for name in one.fair}
    floors = [one.recorded.floor(one.run, case.base) for one in case.trains]
    onset = None
    if case.onset is not None:
        onset = {'recording': _names(case)[case.onset[0]], 'time': case.onset[1] * 1e-3}
    return {
        'stratum': case.request.stratum, 'motion': case.request.motion,
        'refitted': case.request.refitted, 'held': case.request.held,
        'calibration': case.calibration, 'effects': effects, 'accepted': case.accepted,
        'fair': sorted(fair | (set(case.accepted) - {one.effect for one in case.hidden}
                               if outside else set())),
        'depends_on': [list(group) for one in outside for group in one.depends_on],
        'memory': any(one.memory for one in outside), 'tags': _tags(case), 'onset': onset,
        'recordings': _names(case), 'other_load_shape': case.shape_ratio > 0.5,
        'shape_ratio': case.shape_ratio, 'machine': asdict(case.machine),
        'unit_of_angle': case.machine.angle,
        'cutoff': _cutoff(case), 'disc_recorded': case.disc_recorded, 'sensors': asdict(sensors),
        'bench': asdict(bench), 'base': model(case.base), 'lacking': model(case.lacking),
        'nominal': model(case.nominal), 'plant': settings_of(case.plant),
        'train_floor': unit * rms(np.array(floors)),
        'test_floor': unit * case.test.recorded.floor(case.test.run, case.base),
    }


def write_case(case: Case, folder: Path, truth: Path, rng: np.random.Generator) -> None:
    """Write `folder` (train…, test, nominal.yaml) and the `truth` file."""
    folder.mkdir(parents=True)
    layout = str(rng.choice(LAYOUTS))
    namespace = '/engb' if rng.random() < 0.85 else str(
        rng.choice(['/front_left', '/front_right', '/rear_left', '/rear_right']))
    start = 1767000000_000000000 + int(rng.integers(0, 10**15))
    bench = Bench(namespace, layout, start, case.machine)
    feed = Nominal(float(case.plant['ff_inertia'][0]), float(case.plant['ff_viscous'][0]),
                   case.base.load, None, 0.0, 0.0, 1.0)
    takes = [*zip(_names(case), case.trains, strict=True), ('test', case.test)]
    for number, (name, take) in enumerate(takes):
        at = Bench(namespace, layout, start + number * 10**11, case.machine)
        write_recording(folder, name, at, take.recorded, take.run, take.reference, feed,
                        take.disc if case.disc_recorded else None, rng)
    write_model(folder / 'nominal.yaml', case.nominal, case.plant, case.machine)
    truth.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(truth, truth=np.array(json.dumps(_facts(case, bench))), **_arrays(case))


def _arrays(case: Case) -> dict[str, np.ndarray]:
    test, angle, torque = case.test.run, case.machine.angle, case.machine.torque
    told = motion_of(case.test.recorded, test.position.size)
    added = _added(case, case.test)
    shape = curves(case.plant, test.position) - load_of(case.base, test.position)
    found = {
        'test_added': torque * added[::2], 'test_effort': torque * test.effort,
        'test_velocity': angle * test.velocity, 'test_position': angle * test.position,
        'test_nominal': torque * torque_of(case.nominal, told),
        'test_oracle': torque * (torque_of(case.lacking, told) + added
                                 + (shape if case.shape_ratio else 0.0))}
    for index, (name, take) in enumerate(zip(_names(case), case.trains, strict=True)):
        acts = _added(case, take, _acting(case, index))
        found |= {
            f'{name}_energy': torque ** 2 * _energy(case, acts, take),
            f'{name}_moves': _per_bin(moving(take.run.velocity)).any(axis=1),
            f'{name}_velocity': angle * take.run.velocity[::10],
            f'{name}_position': angle * take.run.position[::10],
            f'{name}_added': torque * acts[::2]}
    return {name: array if array.dtype == bool else array.astype(np.float32)
            for name, array in found.items()}


def open_truth(path: Path) -> tuple[dict, dict[str, np.ndarray]]:
    """The facts and the arrays of a truth file."""
    with np.load(path) as data:
        arrays = {name: data[name] for name in data.files if name != 'truth'}
        return json.loads(str(data['truth'])), arrays


def digest_of(folder: Path) -> str:
    """SHA-256 over the names and sums of all truth files of a set."""
    total = hashlib.sha256()
    for path in sorted(folder.glob('case_*.npz')):
        total.update(path.name.encode())
        total.update(hashlib.sha256(path.read_bytes()).digest())
    return total.hexdigest()
