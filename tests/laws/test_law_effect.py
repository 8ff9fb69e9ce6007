# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A law in a model file acts as its formula says, the same in every use of the model."""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
import pytest

from engb_core.effects.base import (
    ACCELERATION,
    DIRECTION,
    LEVEL,
    LOAD,
    POSITION,
    TIME,
    VELOCITY,
)
from engb_core.errors import InputError
from engb_core.model import EffectSetting, Friction, LoadTorque, Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.physics.sample_table import sample_table
from engb_core.physics.simulation import BrakePlant
from engb_core.prediction import predict_effort
from engb_core.recording import Recording

MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4)),
              friction=Friction(0.012, 0.1, 1.5))
STEP = 1e-3
WITHIN = {'position': (0.0, 25.0), 'velocity': (-40.0, 40.0)}


def motion() -> np.ndarray:
    time = np.arange(0.0, 4.0, STEP)
    return sample_table(STEP, time, 10.0 + 8.0 * np.sin(2.0 * time), 16.0 * np.cos(2.0 * time),
                        -32.0 * np.sin(2.0 * time))


def with_law(formula: str, acts_as: str, within: dict | None = None, **values: float) -> Model:
    return replace(MODEL, effects=(EffectSetting(
        'law', values, formula, acts_as, WITHIN if within is None else within),))


def needed(model: Model) -> tuple[np.ndarray, np.ndarray]:
    samples = motion()
    return effort_of_motion(samples, STEP, physics_of(model)), samples


def test_a_torque_is_added():
    plain, _ = needed(MODEL)
    effort, samples = needed(with_law('a * abs(load) * sin(k * position + c)', 'torque', a=0.1,
                                      k=1.3, c=0.2))
    assert np.allclose(effort - plain, 0.1 * np.abs(samples[:, LOAD])
                       * np.sin(1.3 * samples[:, POSITION] + 0.2), atol=1e-12)


def test_inertia_over_the_angle():
    plain, _ = needed(MODEL)
    effort, samples = needed(with_law('a * cos(position)', 'inertia', a=3e-5))
    angle, speed = samples[:, POSITION], samples[:, VELOCITY]
    torque = 3e-5 * (np.cos(angle) * samples[:, ACCELERATION] - 0.5 * np.sin(angle) * speed ** 2)
    assert np.allclose(effort - plain, torque, atol=1e-7 * np.abs(torque).max() + 1e-9, rtol=1e-4)


def test_gains_of_friction_and_load():
    plain, before = needed(MODEL)
    effort, _ = needed(with_law('a', 'friction_gain', a=0.5))
    assert np.allclose(effort - plain, 0.5 * before[:, LEVEL] * before[:, DIRECTION], atol=1e-12)
    effort, _ = needed(with_law('a', 'load_gain', a=0.2))
    stiff = replace(MODEL, load_torque=LoadTorque(coefficients=(0.0, 1.2e-3, 2.4e-4)))
    assert np.allclose(effort, needed(stiff)[0], atol=1e-12)


def test_a_gain_on_the_effort_itself():
    plain, _ = needed(MODEL)
    effort, _ = needed(with_law('a * abs(effort)', 'effort_gain', a=0.5))
    assert np.allclose(effort * (1.0 + 0.5 * np.abs(effort)), plain, atol=1e-6)


def test_a_delay_is_exact():
    plain, samples = needed(MODEL)
    effort, _ = needed(with_law('a * load', 'delay', a=0.05))
    time = STEP * np.arange(plain.size)
    late = time - 0.05 * samples[:, LOAD]
    assert np.allclose(effort[100:-100], np.interp(time, late, plain)[100:-100], atol=1e-12)


def test_a_position_that_is_late():
    """The motion of a recording whose position came late by what the load says is the true one."""
    time = np.arange(0.0, 6.0, STEP)
    true = 10.0 + 8.0 * np.sin(2.0 * time)
    model = with_law('a * load', 'position_delay', a=0.1)
    late = np.zeros(time.size)
    for _ in range(50):
        seen = np.interp(time - late, time, true)
        late = 0.1 * (1e-3 * seen + 2e-4 * seen ** 2)

    def effort(position: np.ndarray, model: Model) -> np.ndarray:
        recording = Recording('run', time, position, np.zeros(time.size))
        return predict_effort(recording, model)[500:-500]

    wanted = effort(true, MODEL)
    found, without = effort(seen, model), effort(seen, MODEL)
    moving = np.abs(16.0 * np.cos(2.0 * time))[500:-500] > 3.0
    assert np.abs(found - wanted)[moving].max() < 0.1 * np.abs(without - wanted)[moving].max()


def test_a_sensor_off_by_a_wave_too_fast_for_the_samples():
    """At 100 Hz a wave of 16 per revolution is aliased; at the recorded samples it is known."""
    rate = 100.0
    time = np.arange(0.0, 20.0, 1.0 / rate)
    true = 20.0 + 15.0 * np.sin(time) + 4.0 * np.sin(3.1 * time)
    seen = true - 0.004 * np.sin(16.0 * true)
    model = with_law('a * sin(16 * position)', 'position_shift',
                     {'position': (0.0, 40.0), 'velocity': (-40.0, 40.0)}, a=0.004)

    def effort(position: np.ndarray, model: Model) -> np.ndarray:
        return predict_effort(Recording('run', time, position, np.zeros(time.size)), model)[50:-50]

    wanted = effort(true, MODEL)
    found, without = effort(seen, model), effort(seen, MODEL)
    assert np.std(found - wanted) < 0.2 * np.std(without - wanted)


def test_a_shifted_position():
    effort, _ = needed(with_law('a', 'position_shift', a=0.3))
    moved = motion()
    moved[:, POSITION] += 0.3
    assert np.allclose(effort, effort_of_motion(moved, STEP, physics_of(MODEL)), atol=1e-9)


def test_held_where_nobody_has_been():
    inside, samples = needed(with_law('a * position', 'torque', {'position': (5.0, 12.0)}, a=1e-3))
    plain, _ = needed(MODEL)
    assert np.allclose(inside - plain, 1e-3 * np.clip(samples[:, POSITION], 5.0, 12.0), atol=1e-12)


def test_memory_begins_anew_with_each_run():
    model = with_law('a * stop(position, b) + c * lag(direction, d)', 'torque', a=0.01, b=0.5,
                     c=0.01, d=0.2)
    physics = physics_of(model)
    first = effort_of_motion(motion(), STEP, physics)
    assert np.array_equal(first, effort_of_motion(motion(), STEP, physics))
    assert np.ptp(first - needed(MODEL)[0]) > 0.02


def test_the_largest_so_far_fades():
    samples = motion()
    held, _ = needed(with_law('a * highest(position, 1000000)', 'torque', a=1e-3))
    plain, _ = needed(MODEL)
    largest = np.maximum.accumulate(samples[:, POSITION])
    assert np.allclose(held - plain, 1e-3 * largest, atol=1e-6)
    follows, _ = needed(with_law('a * highest(position, 0.000001)', 'torque', a=1e-3))
    assert np.allclose(follows - plain, 1e-3 * samples[:, POSITION], atol=1e-6)


@pytest.mark.parametrize('law', [
    ('a * positive(position - 5)', 'torque', {'a': 2e-3}),
    ('a * sin(position)', 'inertia', {'a': 3e-5}),
    ('a * tanh(effort / 0.05)', 'effort_gain', {'a': 0.2}),
    ('a * bell(position - 8, 2)', 'friction_gain', {'a': 1.0}),
    ('a * lag(velocity, 0.2)', 'load_gain', {'a': 0.01}),
])
def test_simulation_and_inverse_agree(law):
    """The effort that drove a simulated brake is what its motion needs."""
    formula, acts_as, values = law
    model = with_law(formula, acts_as, **values)
    plant = BrakePlant(model, position=8.0)
    time = STEP * np.arange(3000)
    drive = 0.09 + 0.09 * np.sin(5.0 * time)
    rows = []
    for effort in drive:
        rows.append((plant.time, plant.position, plant.velocity))
        plant.advance(effort, STEP)
    table = np.array(rows)
    acceleration = np.gradient(table[:, 2], STEP)

    def error(model: Model) -> float:
        samples = sample_table(STEP, table[:, 0], table[:, 1], table[:, 2], acceleration)
        effort = effort_of_motion(samples, STEP, physics_of(model))
        moving = np.abs(table[:, 2]) > 1.0
        return float(np.sqrt(np.mean((effort - drive)[moving] ** 2)))

    assert np.mean(np.abs(table[:, 2]) > 1.0) > 0.3
    assert error(model) < 0.15 * error(MODEL)


def test_the_file_keeps_it(tmp_path):
    model = with_law('a * abs(load) * sin(k * position)', 'torque', a=0.1, k=1.25)
    path = tmp_path / 'model.yaml'
    model.write(path)
    assert Model.read(path) == model


@pytest.mark.parametrize(('setting', 'wrong'), [
    (EffectSetting('law'), 'formula'),
    (EffectSetting('law', {}, 'a * load', 'torque'), 'no value for a'),
    (EffectSetting('law', {'a': 1.0, 'b': 1.0}, 'a * load', 'torque'), "'b'"),
    (EffectSetting('law', {'a': 1.0}, 'a * load', 'warp'), 'acts_as'),
    (EffectSetting('law', {'a': 1.0}, 'a * effort', 'torque'), 'effort'),
    (EffectSetting('law', {'a': 1.0}, 'a * velocity', 'inertia'), 'position alone'),
    (EffectSetting('law', {'a': 1.0}, 'a * lag(load, 1)', 'delay'), 'memory'),
    (EffectSetting('law', {'a': 1.0}, 'a * load', 'torque', {'load': (2.0, 1.0)}), 'within.load'),
    (EffectSetting('law', {'a': 1.0}, 'a * load', 'torque', {'lod': (0.0, 1.0)}), 'within.lod'),
    (EffectSetting('law', {'a': 1.0}, 'a * load * ' + 'load * ' * 30 + 'load', 'torque'),
     'too long'),
])
def test_a_wrong_law_is_told(setting, wrong):
    with pytest.raises(InputError, match=wrong):
        physics_of(replace(MODEL, effects=(setting,)))


def test_no_formula_makes_a_number_that_is_none():
    formula = 'a / (position - position) + (0 - b)**0.5 * exp(900 * b)'
    effort, _ = needed(with_law(formula, 'torque', a=1.0, b=2.0))
    assert np.isfinite(effort).all() and math.isfinite(float(effort.sum()))


def test_the_time_since_a_reversal_is_told_beside_the_rest():
    """Each coordinate that is followed keeps its own count: a formula may hold several."""
    samples = motion()
    samples[:, VELOCITY] = np.where(samples[:, TIME] < 1.0, 5.0, np.where(
        samples[:, TIME] < 1.5, 0.0, -5.0))
    values = {}
    for name in ('time_since_reversal', 'time_at_rest', 'since_reversal'):
        model = with_law(f'a * {name} + b * time_since_reversal', 'torque',
                         {'velocity': (-5.0, 5.0)}, a=1.0, b=1e-9)
        effort = effort_of_motion(samples.copy(), STEP, physics_of(model))
        values[name] = effort - effort_of_motion(samples.copy(), STEP, physics_of(MODEL))
    at = int(round(1.8 / STEP))
    assert values['time_since_reversal'][at] == pytest.approx(0.3, abs=0.01)
    assert values['time_since_reversal'][at - int(0.4 / STEP)] == pytest.approx(1.4, abs=0.01)
    assert values['time_at_rest'][at] == pytest.approx(0.5, abs=0.01)
