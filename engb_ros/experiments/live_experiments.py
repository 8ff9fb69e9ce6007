# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Runs the reproduction's experiments on live nodes and records each into a bag."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
import shutil
import tempfile
import time
from typing import Any, TYPE_CHECKING

import numpy as np

from engb_core.io.bags.read import read_recording
from engb_core.model import Model
from engb_core.recording import Recording, Signal
from engb_core.reproduce import chosen
from engb_core.reproduce.plan import Experiment
from engb_ros import interface
from engb_ros.processes.runner import reserved_domain, Runner, RunnerError, RunnerTimeout

if TYPE_CHECKING:
    from engb_ros.processes.probe import Probe  # which needs rclpy

__all__ = ['read_experiment', 'record_experiment']

Progress = Callable[[str], None]

CHANGE_STATE = interface.Service('~/change_state', 'lifecycle_msgs/srv/ChangeState',
                                 'lifecycle transition')
CONFIGURE, ACTIVATE, DEACTIVATE = 1, 3, 4

# Until all nodes hear each other [s]; discovery takes seconds on a loaded machine.
PATIENCE = 60.0

# Between the graph's word and the start [s].
SETTLING = 1.5

# Watchdogs and slew rate of the controller go by the wall clock, the experiments by the plant's.
UNWATCHED = {'state_timeout': 0.0, 'command_timeout': 0.0, 'effort_rate': 1e6,
             'largest_speed': 1e5}

# Times real time, tried in turn.
SPEEDS = (2.0, 1.0, 0.4)

# Part of the samples, and hole [s], up to which a recording counts as whole.
LOSS, LONGEST_HOLE = 0.002, 0.01


def record_experiment(experiment: Experiment, model: Model, bag: Path, seed: int,
                      progress: Progress, every: int = 1, sealed: Path | None = None,
                      identified: Path | None = None) -> Recording:
    """Run plant, controller (or excitation) and recorder as processes; leave the bag at `bag`.

    The plant waits for an answer to each sample (lockstep), and starts only when all hear each
    other: a loaded machine makes the run longer, not different. Nothing waits for the recorder;
    where it lost samples the run is made again, more slowly.

    Args:
        experiment: what to run.
        model: the controller's.
        bag: folder, made anew.
        seed: of the sensor noise.
        progress: told how far it is.
        every: keep every n-th message of each topic.
        sealed: a sealed brake for the plant, in place of the experiment's.
        identified: the identifier's node listens too, from the loop's model without its cogging,
            and writes there what it found.

    Returns:
        The bag, read back.

    Raises:
        RunnerError: a node ended or did not answer, or samples were lost at any speed.
    """
    for speed in SPEEDS:
        shutil.rmtree(bag, ignore_errors=True)
        _run(experiment, model, bag, seed, progress, every, speed, sealed, identified)
        recording = read_experiment(bag)
        missing = experiment.duration / (recording.interval * recording.time.size) - 1.0
        if (missing < LOSS and np.diff(recording.time).max() < LONGEST_HOLE * every
                and not (experiment.observed and _is_unpaired(recording, 'disturbance'))):
            return recording
        progress(f'{experiment.name}: samples were lost; once more, slower')
    raise RunnerTimeout(f'the recorder loses samples even at {SPEEDS[-1]} of real time: the '
                        'machine is too busy')


def read_experiment(bag: Path) -> Recording:
    """Return the recording of an experiment, its side signals on the plant's own clock.

    In lockstep the plant's time stands still while an answer is late, so the recorder's clock
    does not tell to which sample an unstamped message belongs. Its number does: the plant, and
    the observer that answers each sample, send one every so many samples. Where there is one for
    each sample, and not as many, it cannot tell: who missed the first one, since it was found
    late, would pair all others wrongly.
    """
    recording = read_recording(bag)
    signals = {}
    for name, signal in recording.signals.items():
        samples, count = recording.time.size, signal.value.size
        stride = max(1, round(samples / count))
        times = recording.time[stride - 1::stride]
        # Whole, or but for one of several samples; else the recorder's clock is all there is.
        if abs(times.size - count) <= (stride > 1):
            size = min(times.size, count)
            signal = Signal(times[:size], signal.value[:size])
        signals[name] = signal
    return replace(recording, signals=signals)


def _is_unpaired(recording: Recording, name: str) -> bool:
    """Return whether a signal, of which there is one for each sample, cannot be told sample by
    sample: one was missed."""
    return recording.signals[name].value.size != recording.time.size


def _run(experiment: Experiment, model: Model, bag: Path, seed: int, progress: Progress,
         every: int, speed: float, sealed: Path | None, identified: Path | None) -> None:
    from engb_ros.processes.probe import Probe
    with tempfile.TemporaryDirectory(prefix='engb_experiment_') as folder, \
            reserved_domain() as domain, Runner(domain) as runner, Probe(domain) as probe:
        scratch = Path(folder)
        runner.start('plant', parameters=_plant(experiment, scratch, seed, sealed)
                     | {'speed': speed})
        driver, parameters = _driver(experiment, model, scratch)
        runner.start(driver, parameters=parameters)
        listeners = 2
        if experiment.observed:
            runner.start('disturbance_observer', parameters={'model': scratch / 'model.yaml'})
            listeners += 1
        if identified is not None:
            replace(model, cogging=()).write(scratch / 'start.yaml')
            runner.start('identifier', parameters={'model': scratch / 'start.yaml',
                                                   'model_out': str(identified)})
            listeners += 1
        runner.start('recorder', parameters={
            'bag': str(bag), 'compression': 'zstd', 'chunk_time': 2.0, 'every': every,
            'topics': ['joint_states', 'reference', 'disc_speed', 'disturbance', 'load_cell',
                       'pad_temperature']})
        disc = probe.listen(interface.DISC_SPEED)
        runner.wait_until(lambda: probe.ready('plant', CHANGE_STATE), 'the plant', PATIENCE,
                          probe.spin)
        _change(probe, CONFIGURE)
        runner.wait_until(lambda: _all_connected(probe, listeners), 'the nodes to hear each other',
                          PATIENCE, probe.spin)
        # What this process sees of the graph, the others may see a moment later.
        _wait(probe, SETTLING)
        _change(probe, ACTIVATE)
        _follow(runner, probe, disc, experiment.duration, lambda done: progress(
            f'{experiment.name}: {done:.0f} of {experiment.duration:.0f} s'))
        _change(probe, DEACTIVATE)
        if identified is not None:
            _wait_for_model(runner, probe)
        runner.stop(['recorder'])
        runner.stop()


def _plant(experiment: Experiment, folder: Path, seed: int,
           sealed: Path | None) -> dict[str, Any]:
    brake = experiment.brake
    path = sealed or folder / 'brake.yaml'
    if sealed is None:
        brake.write(path)
    if isinstance(brake, Model):
        true: dict[str, Any] = {'model': path}
    else:
        true = {'bench': str(path), 'unloaded': experiment.unloaded,
                'added_inertia': experiment.added_inertia}
    # A busy computer may answer late; a run is the same only if every sample is answered.
    times, speeds = experiment.disc
    return {'autostart': False, **true, 'lockstep': True, 'answer_timeout': 5.0,
            'seed': seed + experiment.seed, 'disc_speed_times': list(times),
            'disc_speed_values': list(speeds), **chosen.SENSORS}


def _driver(experiment: Experiment, model: Model, folder: Path) -> tuple[str, Mapping[str, Any]]:
    if experiment.excitation is not None:
        # The plant's time may pass more slowly than the steady clock's.
        return 'excitation', asdict(experiment.excitation) | {'use_sim_time': True}
    path = folder / 'model.yaml'
    model.write(path)
    reference = experiment.reference
    if reference is None:
        raise RunnerError(f'{experiment.name}: nothing to track')
    parameters: dict[str, Any] = {
        'model': path, 'reference': reference.kind,
        'disturbance_compensation': experiment.observer > 0.0,
        **({'disturbance_cutoff': experiment.observer} if experiment.observer else {}),
        'stroke_amplitudes': list(reference.amplitudes),
        'stroke_acceleration': reference.acceleration,
        'stroke_repetitions': reference.repetitions,
        'stop_time': reference.stop_time,
        'slow_speeds': list(reference.slow_speeds),
        'slow_range': list(reference.slow_range),
        **UNWATCHED, **asdict(experiment.gains)}
    if experiment.table is not None:
        parameters['reference_file'] = folder / 'reference.csv'
        experiment.table.write(parameters['reference_file'])
    return 'controller', parameters


def _change(probe: Probe, transition: int) -> None:
    from lifecycle_msgs.srv import ChangeState
    request = ChangeState.Request()
    request.transition.id = transition
    answer = probe.call('plant', CHANGE_STATE, PATIENCE, request)
    if not answer.success:
        raise RunnerError(f'the plant refused transition {transition}')


def _wait_for_model(runner: Runner, probe: Probe) -> None:
    """Ask the identifier for what it found, until it has it."""
    answer = probe.call('identifier', interface.IDENTIFY, PATIENCE)
    if not answer.success:
        raise RunnerError(f'the identifier says: {answer.message}')
    runner.wait_until(lambda: probe.call('identifier', interface.WRITE_MODEL, PATIENCE).success,
                      'the identifier', PATIENCE, lambda: probe.spin(0.2))


def _all_connected(probe: Probe, listeners: int) -> bool:
    return (probe.subscribers(interface.JOINT_STATES) >= listeners
            and probe.publishers(interface.JOINT_STATES) >= 1
            and probe.publishers(interface.EFFORT_COMMAND) >= 1
            and probe.subscribers(interface.EFFORT_COMMAND) >= 1)


def _wait(probe: Probe, duration: float) -> None:
    end = time.monotonic() + duration
    while time.monotonic() < end:
        probe.spin(0.05)


def _follow(runner: Runner, probe: Probe, messages: list[Any], duration: float,
            tell: Callable[[float], None]) -> None:
    """Spin until the plant has sent its disc speed, a hundred a second, for `duration` [s]."""
    last, since, told = 0, time.monotonic(), 0.0
    while len(messages) < 100.0 * duration:
        probe.spin(0.05)
        runner.check()
        if len(messages) > last:
            last, since = len(messages), time.monotonic()
        elif time.monotonic() - since > PATIENCE:
            raise RunnerTimeout(f'the plant has sent nothing for {PATIENCE:.0f} s')
        if 0.01 * last - told >= 1.0:
            told = 0.01 * last
            tell(told)
