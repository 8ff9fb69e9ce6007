# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Sets of public servos: what becomes of their files. The recordings stay outside the project."""

import json

import numpy as np
import pytest
import yaml

from engb_core.library import read
from engb_core.model import Friction, LoadTorque, Model, Motor

from . import public_servos
from .public_servos import (
    nominal_model,
    Pendulum,
    runs_in,
    Servo,
    slow_strokes,
    with_what_was_found,
)

SERVO = Servo('servo', 'folder', 0.16, 0.01)
PENDULUM = Pendulum(0.5, 0.15)
PER_VOLT, GAIN, VISCOUS = 0.6, 0.3, 1.2


def entries(gain, trajectory, mass=PENDULUM.mass):
    """Return what the recorders would have written of a slow stroke up and down."""
    time = np.arange(0.0, 6.0, 0.01)
    position = 0.6 * (1.0 - np.cos(np.pi * time / 3.0))
    velocity = np.gradient(position, time)
    pendulum = Pendulum(mass, PENDULUM.length)
    load = pendulum.load * np.sin(position)
    torque = (load + GAIN * np.abs(load) * np.tanh(velocity / 0.05) + VISCOUS * velocity
              + (pendulum.inertia + SERVO.armature) * np.gradient(velocity, time))
    goal = position + torque / PER_VOLT / 12.0 / (gain * SERVO.duty)
    return {'mass': mass, 'length': PENDULUM.length, 'kp': gain, 'vin': 15.0,
            'trajectory': trajectory, 'entries': [
                {'timestamp': t, 'position': p, 'goal_position': g, 'torque_enable': True}
                for t, p, g in zip(time, position, goal, strict=True)]}


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / 'data' / 'feetech' / SERVO.folder / 'raw'
    place.mkdir(parents=True)
    for number, (gain, trajectory) in enumerate(
            [(8, 'up_and_down'), (8, 'up_and_down'), (8, 'up_and_down'), (12, 'up_and_down'),
             (16, 'lift_and_drop')]):
        (place / f'run{number}.json').write_text(json.dumps(entries(gain, trajectory)))
    return place


def test_slow_strokes_tell_the_torque_per_volt_and_friction_that_grows_with_load(folder):
    slow = slow_strokes(runs_in(folder, SERVO))
    assert slow.torque_per_volt == pytest.approx(PER_VOLT, rel=0.02)
    assert slow.coulomb == pytest.approx(0.0, abs=0.01)
    assert slow.load_gain == pytest.approx(GAIN, rel=0.05)


def test_a_nominal_model_knows_masses_and_lengths_and_no_friction_that_grows_with_load(folder):
    model = nominal_model(runs_in(folder, SERVO), SERVO, PER_VOLT)
    assert model['load_torque']['amplitude'] == pytest.approx(9.81 * 0.15 * (0.5 + 0.025))
    assert model['friction']['load_gain'] == 0.0
    assert model['motor']['viscous_friction'] == pytest.approx(VISCOUS, rel=0.2)


def test_where_the_drive_is_off_nothing_is_known_of_its_effort(folder):
    assert {run.trajectory for run in runs_in(folder, SERVO)} == {'up_and_down'}


def test_each_load_is_diagnosed_and_what_was_found_of_one_holds_for_another(
        folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(public_servos, 'SERVOS', (SERVO,))
    for gain in (8, 12):
        (folder / f'other{gain}.json').write_text(json.dumps(
            entries(gain, 'up_and_down', mass=0.9)))
    out = tmp_path / 'out'
    public_servos.main([str(tmp_path), str(out)])
    told = capsys.readouterr().out
    home = out / 'servo_500g_150mm'
    assert sorted(path.name for path in home.iterdir()) == [
        'diagnosis.json', 'holdout_kp12_up_and_down_r1', 'model.yaml', 'nominal.yaml',
        'train_kp08_up_and_down_r1', 'train_kp08_up_and_down_r2']
    assert yaml.safe_load((home / 'nominal.yaml').read_text())['joint']['name'] == 'servo'
    assert read(home / 'holdout_kp12_up_and_down_r1').effort.max() > PENDULUM.load
    assert 'servo_500g_150mm: load_dependent_friction' in told
    ratios = [line.split(' own model ')[1].split(', made of another load ') for line in
              told.splitlines() if 'over the error of its file' in line]
    assert len(ratios) == 2
    for own, others in ratios:
        assert float(own) < 0.2
        assert float(others) < 0.3


def test_a_load_keeps_its_own_weight():
    first_file, first = Model(Motor(1.0, 0.03, 1.0)), Model(
        Motor(1.0, 0.031, 1.2), friction=Friction(0.1, 0.3, 0.05))
    file = Model(Motor(1.0, 0.02, 1.0), LoadTorque('sinusoid', amplitude=2.0))
    moved = with_what_was_found(file, first_file, first)
    assert moved.load_torque == file.load_torque
    assert moved.motor.inertia == pytest.approx(0.021)
    assert moved.motor.viscous_friction == 1.2
    assert moved.friction == first.friction


def test_a_clone_without_recordings_is_told(tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        public_servos.main([str(tmp_path), str(tmp_path / 'out')])
    assert stopped.value.code == 2
    assert 'check out commit d66b22c' in capsys.readouterr().err
