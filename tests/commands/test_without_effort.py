# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""`engb diagnose` of what logs no torque: bags and tables with a reference, and a model."""

from __future__ import annotations

from dataclasses import replace
import json
from pathlib import Path

import numpy as np
import pytest

from engb_core.io.bags.write import JointTable, write_bag
from engb_core.model import Controller
from tests.core.test_command_law import PENDULUM, servo

MODEL = replace(PENDULUM, controller=Controller(18.0, 0.0, 0.0, 6.8, 1000.0))


def bag_of(folder: Path, reference: bool = True) -> Path:
    recording = servo()
    assert recording.reference is not None
    topics = {'/joint_states': JointTable(recording.time, recording.position)}
    if reference:
        topics['/reference'] = JointTable(recording.reference.time, recording.reference.position)
    write_bag(folder / 'run.mcap', topics)
    return folder / 'run.mcap'


def table_of(folder: Path) -> Path:
    recording = servo()
    assert recording.reference is not None
    wanted = np.interp(recording.time, recording.reference.time, recording.reference.position)
    path = folder / 'servo.csv'
    np.savetxt(path, np.degrees(np.stack([np.radians(recording.time), recording.position,
                                          wanted], 1)),
               delimiter=',', comments='', header='time [s],position [deg],target position [deg]')
    return path


@pytest.mark.slow
@pytest.mark.parametrize('made', [bag_of, table_of])
def test_it_is_diagnosed_and_says_that_there_was_none(made, engb, tmp_path):
    given = made(tmp_path)
    MODEL.write(tmp_path / 'model.yaml')
    outcome = engb('diagnose', given, '--model', 'model.yaml', '--out', 'out')
    assert outcome.status == 0, outcome.err
    assert 'no effort was recorded' in outcome.out
    assert 'the controller of the model file' in outcome.out
    told = json.loads((tmp_path / 'out' / 'diagnosis.json').read_text('utf8'))
    assert [entry for entry in told['effects'] if entry['probability'] >= 0.5] == []
    assert 'no effort was recorded' in (tmp_path / 'out' / 'report.html').read_text('utf8')


def test_without_a_reference_it_is_refused(refused, tmp_path):
    given = bag_of(tmp_path, reference=False)
    MODEL.write(tmp_path / 'model.yaml')
    refused('diagnose', given, '--model', 'model.yaml', '--out', 'out',
            words=('run', 'no effort', 'reference'))


def test_a_prediction_still_wants_it(refused, tmp_path):
    given = bag_of(tmp_path)
    MODEL.write(tmp_path / 'model.yaml')
    refused('predict', given, '--model', 'model.yaml', '--out', 'out.npz', words=('effort',))
