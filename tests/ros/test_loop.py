# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The nodes together: one run of identification strokes over DDS, looked at from all sides."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import get_typestore, Stores
import yaml

from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.control.feedforward import Feedforward
from engb_core.io.bags.read import read_recording
from engb_core.model import Model
from engb_core.recording import Recording
from engb_ros.files import TRUE_BRAKE
from engb_ros.interface import DISTURBANCE, FRICTION_TORQUE, IDENTIFY, LOAD_TORQUE, WRITE_MODEL
from engb_ros.processes.bench import Bench
from engb_ros.processes.probe import Probe
from engb_ros.processes.runner import reserved_domain, Runner

RATE = 500.0


@dataclass(frozen=True)
class Run:
    """What is left of a run: its bag, the model that the identifier wrote, live torques."""

    bag: Path
    recording: Recording
    model: Model
    load: list[float]
    friction: list[float]


def one_run(folder):
    """Drive strokes with all nodes and return what is left of it."""
    with reserved_domain() as domain, Runner(domain) as runner, Probe(domain) as probe:
        bench = Bench(runner, probe, RATE)
        load, friction = probe.listen(LOAD_TORQUE), probe.listen(FRICTION_TORQUE)
        bench.record(
            folder / 'bag', controller={'stroke_amplitudes': [36.0], 'slow_speeds': [4.0],
                                        'stroke_acceleration': 80.0, 'repeat': True},
            others=('disturbance_observer', 'identifier'))
        assert not probe.call('identifier', WRITE_MODEL).success
        answer = probe.call('identifier', IDENTIFY)
        assert answer.success, answer.message
        runner.wait_until(lambda: probe.call('identifier', WRITE_MODEL).success,
                          'the identified model', timeout=120.0)
        mapping = yaml.safe_load(probe.call('identifier', WRITE_MODEL).message)
        begin = len(load)
        runner.wait_until(lambda: len(load) > begin + 50 and len(friction) > begin + 50,
                          'the torques', pause=probe.spin)
        bench.stop()
        return Run(folder / 'bag', read_recording(str(folder / 'bag')),
                   Model.from_mapping(mapping), [message.data for message in load],
                   [message.data for message in friction])


def floats(bag, topic):
    """Return all values of a Float64 topic of a bag, in order."""
    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        chosen = [entry for entry in reader.connections if entry.topic.endswith(topic.name)]
        return np.array([reader.deserialize(raw, connection.msgtype).data
                         for connection, _, raw in reader.messages(chosen)])


def no_sample_is_missing(run):
    steps = np.diff(run.recording.time)
    assert steps.max() == pytest.approx(1.0 / RATE, rel=1e-6)
    assert run.recording.time.size > 8.0 * RATE


def the_strokes_are_tracked(run):
    reference = run.recording.reference
    wanted = np.interp(run.recording.time, reference.time, reference.position)
    inside = (run.recording.time > reference.time[0]) & (run.recording.time < reference.time[-1])
    error = (wanted - run.recording.position)[inside]
    assert run.recording.position.max() > 35.5
    # The nominal model feeds forward neither load nor friction (paper, section 4: 0.38 rad rms).
    assert np.sqrt(np.mean(error**2)) < 0.4


def the_observer_node_is_the_offline_filter(run):
    recorded = run.recording
    offline = DisturbanceObserver(Model().motor).filter(
        recorded.time, recorded.velocity, recorded.effort)
    live = floats(run.bag, DISTURBANCE)
    # Float64 carries no stamp, and nodes that are there may hear each other a moment later: where
    # it begins is looked for. From there on no sample is missing.
    assert live.size > 0.5 * offline.size
    begin = live.size // 3
    windows = np.lib.stride_tricks.sliding_window_view(offline, 300)
    apart = np.abs(windows - live[begin:begin + 300]).max(axis=1)
    place = int(np.argmin(apart))
    assert apart[place] < 1e-9
    size = min(live.size - begin, offline.size - place)
    assert size > 0.3 * offline.size
    assert np.abs(live[begin:begin + size] - offline[place:place + size]).max() < 1e-9


def the_identifier_found_the_brake(run):
    true, found = Feedforward(Model.read(TRUE_BRAKE)), Feedforward(run.model)
    for angle in (12.0, 24.0, 35.0):
        assert found.load_torque(angle) == pytest.approx(true.load_torque(angle), abs=0.006)
    assert found.friction_torque(0.2, 20.0) == pytest.approx(
        true.friction_torque(0.2, 20.0), rel=0.1)


def the_identified_torques_are_published(run):
    assert max(run.load) <= Feedforward(run.model).load_torque(36.5)
    assert len(run.load) > 50
    assert len(run.friction) > 50
    assert all(np.isfinite(run.load))


def test_one_run_of_strokes_seen_from_all_sides(tmp_path):
    # One test, not five: the run takes a while, and parallel workers would each make their own.
    run = one_run(tmp_path)
    no_sample_is_missing(run)
    the_strokes_are_tracked(run)
    the_observer_node_is_the_offline_filter(run)
    the_identifier_found_the_brake(run)
    the_identified_torques_are_published(run)
