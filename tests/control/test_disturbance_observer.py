# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The observer: sign of (30), its low-pass, uneven samples, offline equal to live."""

import math

import numpy as np
import pytest

from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.errors import InputError
from engb_core.model import Motor

MOTOR = Motor(inertia=1e-4, viscous_friction=1e-3)


def run(disturbance, duration=2.0, dt=1e-3, jitter=0.0, **options):
    """Return time and estimate while J·ω̇ + B·ω = u + d with a lively u."""
    rng = np.random.default_rng(1)
    time = np.cumsum(dt * (1.0 + jitter * rng.uniform(-0.9, 0.9, round(duration / dt))))
    velocity, omega, effort = np.empty_like(time), 0.0, np.empty_like(time)
    last = 0.0
    for index, now in enumerate(time):
        for _ in range(50):
            h = (now - last) / 50
            u = 0.05 * math.sin(3.0 * now)
            d = disturbance(now)
            omega += h * (u + d - MOTOR.viscous_friction * omega) / MOTOR.inertia
        velocity[index], effort[index], last = omega, u, now
    return time, DisturbanceObserver(MOTOR, **options).filter(time, velocity, effort)


@pytest.mark.parametrize('order', [1, 2])
@pytest.mark.parametrize('jitter', [0.0, 1.0])
def test_it_finds_a_constant_disturbance_with_the_sign_of_equation_30(order, jitter):
    time, estimate = run(lambda time: -0.03, order=order, jitter=jitter)
    assert np.allclose(estimate[time > 0.5], -0.03, atol=3e-4)


@pytest.mark.parametrize('order', [1, 2])
def test_a_sine_at_the_cutoff_comes_out_at_minus_3_db(order):
    time, estimate = run(lambda time: 0.1 * math.sin(2.0 * math.pi * 5.0 * time), 3.0,
                         cutoff=5.0, order=order)
    late = estimate[time > 1.5]
    assert np.sqrt(2.0) * late.std() == pytest.approx(0.1 / math.sqrt(2.0), rel=0.02)


def test_offline_is_live_sample_for_sample():
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.uniform(5e-4, 2e-3, 500))
    velocity, effort = rng.normal(size=(2, 500))
    live = DisturbanceObserver(MOTOR)
    one_by_one = [live.step(*sample) for sample in zip(time, velocity, effort, strict=True)]
    assert np.array_equal(one_by_one, DisturbanceObserver(MOTOR).filter(time, velocity, effort))


def test_bad_samples_are_left_out_and_the_estimate_is_held():
    observer = DisturbanceObserver(MOTOR)
    observer.step(0.0, 1.0, 0.1)
    held = observer.step(0.001, 1.0, 0.1)
    for sample in ((0.002, math.nan, 0.1), (0.002, 1.0, math.inf), (0.001, 5.0, 5.0)):
        assert observer.step(*sample) == held
    assert observer.rejected == 3
    assert math.isfinite(observer.step(0.002, 1.0, 0.1))


def test_a_gap_starts_it_anew():
    observer = DisturbanceObserver(MOTOR)
    observer.step(0.0, 100.0, 0.0)
    observer.step(0.001, 100.0, 0.0)
    assert observer.step(10.0, 0.0, 0.2) == pytest.approx(-0.2)


def test_bad_settings_are_refused():
    with pytest.raises(InputError, match='order'):
        DisturbanceObserver(MOTOR, order=3)
    with pytest.raises(InputError, match='cutoff'):
        DisturbanceObserver(MOTOR, cutoff=0.0)
