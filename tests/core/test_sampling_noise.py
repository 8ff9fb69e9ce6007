# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a log's stamps and its encoder's noise do to the positions is told from the positions."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.problem import problem_of
from engb_core.model import Friction, LoadTorque, Model
from engb_core.physics.plant import physics_of
from engb_core.recording import Recording
from engb_core.signals.sampling_noise import sampling_noise
from tests.core.bench import Bench, strokes

MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6)),
              friction=Friction(0.012, 0.11, 0.03))
RATE, COUNT = 250.0, 2.0 * np.pi / 4096


def swing(jitter: float, white: float = 0.0, count: float = COUNT, seed: int = 1) -> Recording:
    """Return 20 s of a swing whose samples are taken `jitter` [s] off their stamps."""
    random = np.random.default_rng(seed)
    time = np.arange(0.0, 20.0, 1.0 / RATE)
    taken = time + jitter * random.standard_normal(time.size)
    position = (1.3 * np.sin(2.0 * np.pi * 0.7 * taken) + 0.3 * np.sin(2.0 * np.pi * 2.1 * taken)
                + white * random.standard_normal(time.size))
    return Recording(name='swing', time=time, position=count * np.round(position / count),
                     effort=np.zeros(time.size))


@pytest.mark.parametrize('jitter', [2e-4, 1e-3])
def test_the_time_of_sampling_is_told(jitter):
    assert sampling_noise(swing(jitter)).jitter == pytest.approx(jitter, rel=0.15)


def test_good_stamps_have_none():
    found = sampling_noise(swing(0.0))
    assert found.jitter < 5e-5
    assert found.white == pytest.approx(COUNT / np.sqrt(12.0), rel=0.3)


def test_noise_of_the_encoder_is_no_jitter():
    found = sampling_noise(swing(0.0, white=5e-3))
    assert found.white == pytest.approx(5e-3, rel=0.15)
    assert found.jitter < 2e-4


def test_jitter_that_the_stamps_tell_is_none():
    """The stamps are those of the samples, only not even."""
    random = np.random.default_rng(3)
    time = np.arange(0.0, 20.0, 1.0 / RATE)
    time = time + 4e-4 * random.uniform(-1.0, 1.0, time.size)
    position = 1.3 * np.sin(2.0 * np.pi * 0.7 * time)
    recording = Recording(name='swing', time=time, position=COUNT * np.round(position / COUNT),
                          effort=np.zeros(time.size))
    assert sampling_noise(recording).jitter < 5e-5


def test_too_short_a_recording_says_nothing():
    whole = swing(1e-3)
    found = sampling_noise(replace(whole, time=whole.time[:50], position=whole.position[:50],
                                   effort=whole.effort[:50]))
    assert found.white == found.jitter == 0.0


def test_samples_taken_off_their_stamps_are_no_mismatch():
    """A host that polls a drive reads it up to a quarter of a sample off the stamps."""
    excess = []
    whole = Bench(noise=1e-3).run(strokes(), rate=500.0)
    for seed in range(5):
        taken = whole.time + 4e-4 * np.random.default_rng(seed).standard_normal(whole.time.size)
        polled = replace(whole, position=np.interp(taken, whole.time, whole.position))
        (run,) = problem_of([polled], MODEL).runs
        squares = (run.measured - run.predicted(physics_of(MODEL))) ** 2
        moving = run.counts > np.median(run.counts)
        effort = np.maximum(run.sigma ** 2 - run.counts ** 2, 1e-30)
        excess.append((np.mean((squares / effort)[moving]),
                       np.mean((squares / run.sigma ** 2)[moving])))
    without, with_times = np.mean(excess, axis=0)
    assert without > 2.0
    assert 0.5 < with_times < 1.5
