# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Runs an experiment in this process, on the classes that the nodes are made of (for tests)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
import tempfile

import numpy as np
from numpy.typing import NDArray

from engb_core.bench.brake import BenchBrake
from engb_core.bench.sensors import SensorSettings
from engb_core.bench.virtual_brake import Measurement, Profile, VirtualBrake
from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.control.excitation import Excitation
from engb_core.control.loop import LoopSettings, PositionLoop
from engb_core.control.reference import ReferenceSource
from engb_core.errors import InputError
from engb_core.model import Model
from engb_core.recording import Recording, Reference, Signal
from engb_core.reproduce import chosen
from engb_core.reproduce.plan import Experiment

__all__ = ['replay', 'Replay', 'run_experiment', 'virtual_brake']

Array = NDArray[np.float64]
Step = Callable[[Measurement], tuple[float, tuple[float, float, float, float]]]


def virtual_brake(experiment: Experiment, seed: int) -> VirtualBrake:
    """Return the experiment's brake behind its drive.

    Args:
        experiment: which.
        seed: of the sensor noise, of the load cell too.
    """
    brake, seed = experiment.brake, seed + experiment.seed
    bench = None
    if not isinstance(brake, Model):
        bench = BenchBrake(brake, experiment.added_inertia, experiment.unloaded, seed)
    return VirtualBrake(
        brake if isinstance(brake, Model) else Model(),
        sensors=SensorSettings(seed=seed, **chosen.SENSORS),
        disc_speed=Profile(*experiment.disc, 'disc_speed'), bench=bench)


def run_experiment(experiment: Experiment, model: Model, seed: int = 1) -> Recording:
    """Return the recording that the nodes would make, but for the network's timing.

    Args:
        experiment: what to run.
        model: the controller's.
        seed: of the sensor noise.
    """
    brake = virtual_brake(experiment, seed)
    count = round(experiment.duration / brake.period)
    rows = np.empty((count, 7))
    tracked = np.empty((count, 4))
    step = _excited(experiment) if experiment.excitation else _closed(experiment, model)
    for row in range(count):
        measured = brake.advance()
        rows[row] = measured
        torque, tracked[row] = step(measured)
        brake.command(torque)
    time, position, velocity, effort, disc, temperature, force = rows.T
    reference = None
    if experiment.excitation is None:
        reference = Reference(tracked[:, 0], tracked[:, 1], tracked[:, 2], tracked[:, 3])
    signals = {'disc_speed': Signal(time, disc)}
    if not isinstance(experiment.brake, Model):
        signals |= {'load_cell': Signal(time, force),
                    'pad_temperature': Signal(time, temperature)}
    if experiment.observed:
        signals['disturbance'] = Signal(time, DisturbanceObserver(model.motor).filter(
            time, velocity, effort))
    return Recording.from_samples(experiment.name, time, position, effort, velocity, reference,
                                  signals)


@dataclass(frozen=True)
class Replay:
    """What no sensor tells of a run: `time` [s], `wear` [m], `temperature` [°C], `force` F_N [N]
    and `pad_friction` μ [-] of the simulated brake, (k,) each."""

    time: Array
    wear: Array
    temperature: Array
    force: Array
    pad_friction: Array


def replay(experiment: Experiment, model: Model, seed: int = 1) -> Replay:
    """Run an experiment again and return the simulated brake's own state, 100 times a second.

    Args:
        experiment: closed loop on a bench brake.
        model: the controller's.
        seed: of the sensor noise.

    Raises:
        InputError: not a bench brake.
    """
    brake = virtual_brake(experiment, seed)
    bench = brake.plant
    if not isinstance(bench, BenchBrake):
        raise InputError(f'{experiment.name}: only a bench brake wears and heats')
    step = _closed(experiment, model)
    rows = []
    for sample in range(round(experiment.duration / brake.period)):
        measured = brake.advance()
        brake.command(step(measured)[0])
        if sample % 10 == 0:
            rows.append((measured.time, bench.wear, bench.pad_temperature, bench.clamp_force,
                         bench.pad_friction))
    return Replay(*np.array(rows).T)


def _excited(experiment: Experiment) -> Step:
    if experiment.excitation is None:
        raise InputError(f'{experiment.name}: nothing excites it')
    excitation = Excitation(experiment.excitation)
    nothing = (np.nan,) * 4
    return lambda measured: (excitation.torque(measured.time), nothing)


def _closed(experiment: Experiment, model: Model) -> Step:
    loop = PositionLoop(model, LoopSettings(
        experiment.gains, disturbance_compensation=experiment.observer > 0.0,
        disturbance_cutoff=experiment.observer or LoopSettings().disturbance_cutoff))
    source = _source(experiment)

    def step(measured: Measurement) -> tuple[float, tuple[float, float, float, float]]:
        setpoint = source.at(measured.time, measured.position)
        torque = loop.step(measured.time, measured.position, measured.velocity, measured.effort,
                           setpoint)
        return torque, (measured.time, setpoint.position, setpoint.velocity, loop.feedforward)

    return step


def _source(experiment: Experiment) -> ReferenceSource:
    if experiment.reference is None:
        raise InputError(f'{experiment.name}: nothing to track')
    if experiment.table is None:
        return ReferenceSource(experiment.reference)
    with tempfile.TemporaryDirectory(prefix='engb_reference_') as folder:
        path = Path(folder) / 'reference.csv'
        experiment.table.write(path)
        return ReferenceSource(replace(experiment.reference, file=str(path)))
