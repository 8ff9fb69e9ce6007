# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The set of a public servo: what becomes of its files. The recordings stay outside."""

import json

import numpy as np
import pytest
import yaml

from engb_core.library import read

from . import public_xl330
from .public_xl330 import PointMass, runs_in, torque_per_volt

PER_VOLT, PER_LOAD, ARMATURE = 0.08, 0.2, 0.0018
MASS = PointMass(0.5, 0.1)


def entries(gain: int, trajectory: str) -> dict:
    """Return what the recorders would have written of two strokes up and down."""
    time = np.arange(0.0, 6.0, 0.005)
    position = 0.6 * np.sin(2.0 * np.pi * time / 3.0)
    velocity = np.gradient(position, time)
    load = MASS.load * np.sin(position)
    torque = (load + PER_LOAD * np.abs(load) * np.tanh(velocity / 0.05) + 0.02 * velocity
              + (MASS.inertia + ARMATURE) * np.gradient(velocity, time))
    counts = np.round(torque / PER_VOLT / 7.3 * 885.0).astype(int) % 65536
    return {'mass': MASS.mass, 'length': MASS.length, 'kp': gain, 'trajectory': trajectory,
            'entries': [{'timestamp': t, 'position': p, 'goal_position': p, 'load': int(n),
                         'input_volts': 7.3}
                        for t, p, n in zip(time, position, counts, strict=True)]}


@pytest.fixture
def clone(tmp_path):
    folder = tmp_path / 'clone' / 'bam' / 'data.bak' / 'raw'
    folder.mkdir(parents=True)
    for number, (gain, trajectory) in enumerate(
            [(100, 'sin_sin'), (200, 'sin_sin'), (400, 'lift_and_drop')]):
        (folder / f'run{number}.json').write_text(json.dumps(entries(gain, trajectory)))
    return tmp_path / 'clone'


def test_the_set_is_written_as_a_test_of_real_machines_reads_it(clone, tmp_path, capsys):
    public_xl330.main([str(clone), str(tmp_path / 'sets')])
    home = tmp_path / 'sets' / 'xl330'
    assert sorted(path.name for path in home.iterdir()) == [
        'holdout_kp200_sin_sin', 'nominal.yaml', 'train_kp100_sin_sin']
    assert 'friction per load 0.2' in capsys.readouterr().out
    model = yaml.safe_load((home / 'nominal.yaml').read_text())
    assert model['load_torque']['amplitude'] == pytest.approx(MASS.load)
    effort = read(home / 'train_kp100_sin_sin').effort
    assert effort.min() < -0.9 * MASS.load * np.sin(0.6)


def test_regression_tells_torque_per_volt_and_friction_per_load(clone):
    runs = runs_in(clone / 'bam' / 'data.bak' / 'raw')
    assert {run.trajectory for run in runs} == {'sin_sin'}
    assert torque_per_volt(runs) == pytest.approx((PER_VOLT, PER_LOAD), rel=0.15)


def test_a_clone_without_recordings_is_told(tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        public_xl330.main([str(tmp_path), str(tmp_path / 'out')])
    assert stopped.value.code == 2
    assert 'check out commit af22604' in capsys.readouterr().err
