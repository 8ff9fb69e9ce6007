"""Runs an experiment in this process, on the classes that the nodes are made of (for tests)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import tempfile

import numpy as np

from engb_core.control.excitation import Excitation
from engb_core.control.loop import LoopSettings, PositionLoop
from engb_core.control.reference import ReferenceSource
from engb_core.model import Model
from engb_core.recording import Recording, Reference, Signal
from engb_core.reproduce import chosen
from engb_core.reproduce.plan import Experiment
from engb_core.sensors import SensorSettings
from engb_core.virtual_brake import Profile, VirtualBrake

__all__ = ['run_experiment']


def run_experiment(experiment: Experiment, model: Model, seed: int = 1) -> Recording:
    """Return the recording that the nodes would make, but for the network's timing.

    Args:
        experiment: what to run.
        model: the controller's.
        seed: of the sensor noise.
    """
    brake = VirtualBrake(
        experiment.brake,
        sensors=SensorSettings(seed=seed + experiment.seed, **chosen.SENSORS),
        disc_speed=Profile([0.0], [experiment.disc_speed], 'disc_speed'))
    count = round(experiment.duration / brake.period)
    rows = np.empty((count, 4))
    tracked = np.empty((count, 4))
    step = _excited(experiment) if experiment.excitation else _closed(experiment, model)
    for row in range(count):
        measured = brake.advance()
        rows[row] = measured.time, measured.position, measured.velocity, measured.effort
        torque, tracked[row] = step(measured)
        brake.command(torque)
    reference = None
    if experiment.excitation is None:
        reference = Reference(tracked[:, 0], tracked[:, 1], tracked[:, 2], tracked[:, 3])
    disc = Signal(rows[[0, -1], 0], np.full(2, experiment.disc_speed))
    return Recording.from_samples(experiment.name, *rows[:, [0, 1, 3]].T, rows[:, 2], reference,
                                  {'disc_speed': disc})


def _excited(experiment: Experiment):
    excitation = Excitation(experiment.excitation)
    nothing = np.full(4, np.nan)
    return lambda measured: (excitation.torque(measured.time), nothing)


def _closed(experiment: Experiment, model: Model):
    loop = PositionLoop(model, LoopSettings(
        experiment.gains, load_feedforward=experiment.load_feedforward,
        friction_feedforward=experiment.friction_feedforward))
    source = _source(experiment)

    def step(measured):
        setpoint = source.at(measured.time, measured.position)
        torque = loop.step(measured.time, measured.position, measured.velocity, measured.effort,
                           setpoint)
        return torque, (measured.time, setpoint.position, setpoint.velocity, loop.feedforward)

    return step


def _source(experiment: Experiment) -> ReferenceSource:
    if experiment.table is None:
        return ReferenceSource(experiment.reference)
    with tempfile.TemporaryDirectory(prefix='engb_reference_') as folder:
        path = Path(folder) / 'reference.csv'
        experiment.table.write(path)
        return ReferenceSource(replace(experiment.reference, file=str(path)))
