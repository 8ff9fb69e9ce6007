# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Identification against an independent bench (Runge-Kutta, tests only)."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.control.feedforward import Feedforward
from engb_core.control.reference import ReferenceSettings
from engb_core.errors import InputError
from engb_core.identify.procedure import identify
from engb_core.model import Cogging, Friction, LoadTorque, Model
from engb_core.recording import Recording
from engb_core.reproduce.in_process import run_experiment
from engb_core.reproduce.plan import STROKES

from .bench import PAPER, simulate, stroke_reference


def true_load(theta, truth=PAPER):
    s = theta if truth['contact'] is None else np.maximum(theta - truth['contact'], 0.0)
    return np.polynomial.polynomial.polyval(s, truth['load'])


@pytest.fixture(scope='module')
def found():
    return identify([simulate(stroke_reference(count=3))])


def test_papers_numbers_are_found(found):
    theta = np.linspace(0.5, 19.5, 50)
    assert np.abs(found.load_torque(theta) - true_load(theta)).max() < 1.5e-3
    friction = 0.012 + 0.11 * true_load(theta)
    assert np.abs(found.friction_torque(theta, 10.0) - friction).max() < 1e-3
    assert found.friction_torque(theta, -10.0) == pytest.approx(-found.friction_torque(theta, 10))
    model = found.model
    assert model.motor.inertia == pytest.approx(6.813e-5, rel=0.06)
    assert model.motor.viscous_friction == pytest.approx(1.125e-3, rel=0.02)
    assert model.friction.saturation_velocity == pytest.approx(1.5, rel=0.06)
    assert model.load_torque.contact_angle is None
    assert model.cogging == ()


def test_the_regression_fits_the_torque_of_the_model(found):
    theta = np.linspace(-1.0, 21.0, 60)
    load, _ = found.regression.load(theta)
    np.testing.assert_allclose(load, found.load_torque(theta), atol=1e-12)


def test_waves_of_one_order_are_one(found):
    """A hundred of them had taken minutes; none tells the recording more than their sum."""
    recording = simulate(stroke_reference(count=3))
    wave = Cogging(12.0, 1e-5, 0.3)
    once, often = (identify([recording], replace(found.start, cogging=waves)) for waves in (
        (replace(wave, amplitude=1e-3),), 100 * (wave,)))
    assert [entry.order for entry in often.model.cogging] == [12.0]
    assert often.estimates['inertia'].value == pytest.approx(once.estimates['inertia'].value)


def test_more_orders_than_can_be_identified_are_refused(found):
    waves = tuple(Cogging(float(order), 1e-5, 0.0) for order in range(1, 32))
    with pytest.raises(InputError, match='cogging of 31 orders; at most 30'):
        identify([simulate(stroke_reference(count=3))], replace(found.start, cogging=waves))


def test_papers_way_is_near_too(found):
    assert found.paper.friction.coulomb == pytest.approx(0.012, rel=0.2)
    assert found.paper.friction.load_gain == pytest.approx(0.11, rel=0.2)
    theta = np.linspace(1, 19, 30)
    assert np.abs(found.paper.load.torque(theta) - true_load(theta)).max() < 5e-3


def test_summary_names_every_number(found):
    text = found.summary()
    for word in ('inertia', 'viscous_friction', 'p3', 'coulomb', 'load_gain', '95 %', 'strokes'):
        assert word in text


def test_intervals_hold_the_truth():
    truth = {'inertia': 6.813e-5, 'viscous_friction': 1.125e-3, 'coulomb': 0.012,
             'load_gain': 0.11, 'saturation_velocity': 1.5, 'p1': 1e-3, 'p2': 2e-4, 'p3': 5e-6}
    inside = total = 0
    for seed in range(6):
        recording = simulate(stroke_reference(count=2, top=18.0 + seed), seed=seed)
        estimates = identify([recording]).estimates
        for name, value in truth.items():
            low, high = estimates[name].interval(0.99)
            inside += low <= value <= high
            total += 1
    assert inside / total > 0.9


def test_contact_angle_is_found_only_where_there_is_one():
    truth = {'contact': 6.0, 'load': (0.0, 2e-3, 8e-4, 0.0)}
    found = identify([simulate(stroke_reference(count=2), truth)])
    assert found.model.load_torque.contact_angle == pytest.approx(6.0, abs=0.4)
    theta = np.linspace(0.5, 19.5, 40)
    expected = true_load(theta, PAPER | truth)
    assert np.abs(found.load_torque(theta) - expected).max() < 2e-3


def test_cogging_order_amplitude_and_phase_are_found():
    truth = {'cogging': ((7, 4e-3, 0.6),), 'load': (0.0,) * 4, 'gain': 0.0}
    slow = stroke_reference(top=12.0, acceleration=2.0, count=1)
    found = identify([simulate(slow, truth)])
    assert [wave.order for wave in found.model.cogging] == [7.0]
    assert found.model.cogging[0].amplitude == pytest.approx(4e-3, rel=0.1)
    assert found.model.cogging[0].phase == pytest.approx(0.6, abs=0.15)


def test_damaged_recording_gives_the_same_numbers():
    clean = simulate(stroke_reference(count=3))
    keep = np.ones(clean.time.size, bool)
    keep[::7] = False
    keep[2500:2540] = False
    keep[4000:4600] = False
    jitter = np.random.default_rng(1).uniform(0, 2e-4, keep.sum())
    theta = clean.position[keep] + jitter * np.gradient(clean.position, clean.time)[keep]
    damaged = Recording.from_samples('damaged', clean.time[keep] + jitter, theta,
                                     clean.effort[keep])
    found = identify([damaged])
    assert found.model.friction.load_gain == pytest.approx(0.11, rel=0.08)
    grid = np.linspace(1, 19, 20)
    assert np.abs(found.load_torque(grid) - true_load(grid)).max() < 2e-3


def test_what_cannot_be_determined_is_kept_from_the_start_model():
    # So gentle a stroke that the inertia's torque is far below the noise.
    slow = simulate(stroke_reference(top=20.0, acceleration=1.0, count=1), noise=0.02)
    start = Model(friction=Friction(0.0, 0.0, 0.7))
    found = identify([slow], start)
    assert found.model.motor.inertia == start.motor.inertia
    assert not found.estimates['inertia'].determined
    assert 'start model' in found.summary()


@pytest.mark.parametrize('motion', ['rest', 'one way'])
def test_recording_without_strokes_is_refused(motion):
    time = np.arange(3000) * 1e-3
    position = np.zeros_like(time) if motion == 'rest' else 5.0 * time
    with pytest.raises(InputError, match='strokes'):
        identify([Recording.from_samples('bare', time, position, 0.01 * np.ones_like(time))])


def test_strokes_that_meet_no_load_are_told():
    """A bench that moves to and fro is no brake: its load friction came out as 3.6 ± 2."""
    found = identify([simulate(stroke_reference(count=2), {'load': (0.0, 0.0, 0.0, 0.0)})])
    assert not found.load_seen
    assert found.model.friction.load_gain == 0.0
    assert np.ptp(found.load_torque(np.linspace(0.0, 20.0, 50))) == 0.0
    assert found.model.friction.coulomb == pytest.approx(PAPER['coulomb'], rel=0.1)
    told = found.summary()
    assert 'no load torque stands out' in told and 'engb model' in told


def test_a_load_that_pulls_both_ways_is_told():
    """A weight on an arm that swings: a cubic fits it, and nothing said that this is no clamp."""
    time = np.arange(6000) * 1e-3
    position = 3.0 * np.sin(2 * np.pi * 0.7 * time) + np.sin(2 * np.pi * 2.3 * time)
    velocity = np.gradient(position, time)
    load = 0.03 * np.sin(position)
    effort = (6.8e-5 * np.gradient(velocity, time) + 1.1e-3 * velocity + load
              + (0.012 + 0.1 * np.abs(load)) * np.clip(velocity / 0.5, -1.0, 1.0)
              + np.random.default_rng(1).normal(0.0, 1e-3, time.size))
    found = identify([Recording.from_samples('arm', time, position, effort)])
    assert found.load_seen and found.pulls_both_ways
    assert 'no clamp strokes' in found.summary() and 'engb model' in found.summary()
    clamp = identify([simulate(stroke_reference(count=2))])
    assert not clamp.pulls_both_ways
    assert 'no clamp strokes' not in clamp.summary()


def test_no_recording_is_refused():
    with pytest.raises(InputError):
        identify([])


def test_demo_like_recording_with_contact_and_cogging():
    """Slow unloaded strokes, three amplitudes, contact, cogging: what the nodes record."""
    truth = {'contact': 4.0, 'load': (0.0, 3e-3, 1.2e-4, 2e-6), 'coulomb': 0.014,
             'saturation': 0.3, 'cogging': ((12, 4e-3, 0.7),)}
    trajectory = ReferenceSettings(kind='strokes').trajectory()
    reference = trajectory.sample(np.arange(0.0, trajectory.duration, 1e-3))
    found = identify([simulate(reference, truth, noise=2e-3, counts=8192, limit=0.75,
                               gains=(0.4, 1.5, 0.006))])
    theta = np.linspace(0.5, 35.0, 60)
    assert np.abs(found.load_torque(theta) - true_load(theta, PAPER | truth)).max() < 1e-3
    assert found.model.load_torque.contact_angle == pytest.approx(4.0, abs=0.15)
    assert found.model.friction.load_gain == pytest.approx(0.11, rel=0.02)
    assert found.model.friction.coulomb == pytest.approx(0.014, rel=0.02)
    assert found.model.motor.inertia == pytest.approx(6.813e-5, rel=0.03)
    wave, = found.model.cogging
    assert (wave.order, wave.amplitude) == (12.0, pytest.approx(4e-3, rel=0.05))


def test_torques_are_those_of_the_plant(found):
    feedforward = Feedforward(found.model)
    for theta, omega in ((3.0, 0.2), (15.0, -40.0), (19.0, 0.0)):
        load = feedforward.load_torque(theta)
        assert found.load_torque(theta) == pytest.approx(load)
        assert found.friction_torque(theta, omega) == pytest.approx(
            feedforward.friction_torque(load, omega))


def test_a_missed_contact_leaves_no_line_behind():
    """The demo's brake and strokes on the package's own plant: one line of cogging, no more."""
    brake = Model(load_torque=LoadTorque(coefficients=(0.0, 3e-3, 1.2e-4, 2e-6),
                                         contact_angle=4.0),
                  friction=Friction(0.014, 0.11, 0.3), cogging=(Cogging(12.0, 4e-3, 0.7),))
    reference = ReferenceSettings(kind='strokes')
    experiment = replace(STROKES, brake=brake,
                         reference=reference, duration=reference.trajectory().duration + 0.3)
    found = identify([run_experiment(experiment, Model())])
    assert [wave.order for wave in found.model.cogging] == [12.0]
    assert found.model.load_torque.contact_angle == pytest.approx(4.0, abs=0.15)
