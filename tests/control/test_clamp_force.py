# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Clamp force: the map and its inverse, the estimate on the plant, wear found, honest errors."""

from dataclasses import replace
import math

from hypothesis import given, strategies
import numpy as np
import pytest

from engb_core.bench.virtual_brake import Profile, VirtualBrake
from engb_core.control.clamp_force import (
    ClampForceEstimator,
    ClampForceMap,
    read_mechanism,
)
from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.control.loop import LoopSettings, PositionLoop
from engb_core.control.pid import PidGains
from engb_core.control.trajectory import identification_strokes
from engb_core.errors import InputError
from engb_core.mechanism.statics import clamp_force
from engb_core.model import EffectSetting, LoadTorque, Model
from engb_ros.files import config_file, TRUE_BRAKE

BRAKE = Model.read(TRUE_BRAKE)
MECHANISM = read_mechanism(config_file('mechanism.yaml'))
MAP = ClampForceMap(BRAKE, MECHANISM, pad_friction=0.249)


def test_it_is_the_statics_of_the_mechanism():
    angles = np.linspace(6.0, 36.0, 20)
    mapped = [MAP.force_of_angle(angle) for angle in angles]
    assert np.allclose(mapped, clamp_force(MECHANISM, angles), rtol=0.02, atol=15.0)
    assert MAP.force_of_angle(2.0) == 0.0
    # The paper's gain P with its pad friction.
    assert MAP.load_ratio(50.0) == pytest.approx(0.421, abs=0.02)
    assert MAP.load_ratio(-50.0) == pytest.approx(2.0 - MAP.load_ratio(50.0))
    assert MAP.load_ratio(0.0) == 1.0


@given(strategies.floats(0.0, MAP.highest_force))
def test_force_and_angle_are_inverse(force):
    assert MAP.force_of_angle(MAP.angle_of_force(force)) == pytest.approx(force, abs=1e-6)


def drive(effects=(), disc=0.0, duration=1.0, strokes=3):
    """Return the estimator after strokes on a brake, true and estimated forces and their std."""
    plant = replace(BRAKE, effects=effects)
    brake = VirtualBrake(plant, disc_speed=Profile([0.0], [disc], 'disc_speed'))
    loop = PositionLoop(BRAKE, LoopSettings(PidGains(0.4, 1.5, 0.006, 0.75, -0.75, 0.5, -0.5)))
    observer, estimator = DisturbanceObserver(BRAKE.motor), ClampForceEstimator(MAP)
    path = identification_strokes([25.0] * strokes, 100.0, duration)
    shift = sum(entry.parameters['shift'] for entry in effects if entry.effect == 'contact_shift')
    rows = []
    measured = brake.advance()
    while measured.time < path.duration:
        brake.command(loop.step(*measured[:4], path.at(measured.time)))
        measured = brake.advance()
        time, position, velocity, effort, *_ = measured
        estimate = estimator.step(time, position, velocity,
                                  observer.step(time, velocity, effort), disc)
        rows.append((MAP.force_of_angle(brake.plant.position - shift), estimate,
                     estimator.force_std))
    return estimator, np.array(rows)


def test_a_brake_as_identified_is_estimated_within_its_own_error():
    estimator, rows = drive()
    true, estimate, std = rows[len(rows) // 3:].T
    assert abs(estimator.shift) < 0.3
    assert np.sqrt(np.mean((estimate - true)**2)) < 0.04 * true.max()
    assert np.mean(np.abs(estimate - true) < 3.0 * std + 1.0) > 0.99


@pytest.mark.parametrize('shift', [-1.5, 2.0])
def test_wear_is_found_without_a_force_sensor(shift):
    estimator, rows = drive((EffectSetting('contact_shift', {'shift': shift}),))
    true, estimate, std = rows[len(rows) // 2:].T
    assert estimator.shift == pytest.approx(shift, abs=0.35)
    assert np.sqrt(np.mean((estimate - true)**2)) < 0.05 * true.max()
    assert np.mean(np.abs(estimate - true) < 3.0 * std + 1.0) > 0.95
    naive = np.array([MAP.force_of_angle(MAP.angle_of_force(force) + shift) if force else 0.0
                      for force in true])
    assert np.sqrt(np.mean((estimate - true)**2)) < 0.3 * np.sqrt(np.mean((naive - true)**2))


@pytest.mark.parametrize('disc', [40.0, -40.0])
def test_a_turning_disc_is_not_taken_for_wear(disc):
    energized = (EffectSetting('self_energizing', {'load_ratio': MAP.gain}),)
    estimator, rows = drive(energized, disc)
    true, estimate, _ = rows[len(rows) // 2:].T
    assert abs(estimator.shift) < 0.4
    assert np.sqrt(np.mean((estimate - true)**2)) < 0.05 * true.max()


def test_what_is_not_finite_changes_nothing():
    estimator = ClampForceEstimator(MAP)
    before = estimator.step(0.0, 20.0, 0.0, -0.1)
    assert estimator.step(math.nan, 20.0, 0.0, -0.1) == before
    assert estimator.step(0.1, math.inf, 0.0, -0.1) == before
    assert estimator.step(0.1, 20.0, 5.0, math.nan) == pytest.approx(before)
    assert math.isfinite(estimator.force_std)


def test_a_load_that_gives_no_force_is_refused():
    for load in (LoadTorque(), LoadTorque('sinusoid', amplitude=1.0),
                 LoadTorque(coefficients=(0.0, 0.01, -2e-4), contact_angle=0.0)):
        with pytest.raises(InputError):
            ClampForceMap(replace(BRAKE, load_torque=load), MECHANISM)


@pytest.mark.parametrize(('change', 'told'), [
    ('stroke: -1.0', 'stroke'), ('wings: 2', 'unknown key wings'), ('stroke: far', 'number')])
def test_a_bad_mechanism_file_is_refused(tmp_path, change, told):
    lines = [line for line in config_file('mechanism.yaml').read_text().splitlines()
             if not line.startswith(change.split(':')[0])]
    path = tmp_path / 'mechanism.yaml'
    path.write_text('\n'.join([*lines, change]))
    with pytest.raises(InputError, match=told):
        read_mechanism(path)


def test_a_key_given_twice_in_a_mechanism_file_is_refused(tmp_path):
    """The later one would win in silence, and the force would be another."""
    path = tmp_path / 'mechanism.yaml'
    path.write_text(config_file('mechanism.yaml').read_text() + '\ngear_ratio: 99.0\n')
    with pytest.raises(InputError, match=r"mechanism.yaml: key 'gear_ratio' is given twice.*line"):
        read_mechanism(path)
