# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Disc speed and pad temperature come without the noise of their sensors; nothing else goes."""

import numpy as np
import pytest

from engb_core.recording import Recording, Signal
from engb_core.signals.motion import motion_of
from engb_core.signals.side_signals import without_noise


def stopping(time):
    """Return the speed of a disc that is braked to rest, and let go again [rad/s]."""
    return np.maximum(np.abs(time - 6.0) - 1.0, 0.0) * 6.0


def noisy(values, deviation=0.15):
    return values + deviation * np.random.default_rng(3).standard_normal(values.size)


@pytest.mark.parametrize('interval', [0.01, 0.05])
def test_most_of_the_noise_is_gone(interval):
    time = np.arange(0.0, 12.0, interval)
    truth = stopping(time)
    left = without_noise(Signal(time, noisy(truth))) - truth
    assert np.sqrt(np.mean(left ** 2)) < 0.5 * 0.15
    # Where it comes to rest, too.
    assert np.max(np.abs(left)) < 3.0 * 0.15


@pytest.mark.parametrize('values', [
    stopping(np.arange(0.0, 12.0, 0.01)), np.zeros(1200), np.full(1200, 90.0),
    np.where(np.arange(1200) < 500, 20.0, 45.0)])
def test_a_signal_without_noise_stays_as_it_is(values):
    signal = Signal(np.arange(values.size) * 0.01, values)
    assert np.array_equal(without_noise(signal), values)


@pytest.mark.parametrize('count', [0, 1, 2, 3, 5])
def test_few_values_are_no_signal_to_smooth(count):
    signal = Signal(np.arange(count) * 0.01, np.arange(count) % 2 * 1.0)
    assert without_noise(signal).size == count


def test_nothing_is_smoothed_across_a_pause():
    """While nothing was recorded the disc was stopped."""
    before, after = np.arange(0.0, 5.0, 0.01), np.arange(9.0, 14.0, 0.01)
    truth = np.concatenate([np.full(before.size, 40.0), np.zeros(after.size)])
    left = without_noise(Signal(np.concatenate([before, after]), noisy(truth))) - truth
    assert np.max(np.abs(left)) < 3.0 * 0.15


def test_a_motion_has_them_without_noise():
    time = np.arange(0.0, 12.0, 0.004)
    of_disc = np.arange(0.0, 12.0, 0.02)
    angle = 5.0 * np.sin(time)
    recording = Recording.from_samples('run', time, angle, 0.1 * np.cos(time), signals={
        'disc_speed': Signal(of_disc, noisy(stopping(of_disc))),
        'pad_temperature': Signal(of_disc, noisy(100.0 + of_disc, 1.0))})
    motion = motion_of(recording)
    assert np.std(motion.disc_speed - stopping(motion.time)) < 0.5 * 0.15
    assert np.std(motion.pad_temperature - 100.0 - motion.time) < 0.5
