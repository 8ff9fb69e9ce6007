"""Write a case's folder, and its truth elsewhere with a digest.

Truth of one case is one `.npz`: `truth` (JSON text) and arrays on the 1 ms grid of the runs.
`test_nominal` and `test_oracle` are what the nominal model, and what the true equations, say of
the *recorded* motion of the test run; `test_effort` is the noise-free torque that it needed.
`train_added`, `test_added`: what the hidden effects add to the lacking model, at 500 Hz.
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
from .locate import BIN
from .nominal import low_pass, moving, Nominal, residual, rms, torque_of
from .plant_record import settings_of
from .sensors import motion_of

__all__ = ['digest_of', 'open_truth', 'write_case']


def _cutoff(case: Case) -> float:
    """The band in which the hidden effects are judged [Hz]."""
    return max([20.0, *(one.cutoff for one in case.hidden)])


def _added(case: Case, take: Take) -> np.ndarray:
    """Torque [N·m] that the hidden effects add to the lacking model, at each tick."""
    return take.run.effort - torque_of(case.lacking, take.run)


def _energy(case: Case, take: Take) -> np.ndarray:
    """Energy [(N·m)²·s] per BIN of what the hidden effects add to the lacking model."""
    cutoff = _cutoff(case)
    move = moving(take.run.velocity)
    added = low_pass(move * _added(case, take), cutoff=cutoff)
    square = (added * move) ** 2 * 1e-3
    per = int(round(BIN / 1e-3))
    return square[:square.size // per * per].reshape(-1, per).sum(axis=1)


def _facts(case: Case, bench: Bench) -> dict[str, object]:
    def model(one: Nominal) -> dict[str, object]:
        return asdict(one)

    train = case.train
    noisy = train.run.effort + train.recorded.noise
    effects = []
    for one, size, ratio, values in zip(case.hidden, case.magnitudes, case.ratios,
                                        case.parameters, strict=True):
        effects.append({'effect': one.effect, 'formulation': one.formulation, 'ratio': ratio,
                        'magnitude': size, 'parameters': {k: float(v) for k, v in values.items()}})
    return {
        'stratum': case.request.stratum, 'motion': case.request.motion,
        'refitted': case.request.refitted, 'effects': effects,
        'cutoff': _cutoff(case), 'disc_recorded': case.disc_recorded,
        'sensors': asdict(case.sensors),
        'bench': asdict(bench), 'base': model(case.base), 'lacking': model(case.lacking),
        'nominal': model(case.nominal), 'plant': settings_of(case.plant),
        'train_floor': train.recorded.floor(),
        'nominal_ratio': rms(residual(case.nominal, train.run, noisy)) / train.recorded.floor(),
        'test_floor': case.test.recorded.floor(),
        'test_nominal_error': rms(residual(case.nominal, case.test.run, case.test.run.effort)),
    }


def write_case(case: Case, folder: Path, truth: Path, rng: np.random.Generator) -> None:
    """Write `folder` (train, test, nominal.yaml) and the `truth` file."""
    folder.mkdir(parents=True)
    layout = str(rng.choice(LAYOUTS))
    namespace = '/engb' if rng.random() < 0.85 else str(
        rng.choice(['/front_left', '/front_right', '/rear_left', '/rear_right']))
    start = 1767000000_000000000 + int(rng.integers(0, 10**15))
    bench = Bench(namespace, layout, start)
    feed = Nominal(float(case.plant['ff_inertia'][0]), float(case.plant['ff_viscous'][0]),
                   case.base.load, None, 0.0, 0.0, 1.0)
    for name, take, shift in (('train', case.train, 0), ('test', case.test, 10**11)):
        at = Bench(namespace, layout, start + shift)
        write_recording(folder, name, at, take.recorded, take.run, take.reference, feed,
                        take.disc if case.disc_recorded else None, rng)
    write_model(folder / 'nominal.yaml', case.nominal, case.plant)
    truth.parent.mkdir(parents=True, exist_ok=True)
    test = case.test.run
    told = motion_of(case.test.recorded, test.position.size)
    added = _added(case, case.test)
    np.savez_compressed(
        truth, truth=np.array(json.dumps(_facts(case, bench))),
        train_energy=_energy(case, case.train).astype(np.float32),
        train_velocity=case.train.run.velocity[::10].astype(np.float32),
        train_position=case.train.run.position[::10].astype(np.float32),
        train_added=_added(case, case.train)[::2].astype(np.float32),
        test_added=added[::2].astype(np.float32),
        test_effort=test.effort.astype(np.float32), test_velocity=test.velocity.astype(np.float32),
        test_position=test.position.astype(np.float32),
        test_nominal=torque_of(case.nominal, told).astype(np.float32),
        test_oracle=(torque_of(case.lacking, told) + added).astype(np.float32))


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
