# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The table that a diagnosis proposes, run by the controller node."""

import numpy as np

from engb_core.diagnose.diagnosis import NextExperiment
from engb_core.diagnose.experiment.room import Room
from engb_core.diagnose.experiment.segments import course_of, segments_of
from engb_core.io.bags.read import read_recording
from engb_ros.commands.diagnose import write_experiment
from engb_ros.processes.bench import Bench

ROOM = Room(low=0.5, high=30.0, speed=40.0, acceleration=100.0, slowest=0.5, finest=0.02,
            home=0.0, angle=np.linspace(0.5, 30.0, 50), load=np.linspace(0.0, 1.0, 50) ** 2,
            unit='rad')


def test_the_controller_node_runs_the_proposed_table(runner, probe, tmp_path):
    course = course_of(ROOM, [segment for segment in segments_of(ROOM)
                              if segment.name in ('fast full strokes', 'holds under load')])
    # The strokes, and the first of the holds.
    kept = course.time < 9.0
    time, position = course.time[kept], course.position[kept]
    table = tmp_path / 'next_experiment.csv'
    write_experiment(table, NextExperiment('', ('a', 'b'), '', time, position))
    bench = Bench(runner, probe, rate=500.0)
    length = bench.record(tmp_path / 'bag', controller={
        'reference': 'file', 'reference_file': table})
    bench.stop()
    assert length >= time[-1] - time[0]
    run = read_recording(str(tmp_path / 'bag'))
    assert run.position.max() > 0.97 * position.max()
    wanted = run.reference
    # The course begins some time after the recording: both pass 5 rad at the same moment.
    begin = (_passes(5.0, wanted.time, wanted.position)
             - _passes(5.0, time, position))
    assert begin > wanted.time[0]
    expected = np.interp(wanted.time - begin, time, position)
    assert np.abs(expected - wanted.position).max() < 0.3


def _passes(angle, time, position):
    """Return when the angle [rad] is first passed [s]."""
    after = np.argmax(position > angle)
    return np.interp(angle, position[after - 1:after + 1], time[after - 1:after + 1])
