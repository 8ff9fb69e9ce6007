# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Model and measurement pass the same filter; standstill counts nothing; noise is known."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from engb_core.diagnose.problem import problem_of
from engb_core.model import Friction, LoadTorque, Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.recording import Recording
from engb_core.signals.filtering import (
    Comparison,
    comparison_of,
    judgeable,
    low_passed_noise,
    noise_of,
    turns_nowhere,
)
from engb_core.signals.motion import Motion, motion_of

from .bench import Bench, strokes

MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6)),
              friction=Friction(0.012, 0.11, 0.3))


def steady(noise: np.ndarray, rate: float = 1000.0) -> Recording:
    """A shaft at 20 rad/s with nothing but noise in its effort."""
    time = np.arange(noise.size) / rate
    return Recording.from_samples('run', time, 20.0 * time, noise)


def coloured(size: int, corner: float, rate: float, seed: int = 0) -> np.ndarray:
    """White noise of 0.01 through a first-order low-pass."""
    keep = np.exp(-2.0 * np.pi * corner / rate)
    white = np.random.default_rng(seed).normal(0.0, 0.01, size)
    values = np.empty(size)
    last = 0.0
    for index in range(size):
        last = keep * last + (1.0 - keep) * white[index]
        values[index] = last
    return values


@pytest.fixture(scope='module')
def recorded() -> Recording:
    return Bench().run(strokes())


@pytest.fixture(scope='module')
def motion(recorded) -> Motion:
    return motion_of(recorded)


@pytest.fixture(scope='module')
def comparison(motion) -> Comparison:
    return comparison_of(motion, 20.0, 0.3)


def test_the_filter_is_linear(comparison, motion):
    rng = np.random.default_rng(1)
    first, second = rng.normal(size=(2, motion.time.size))
    np.testing.assert_allclose(comparison(first - 2.0 * second),
                               comparison(first) - 2.0 * comparison(second), atol=1e-12)


def test_a_constant_stays_one(comparison, motion):
    np.testing.assert_allclose(comparison(np.full(motion.time.size, 0.7)), 0.7, rtol=1e-12)


def test_standstill_and_gaps_have_no_weight(recorded):
    keep = (recorded.time < 3.0) | (recorded.time > 3.1)
    motion = motion_of(Recording.from_samples('run', recorded.time[keep],
                                              recorded.position[keep], recorded.effort[keep]))
    comparison = comparison_of(motion, 20.0, 0.5)
    assert np.all(comparison.weight[np.abs(motion.velocity) < 0.5] == 0.0)
    assert np.all(comparison.weight[~motion.known] == 0.0)
    assert 0.2 < comparison.weight.mean() < 0.9
    # Whatever friction does at rest, no value that is compared may change.
    effort = motion.effort.copy()
    effort[comparison.weight == 0.0] += 5.0
    np.testing.assert_array_equal(comparison(effort), comparison(motion.effort))
    assert comparison.scale.min() > 0.35
    assert comparison.scale.max() <= 1.0 + 1e-12


def test_both_sides_alike(recorded, motion):
    """The true model needs the effort that was measured, even where the shaft turns round.

    A filter on one side only would leave a residual that follows friction near reversals: it
    would pass for Stribeck friction.
    """
    effort = effort_of_motion(motion.samples(), motion.step, physics_of(MODEL))
    comparison = comparison_of(motion, 20.0, 0.6)
    residual = comparison(motion.effort) - comparison(effort)
    signal = np.std(comparison(motion.effort))
    assert np.sqrt(np.mean(residual ** 2)) < 0.03 * signal
    velocity = motion.velocity[comparison.grid]
    for low, high in ((0.6, 3.0), (3.0, 10.0), (10.0, 100.0)):
        zone = (np.abs(velocity) > low) & (np.abs(velocity) < high)
        assert zone.sum() > 20
        assert abs(np.mean(residual[zone] * np.sign(velocity[zone]))) < 0.05 * 0.012


@pytest.mark.parametrize('level', [1e-4, 3e-3, 0.1])
def test_white_noise_is_measured(level):
    time = np.arange(8000) / 1000.0
    noise = np.random.default_rng(2).normal(0.0, level, time.size)
    signal = 0.2 * np.sin(2.0 * np.pi * time) + 0.1 * np.sign(np.sin(2.0 * np.pi * time))
    assert noise_of(signal + noise) == pytest.approx(level, rel=0.06)


@pytest.mark.parametrize('rate', [500.0, 1000.0, 4000.0])
@pytest.mark.parametrize('bandwidth', [8.0, 20.0])
def test_what_the_filter_leaves_of_white_noise(rate, bandwidth):
    noise = np.random.default_rng(5).normal(0.0, 0.01, int(40 * rate))
    motion = motion_of(steady(noise, rate))
    comparison = comparison_of(motion, bandwidth, 1.0)
    inside = slice(10, -10)
    np.testing.assert_allclose(comparison.scale[inside], 1.0, rtol=1e-6)
    left = np.std(comparison(motion.effort)[inside])
    assert left == pytest.approx(0.01 * comparison.noise_gain_whole, rel=0.08)


@pytest.mark.parametrize('corner', [5.0, 50.0])
def test_coloured_noise_is_measured_where_the_shaft_stands(corner):
    """A white-noise guess would be wrong by factors; standstill shows the noise in the band."""
    rate, size = 1000.0, 30_000
    noise = coloured(size, corner, rate)
    time = np.arange(size) / rate
    position = np.where(time < 15.0, 10.0, 10.0 + 5.0 * (time - 15.0))
    motion = motion_of(Recording.from_samples('run', time, position, 0.1 + noise))
    comparison = comparison_of(motion, 20.0, 1.0)
    stride = max(1, round(0.8 / 20.0 / motion.step))
    found = low_passed_noise(motion, comparison, stride)
    true = np.std(comparison(motion.effort)[10:-10])
    assert found is not None
    # Second differences over 40 ms see all of the noise above the band's lower edge, and less
    # of what is slower than that.
    assert 0.55 * true < found < 1.25 * true
    white = noise_of(0.1 + noise) * comparison.noise_gain_whole
    assert abs(found / true - 1.0) < abs(white / true - 1.0)


def test_no_standstill_no_measurement():
    motion = motion_of(steady(np.random.default_rng(6).normal(0.0, 0.01, 5000)))
    comparison = comparison_of(motion, 20.0, 1.0)
    assert low_passed_noise(motion, comparison, 20) is None


@cache
def rotor(step: float, duration: float = 30.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, torque and position of a rotor shaken by a torque up to 30 Hz, as on a dynamometer: it
    never stands."""
    time = np.arange(int(duration / step)) * step
    random = np.random.default_rng(3)
    torque = np.zeros(time.size)
    for frequency in np.arange(0.3, 30.0, 0.31):
        torque += 0.02 * np.sin(2.0 * np.pi * (frequency * time + random.uniform()))
    velocity, speed = np.empty(time.size), 0.0
    for index, drive in enumerate(torque):
        speed += step / 4e-4 * (drive - 0.007 * speed - 0.03 * np.tanh(speed / 0.02))
        velocity[index] = speed
    return time, torque, np.round(np.cumsum(velocity) * step / 4e-4) * 4e-4


def shaken(late: float, noise: float, rate: float) -> Recording:
    """That rotor, its torque recorded so much before it acts [s]."""
    step = 2e-4
    time, torque, position = rotor(step)
    rows = np.arange(0, time.size, int(round(1.0 / rate / step)))
    ahead = np.minimum(rows + int(round(late / step)), time.size - 1)
    white = np.random.default_rng(4).normal(0.0, noise, rows.size)
    return Recording.from_samples('shaken', time[rows], position[rows], torque[ahead] + white)


@pytest.mark.parametrize('rate', [100.0, 250.0, 1000.0])
@pytest.mark.parametrize('late', [0.0, 0.004])
def test_physics_above_the_band_is_no_noise(late, rate):
    """A rotor that is shaken without a pause shows what the model lacks above the band as well: it
    was taken for noise, five times as much as there is."""
    model = Model(motor=replace(Model().motor, inertia=4e-4, viscous_friction=0.007),
                  load_torque=LoadTorque(coefficients=(0.0,)), friction=Friction(0.03, 0.0, 0.02))
    found = problem_of([shaken(late, 0.01, rate)], model).noise_floor
    run = problem_of([shaken(0.0, 0.01, rate)], model).runs[0]
    left_by_the_truth = run.measured - run.predicted(physics_of(model))
    assert found == pytest.approx(float(np.std(left_by_the_truth)), rel=0.35)


def test_the_noise_floor_of_a_problem(recorded):
    """What a diagnosis calls noise is what the true model leaves."""
    problem = problem_of([recorded], MODEL)
    run = problem.runs[0]
    residual = run.measured - run.predicted(physics_of(MODEL))
    assert np.median(np.abs(residual)) * 1.4826 == pytest.approx(problem.noise_floor, rel=0.5)
    assert 0.7 < run.fitted.mean() < 0.9


def test_a_turn_before_a_stop_belongs_to_the_stop(motion):
    """Friction changes its sign there: what comes late of it is not judged by one half."""
    step, slowest, before_stop = motion.step, 0.2, 0.008
    time = np.arange(motion.time.size) * step
    # It turns back slowly at 1.001 s, between two samples, and stands from 1.009 s on.
    velocity = np.interp(time, [0.0, 0.981, 1.001, 1.003, 1.007, 1.009, 1.5],
                         [20.0, 20.0, 0.0, -0.6, -0.6, 0.0, 0.0])
    turned = replace(motion, velocity=velocity, known=np.ones(time.size, bool))
    judged = judgeable(turned, slowest, before_stop)
    turn = int(np.argmax(velocity <= 0.0))
    stands = int(np.argmax(time >= 1.009))
    assert not judged[turn - int(round((before_stop + 0.004) / step)):stands].any()
    # The first half second of a recording that begins in motion is not judged either.
    assert judged[int(0.6 / step):int(0.95 / step)].all()
    # Of a turn that does not lead to a stop everything is judged.
    swinging = replace(turned, velocity=20.0 * np.cos(2.0 * np.pi * (time + 0.25 * step)))
    assert judgeable(swinging, 1e-9, before_stop)[int(0.6 / step):].all()


def test_a_shaft_that_creeps_to_and_fro_does_not_rest():
    """Its friction turns with it: most of that would pass for noise."""
    rate, noise = 500.0, np.random.default_rng(7).normal(0.0, 0.002, 20_000)
    time = np.arange(noise.size) / rate
    # Strokes, with pauses between them in which a hand wavers by some ten counts.
    phase = time % 4.0
    moves = np.where(phase < 2.0, 10.0 * np.sin(np.pi * phase), 0.0)
    wavers = np.where(phase >= 2.0, 0.012 * np.sin(2.0 * np.pi * 5.0 * time), 0.0)
    count = 2.0 * np.pi / 8192
    position = count * np.round((np.cumsum(moves) / rate + wavers) / count)
    rubs = 0.02 * np.sign(moves + 0.012 * 2.0 * np.pi * 5.0 * np.cos(2.0 * np.pi * 5.0 * time)
                          * (phase >= 2.0))
    recording = Recording.from_samples('hand', time, position, rubs + noise)
    motion = motion_of(recording)
    comparison = comparison_of(motion, 20.0, 1.0)
    stride = max(1, round(0.8 / 20.0 / motion.step))
    true = 0.002 * comparison.noise_gain_whole
    assert low_passed_noise(motion, comparison, stride) > 2.0 * true
    turns = turns_nowhere(recording, motion, comparison, stride, 2.0 * count)
    assert low_passed_noise(motion, comparison, stride, turns) is None
    still = replace(recording, position=count * np.round(np.cumsum(moves) / rate / count))
    rests = turns_nowhere(still, motion_of(still), comparison, stride, 2.0 * count)
    assert rests[phase > 2.5].mean() > 0.8
