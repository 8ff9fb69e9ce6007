# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Motion that starts and stops within milliseconds: a sharp one tells when, a smooth one less."""

from __future__ import annotations

import numpy as np
import pytest

from engb_core.recording import Recording
from engb_core.signals.gaussian import filtered, gaussian_kernel
from engb_core.signals.motion import Motion, motion_of
from engb_core.signals.sharp_motion import MOST_SAMPLES, sharp_motion_of

COUNT = 2.0 * np.pi / 8192.0
RATE_OF_SPEED = 80.0    # rad/s²


def jerked(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity: a start and a stop every second, to and fro."""
    within = np.mod(time, 1.0) - 0.2
    sense = np.where(np.mod(np.floor(time), 2.0) == 0.0, 1.0, -1.0)
    speed = RATE_OF_SPEED * np.clip(np.minimum(within, 0.5 - within), 0.0, None)
    velocity = sense * speed
    return np.concatenate([[0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1])
                                            * np.diff(time))]), velocity


def recorded(rate: float, duration: float = 20.0) -> tuple[Recording, np.ndarray, np.ndarray]:
    """The recording, and time and velocity on a fine grid."""
    fine = np.arange(0.0, duration, 1e-4)
    position, velocity = jerked(fine)
    time = np.arange(int(duration * rate)) / rate
    counts = np.round(np.interp(time, fine, position) / COUNT) * COUNT
    return Recording.from_samples('run', time, counts, np.zeros_like(time)), fine, velocity


def missed(motion: Motion, fine: np.ndarray, true: np.ndarray) -> float:
    """Return how wrong the low-passed effort is that a motor against friction is said to need."""
    def effort(velocity: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        return 7e-5 * acceleration + 0.014 * np.clip(velocity / 0.05, -1.0, 1.0)

    said = np.interp(fine, motion.time, effort(motion.velocity, motion.acceleration))
    moving = np.abs(true) > 0.3
    wrong = np.where(moving, said - effort(true, np.gradient(true, 1e-4)), 0.0)
    return float(np.sqrt(np.mean(filtered(wrong, gaussian_kernel(20.0, 1e-4))[moving] ** 2)))


@pytest.mark.parametrize('rate', [500.0, 1000.0, 2000.0])
def test_starts_and_stops_are_told_sharper(rate):
    recording, fine, velocity = recorded(rate)
    sharp, smooth = sharp_motion_of(recording), motion_of(recording, 60.0)
    assert sharp.step == pytest.approx(2.5e-4)
    assert missed(sharp, fine, velocity) < missed(smooth, fine, velocity)


def test_acceleration_is_that_of_the_motion():
    recording, fine, velocity = recorded(1000.0)
    motion = sharp_motion_of(recording)
    speeding = (np.mod(motion.time, 1.0) > 0.23) & (np.mod(motion.time, 1.0) < 0.42)
    sense = np.where(np.mod(np.floor(motion.time), 2.0) == 0.0, 1.0, -1.0)
    assert np.mean((sense * motion.acceleration)[speeding]) == pytest.approx(RATE_OF_SPEED, 0.01)


@pytest.mark.parametrize('rate', [100.0, 250.0])
def test_slow_samples_tell_the_torque_of_a_fast_motion(rate):
    """Straight lines between the samples, and a corner far below half the sampling rate, had taken
    a tenth of it away."""
    time = np.arange(int(8.0 * rate)) / rate
    angular = 2.0 * np.pi * 0.15 * rate
    position = np.round(0.4 * np.sin(angular * time) / COUNT) * COUNT
    recording = Recording.from_samples('run', time, position, 3.0 * np.sin(angular * time))
    motion = sharp_motion_of(recording)
    inside = (motion.time > 1.0) & (motion.time < 7.0)
    wave = np.sin(angular * motion.time[inside])

    def amplitude(values: np.ndarray) -> float:
        return float(wave @ values[inside] / (wave @ wave))

    assert amplitude(motion.acceleration) == pytest.approx(-0.4 * angular ** 2, rel=0.02)
    assert amplitude(motion.effort) == pytest.approx(3.0, rel=0.02)


def test_a_shaft_that_stands_does_not_move():
    recording, _, _ = recorded(1000.0)
    motion = sharp_motion_of(recording)
    standing = (np.mod(motion.time, 1.0) > 0.75) & (np.mod(motion.time, 1.0) < 0.95)
    assert np.abs(motion.velocity[standing]).max() < 0.01


def test_a_coarser_grid_on_demand_and_for_very_long_recordings():
    recording, _, _ = recorded(1000.0)
    assert sharp_motion_of(recording, step=1e-3).step == pytest.approx(1e-3)
    assert sharp_motion_of(recording, step=1.0).step == pytest.approx(1e-3)
    time = np.arange(MOST_SAMPLES // 3) * 1e-3
    long = Recording.from_samples('long', time, np.sin(time), np.zeros_like(time))
    assert sharp_motion_of(long).time.size <= MOST_SAMPLES
