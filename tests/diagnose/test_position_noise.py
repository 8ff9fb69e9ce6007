# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What encoder counts do to the effort is noise; a recording may end in motion."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from engb_core.diagnose.problem import problem_of
from engb_core.model import Friction, LoadTorque, Model, Motor
from engb_core.physics.plant import physics_of
from engb_core.recording import Recording
from engb_core.signals.motion import motion_of
from engb_core.signals.motion_band import count_of
from tests.core.bench import Bench, strokes

from .simulated_brake import lively, NOMINAL

MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6)),
              friction=Friction(0.012, 0.11, 0.03))


def reduced_chi_square(counts: int, interval: int) -> tuple[float, float]:
    """Return the mean squared residual of the true model over the noise's, with what the counts
    do and without, of a recording with every `interval`-th sample."""
    whole = Bench(counts=counts, noise=1e-3).run(strokes(), rate=500.0)
    recording = Recording.from_samples('run', whole.time[::interval], whole.position[::interval],
                                       whole.effort[::interval])
    (run,) = problem_of([recording], MODEL).runs
    squares = (run.measured - run.predicted(physics_of(MODEL))) ** 2
    without = np.sqrt(np.maximum(run.sigma ** 2 - run.counts ** 2, 1e-30))
    return float(np.mean(squares / run.sigma ** 2)), float(np.mean(squares / without ** 2))


@pytest.mark.parametrize(('counts', 'interval'), [(500, 1), (1000, 2), (1000, 4)])
def test_coarse_counts_are_no_mismatch(counts, interval):
    with_counts, without = reduced_chi_square(counts, interval)
    assert with_counts < 1.5
    assert with_counts < without


def test_an_encoder_without_counts_adds_nothing():
    recording = Bench(counts=10 ** 9, noise=1e-3).run(strokes())
    smooth = replace(recording, position=recording.position
                     + 1e-4 * np.linspace(0.0, 1.0, recording.time.size))
    (fine,) = problem_of([smooth], MODEL).runs
    (coarse,) = problem_of([replace(recording, position=0.05 * np.round(
        recording.position / 0.05))], MODEL).runs
    assert np.sqrt(np.mean(fine.counts ** 2)) < 0.2 * np.sqrt(np.mean(coarse.counts ** 2))


def test_counts_that_pass_by_dozens_make_no_more_noise_than_they_are():
    """Of a joint behind a gear the smallest usual step is many counts; written with few digits
    they differ."""
    count = 2.0 * np.pi / 800_000
    recording = Bench(counts=800_000, noise=1e-3).run(strokes())
    noise = []
    for shown in (1.0, 1e-7, 5.0 * count):
        given = replace(recording, position=shown * np.round(recording.position / shown)
                        if shown < 1.0 else recording.position)
        noise.append(problem_of([given], MODEL).runs[0].counts)
    exact, rounded, coarser = (float(np.sqrt(np.mean(values ** 2))) for values in noise)
    assert rounded == pytest.approx(exact, rel=0.1)
    assert exact < 0.5 * coarser


def test_a_count_is_told_of_moves_at_one_speed():
    """Most of their steps are alike, and look like counts."""
    count = 2e-4
    steps = np.concatenate([np.full(2000, 31.3), np.linspace(31.0, 60.0, 700)]) * count
    position = count * np.floor(np.cumsum(np.concatenate([steps, -steps])) / count)
    assert count_of(position) == pytest.approx(count)
    assert count_of(np.round(position, 5)) == pytest.approx(count, rel=0.02)


def test_a_count_is_told_of_one_speed_to_and_fro():
    """All of its steps are 9 or 10 counts: both are near to the smaller one."""
    count = 2.0 * np.pi / 16384.0
    steps = np.concatenate([np.full(6000, 9.43), np.full(3000, -9.38)])
    position = count * np.floor(np.cumsum(steps))
    assert count_of(position) == pytest.approx(count)
    assert count_of(np.deg2rad(np.round(np.rad2deg(position), 2))) < 1.2 * count


@pytest.mark.parametrize('interval', [1, 5])
def test_a_recording_that_ends_in_motion_does_not_stop_dead(interval):
    """The last samples need no torque that the same motion, recorded further, would not need."""
    whole = Bench(noise=0.0).run(strokes((20.0, 20.0)))
    rows = slice(None, None, interval)
    further = Recording.from_samples('run', whole.time[rows], whole.position[rows],
                                     whole.effort[rows])
    fast = int(np.argmax(np.abs(np.gradient(further.position))))
    ended = further.between(0.0, further.time[fast] + 0.5 * further.interval)
    cut, full = motion_of(ended), motion_of(further)
    last = cut.time.size
    assert abs(full.velocity[last - 1]) > 0.9 * full.speed
    assert cut.velocity[-1] == pytest.approx(full.velocity[last - 1], rel=0.1)
    # The count of the very last sample shows; to stop dead would take twenty times the most.
    assert np.max(np.abs(cut.acceleration[-5:])) < 0.5 * np.max(np.abs(full.acceleration))


@pytest.mark.parametrize(('interval', 'speed'), [(5e-3, 1.0), (5e-3, 0.3), (1e-3, 1.0)])
def test_the_noise_of_counts_is_what_counts_do(interval, speed):
    """At a low rate the motion is smoothed over few samples and lies close to their counts."""
    count, random = 2.0 * np.pi / 262_144, np.random.default_rng(1)
    fine = interval / 10.0
    time = np.arange(0.0, 40.0, fine)
    targets = np.repeat(speed * random.uniform(-1.0, 1.0, 20), time.size // 20)
    true = gaussian_filter1d(targets, 0.3 / fine)[::10]
    model = replace(MODEL, motor=Motor(inertia=0.58, viscous_friction=0.7),
                    load_torque=LoadTorque(coefficients=(0.0, 0.0, 0.0, 0.0)),
                    friction=Friction(0.7, 0.0, 0.044))
    runs = []
    for position in (true, count * np.round(true / count)):
        recording = Recording(name='run', time=time[::10], position=position,
                              effort=random.standard_normal(true.size))
        runs.append(problem_of([recording], model).runs[0])
    exact, counted = runs
    _, before, after = np.intersect1d(exact.comparison.grid, counted.comparison.grid,
                                      return_indices=True)
    off = (counted.predicted(physics_of(model))[after]
           - exact.predicted(physics_of(model))[before])
    assert 0.7 < np.mean((off / counted.counts[after]) ** 2) < 1.4


def test_the_noise_of_counts_above_the_band_is_what_counts_do():
    """A wider band lets most of them through: roundings of a motion of which several counts pass
    between samples are not white at any one speed."""
    random = np.random.default_rng(3)
    model, whole = NOMINAL, lively(NOMINAL)
    count = count_of(whole.position)
    motion = motion_of(whole, 120.0)
    true = gaussian_filter1d(np.interp(whole.time, motion.time, motion.position),
                             1e-3 / whole.interval)
    ratios = []
    for _ in range(3):
        phase = random.uniform()
        counted = count * (np.round(true / count + phase) - phase)
        exact, rounded = (problem_of([replace(whole, position=position)], model, bandwidth=60.0,
                                     motion_bandwidth=120.0).runs[0]
                          for position in (true, counted))
        _, before, after = np.intersect1d(exact.comparison.grid, rounded.comparison.grid,
                                          return_indices=True)
        off = (rounded.predicted(physics_of(model))[after]
               - exact.predicted(physics_of(model))[before])
        ratios.append(np.mean(off ** 2) / np.mean(rounded.counts[after] ** 2))
    assert 0.7 < np.mean(ratios) < 1.4


def test_where_counts_and_samples_beat_is_not_known():
    """At a constant speed roundings last where nearly a whole number of samples falls upon a
    count: a motion that is known to a count does not say where that is."""
    count, interval = 2.0 * np.pi / 200.0, 1e-3
    time = np.arange(0.0, 40.0, interval)
    squares = []
    for seed in (1, 2, 3):
        random = np.random.default_rng(seed)
        speeds = np.repeat(random.uniform(4.0, 12.0, 40) * np.tile([1.0, -1.0], 20), 1000)
        true = gaussian_filter1d(np.cumsum(speeds) * interval, 0.03 / interval)
        exact, counted = (problem_of([Recording(
            name='run', time=time, position=position,
            effort=3e-3 * random.standard_normal(true.size))], MODEL).runs[0]
            for position in (true, count * np.round(true / count)))
        # Each motion has a grid of its own.
        at, other = (run.motion.time[run.comparison.grid] for run in (counted, exact))
        inside = (at > other[0]) & (at < other[-1])
        off = counted.predicted(physics_of(MODEL)) - np.interp(
            at, other, exact.predicted(physics_of(MODEL)))
        squares.append(np.mean((off / counted.counts)[inside] ** 2))
    # Were each true motion the one that is seen, 4.
    assert 0.6 < np.mean(squares) < 2.0
