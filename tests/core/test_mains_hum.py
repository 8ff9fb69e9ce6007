# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Hum of the mains is taken out of a measured effort, and nothing that shakes the shaft."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.model import Model
from engb_core.recording import Recording
from engb_core.signals.data_faults import cleaned
from engb_core.signals.mains_hum import mains_hum

MODEL = Model()
INERTIA = MODEL.motor.inertia
NOISE = 2e-3


def moved(rate: float = 1000.0, duration: float = 20.0, seed: int = 1,
          shaking: float = 0.0) -> Recording:
    """Return a shaft that swings, and is shaken by a torque [N·m] of 50 Hz; its effort is what
    inertia and a spring need, with noise."""
    generator = np.random.default_rng(seed)
    time = np.arange(int(duration * rate)) / rate
    slow, fast = 2.0 * np.pi * 0.7, 2.0 * np.pi * 50.0
    shaken = -shaking / (INERTIA * fast ** 2) * np.sin(fast * time)
    position = 8.0 + 8.0 * np.sin(slow * time) + shaken
    acceleration = -8.0 * slow ** 2 * np.sin(slow * time) - fast ** 2 * shaken
    effort = INERTIA * acceleration + 0.01 * position
    counts = 2.0 * np.pi / 4096.0
    return Recording.from_samples(
        'run', time, np.round(position / counts) * counts,
        effort + NOISE * generator.standard_normal(time.size), None)


def humming(recording: Recording, amplitude: float = 0.03, frequency: float = 49.97) -> Recording:
    """Return a recording with hum in its effort, whose frequency wanders by 0.02 Hz."""
    phase = 2.0 * np.pi * frequency * recording.time + 0.6 * np.sin(0.2 * recording.time)
    hum = amplitude * (np.sin(phase + 0.4) + 0.3 * np.sin(3.0 * phase + 1.0))
    return replace(recording, effort=recording.effort + hum)


@pytest.mark.parametrize('rate', [1000.0, 400.0, 250.0])
def test_a_hum_is_taken_out_and_told(rate):
    quiet = moved(rate)
    loud = humming(quiet)
    clean, faults = cleaned(loud, MODEL)
    assert [entry.fault for entry in faults] == ['mains_hum']
    assert '50' in faults[0].statement or '49.9' in faults[0].statement
    left = clean.effort - quiet.effort
    assert np.sqrt(np.mean(left ** 2)) < 0.1 * np.sqrt(np.mean((loud.effort - quiet.effort) ** 2))


def test_sixty_hertz_and_missing_samples():
    loud = humming(moved(), frequency=60.02)
    kept = np.random.default_rng(2).random(loud.time.size) > 0.03
    kept[9000:9200] = False
    hum = mains_hum(replace(loud, time=loud.time[kept], position=loud.position[kept],
                            effort=loud.effort[kept]), INERTIA)
    assert hum is not None
    assert hum.frequency == pytest.approx(60.02, abs=0.06)
    assert hum.values.size == kept.sum()


def test_a_torque_that_shakes_the_shaft_is_no_hum():
    assert mains_hum(moved(shaking=0.03), INERTIA) is None


@pytest.mark.parametrize('rate', [1000.0, 100.0])
def test_noise_is_no_hum(rate):
    assert not any(mains_hum(moved(rate, 6.0, seed), INERTIA) for seed in range(40))


def test_a_short_recording_has_none():
    assert mains_hum(humming(moved(duration=2.0)), INERTIA) is None
