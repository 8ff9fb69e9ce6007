# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Velocity and acceleration from encoder counts, at creep and at speed; gaps are seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engb_core.recording import Recording, Signal
from engb_core.signals.gaussian import gaussian_kernel
from engb_core.signals.motion import Motion, motion_of, with_position
from engb_core.signals.sharp_motion import sharp_motion_of

COUNT = 2.0 * np.pi / 4096.0


def counted(angle, rate: float = 1000.0, duration: float = 10.0, jitter: float = 0.0,
            count: float = COUNT, **more) -> Recording:
    """Record `angle`(time) with an encoder; `jitter` is in parts of a sample."""
    time = np.arange(int(duration * rate)) / rate
    time += jitter / rate * np.random.default_rng(3).uniform(-1.0, 1.0, time.size)
    position = angle(time)
    if count:
        position = np.round(position / count) * count
    return Recording.from_samples('run', time, position, 0.1 * np.sin(time), **more)


def error(got: np.ndarray, true: np.ndarray) -> float:
    """Return the root mean square error inside the run, relative to the signal."""
    inside = slice(100, -100)
    return float(np.sqrt(np.mean((got - true)[inside] ** 2) / np.mean(true[inside] ** 2)))


@pytest.mark.parametrize(('amplitude', 'frequency', 'rate', 'jitter', 'limits'), [
    (20.0, 1.0, 1000.0, 0.0, (3e-4, 1e-3, 0.08)),
    (20.0, 1.0, 1000.0, 0.3, (3e-4, 1.2e-3, 0.08)),
    (20.0, 1.0, 500.0, 0.0, (3e-4, 1e-3, 0.08)),
    (2.0, 0.5, 1000.0, 0.0, (3e-4, 0.025, None)),
    (0.2, 0.1, 1000.0, 0.0, (3e-3, 0.06, None)),
    (0.02, 0.1, 1000.0, 0.0, (0.03, 0.2, None)),
], ids=['fast', 'jittered stamps', '500 Hz', 'slow', 'creep', 'thirteen counts'])
def test_a_known_motion(amplitude, frequency, rate, jitter, limits):
    turn = 2.0 * np.pi * frequency
    recording = counted(lambda time: amplitude * np.sin(turn * time), rate, jitter=jitter)
    motion = motion_of(recording)
    time = recording.start + motion.time
    assert error(motion.position, amplitude * np.sin(turn * time)) < limits[0]
    assert error(motion.velocity, amplitude * turn * np.cos(turn * time)) < limits[1]
    if limits[2] is not None:
        assert error(motion.acceleration,
                     -amplitude * turn ** 2 * np.sin(turn * time)) < limits[2]


@pytest.mark.parametrize(('speed', 'limit'), [(0.01, 0.01), (0.05, 0.03), (0.2, 0.08), (1.0, 0.06),
                                              (50.0, 0.002)])
def test_constant_speed_is_constant(speed, limit):
    """A count in 150 ms or thirty counts a sample: no ripple of the encoder's making."""
    motion = motion_of(counted(lambda time: speed * time))
    inside = slice(200, -200)
    assert np.std(motion.velocity[inside]) < limit * speed
    assert np.mean(motion.velocity[inside]) == pytest.approx(speed, rel=2e-3)


def test_no_lag():
    """Offline there is no reason for any: the motion lies where it was."""
    recording = counted(lambda time: 3.0 * np.tanh(4.0 * (time - 5.0)), count=0.0,
                        duration=7.0)
    motion = motion_of(recording)
    middle = np.interp(0.0, motion.position, motion.time)
    assert middle == pytest.approx(5.0 - recording.start, abs=2e-5)
    assert motion.time[np.argmax(motion.velocity)] == pytest.approx(5.0, abs=0.0021)
    assert motion.time[np.argmax(motion.effort)] == pytest.approx(0.5 * np.pi, abs=0.1)


def test_a_standing_shaft_stands():
    motion = motion_of(counted(lambda time: np.full_like(time, 1.0)))
    assert np.abs(motion.velocity).max() < 1e-9
    assert np.abs(motion.acceleration).max() < 1e-6
    assert motion.quantum == 0.0


def test_a_stop_between_counts_stays_a_stop():
    """Two counts that the shaft dithers between in noise are no oscillation worth having."""
    motion = motion_of(counted(lambda time: np.clip(2.0 * (time - 2.0), 0.0, 8.0)))
    stopped = (motion.time < 1.9) | (motion.time > 6.1)
    moving = (motion.time > 2.1) & (motion.time < 5.9)
    assert np.abs(motion.velocity[stopped]).max() < 1e-6
    assert np.abs(motion.velocity[moving] - 2.0).max() < 0.25


def stroke(time: np.ndarray) -> np.ndarray:
    """Return an angle that creeps for three seconds, rests for one and leaves at 40 rad/s."""
    return np.where(time < 3.0, 0.05 * time, 0.15 + np.maximum(0.0, 40.0 * (time - 4.0)))


@pytest.mark.parametrize(('rate', 'lost'), [(1000.0, 0.03), (1000.0, 0.0), (100.0, 0.0)])
def test_a_shaft_does_not_creep_through_a_rest_to_where_it_is_seen_next(rate, lost):
    whole = counted(stroke, rate, duration=5.0)
    keep = (whole.time < 3.999) | (whole.time > 3.999 + lost)
    motion = motion_of(Recording.from_samples('run', whole.time[keep], whole.position[keep],
                                              whole.effort[keep]))
    rest = (motion.time > 3.1) & (motion.time < 3.95)
    leaves = (motion.time > 4.1) & (motion.time < 4.9)
    assert np.abs(motion.velocity[rest]).max() < 0.03
    assert np.abs(motion.velocity[leaves] - 40.0).max() < 0.5


@pytest.mark.parametrize('turned', [False, True], ids=['begins', 'ends'])
def test_a_rest_at_an_end_of_the_recording_stays_one(turned):
    """Several counts are the first, or the last, that is seen of a motion."""
    def angle(time: np.ndarray) -> np.ndarray:
        time = 5.0 - time if turned else time
        return np.where(time < 4.0, np.maximum(0.0, 3.0 * (time - 2.0)), 2.0 * (7.0 - time))

    whole = counted(angle, duration=5.0)
    stop = 3.0 if turned else 2.0
    keep = np.abs(whole.time - stop) > 0.02
    motion = motion_of(Recording.from_samples('run', whole.time[keep], whole.position[keep],
                                              whole.effort[keep]))
    rest = (motion.time > 3.1 if turned else motion.time < 1.9) & (motion.time < 4.9)
    assert np.abs(motion.velocity[rest]).max() < 1e-9


def test_the_encoder_is_seen():
    motion = motion_of(counted(lambda time: 0.2 * np.sin(time)))
    assert motion.quantum == pytest.approx(COUNT)


def test_grid_and_columns():
    recording = counted(lambda time: 2.0 * np.sin(time), velocity=None)
    motion = motion_of(recording)
    assert np.allclose(np.diff(motion.time), motion.step)
    table = motion.samples()
    assert table.shape[0] == motion.time.size
    assert np.isfinite(table).all()
    for name in ('position', 'velocity', 'acceleration', 'effort', 'disc_speed', 'disc_angle',
                 'pad_temperature', 'known'):
        assert getattr(motion, name).shape == motion.time.shape
    assert not motion.has_disc
    assert not motion.has_temperature


@pytest.mark.parametrize('begin', [1.0, 4.0, 8.0])
def test_gaps_are_flagged(begin):
    whole = counted(lambda time: np.sin(time))
    keep = (whole.time < begin) | (whole.time > begin + 0.05)
    motion = motion_of(Recording.from_samples('run', whole.time[keep], whole.position[keep],
                                              whole.effort[keep]))
    inside = (motion.time > begin) & (motion.time < begin + 0.05)
    outside = (motion.time < begin - 0.01) | (motion.time > begin + 0.06)
    assert not motion.known[inside].any()
    assert motion.known[outside][10:-10].all()
    assert np.abs(motion.velocity - np.cos(motion.time))[outside][100:-100].max() < 0.2


def test_single_lost_samples_are_bridged():
    whole = counted(lambda time: np.sin(time))
    keep = np.ones(whole.time.size, bool)
    keep[np.random.default_rng(4).integers(100, 9900, 60) // 3 * 3] = False
    motion = motion_of(Recording.from_samples('run', whole.time[keep], whole.position[keep],
                                              whole.effort[keep]))
    assert motion.known[10:-10].all()


def test_the_ends_of_a_recording_in_motion_are_not_known():
    motion = motion_of(counted(lambda time: 3.0 * time))
    assert not motion.known[[0, 1, -2, -1]].any()
    # It goes on beyond its ends: the shaft that seemed to stop dead there needed a torque.
    assert np.abs(motion.acceleration).max() < 1.5 * np.abs(
        motion.acceleration[motion.known]).max()


def test_the_disc_angle_is_the_integral_of_its_speed():
    clock = np.arange(0.0, 10.0, 0.02)
    recording = counted(lambda time: np.sin(time), signals={
        'disc_speed': Signal(clock, 40.0 + 5.0 * clock),
        'pad_temperature': Signal(clock, 20.0 + clock)})
    motion: Motion = motion_of(recording)
    assert motion.has_disc
    assert motion.has_temperature
    np.testing.assert_allclose(motion.pad_temperature, 20.0 + motion.time, atol=0.03)
    expected = 40.0 * motion.time + 2.5 * motion.time ** 2
    np.testing.assert_allclose(motion.disc_angle, expected, atol=0.02)


@pytest.mark.parametrize('derivative', [0, 1, 2])
@pytest.mark.parametrize(('bandwidth', 'step'), [(60.0, 0.001), (20.0, 0.002), (2.0, 0.004)])
def test_the_kernels_are_exact_for_parabolas(bandwidth, step, derivative):
    """Σ taps·x(t − lag) gives the value, slope and curvature of what is smooth."""
    taps = gaussian_kernel(bandwidth, step, derivative)
    lag = (np.arange(taps.size) - taps.size // 2) * step
    expected = np.zeros(3)
    expected[derivative] = 1.0
    # convolve: value at 0 is Σ taps(lag)·x(−lag).
    found = [float(taps @ (-lag) ** power) / (1, 1, 2)[power] for power in range(3)]
    np.testing.assert_allclose(found[:derivative + 1], expected[:derivative + 1], atol=1e-9)
    if derivative == 0:
        turn = np.exp(-2j * np.pi * bandwidth * lag)
        assert abs(taps @ turn) == pytest.approx(np.sqrt(0.5), rel=0.01)


def test_a_gap_is_crossed_without_a_jerk():
    """Forty milliseconds are missing in the midst of an acceleration."""
    time = np.arange(0.0, 2.0, 1e-3)
    position = 20.0 * time ** 2
    kept = (time < 1.0) | (time > 1.04)
    whole = motion_of(Recording.from_samples('whole', time, position, np.zeros(time.size)), 160.0)
    holed = motion_of(Recording.from_samples('holed', time[kept], position[kept],
                                             np.zeros(kept.sum())), 160.0)
    near = (holed.time > 0.9) & (holed.time < 1.14)
    np.testing.assert_allclose(holed.position[near], whole.position[near], atol=2e-3)
    np.testing.assert_allclose(holed.acceleration[near], 40.0, atol=25.0)
    assert not holed.known[(holed.time > 1.005) & (holed.time < 1.035)].any()


@pytest.mark.parametrize('derive', [motion_of, sharp_motion_of])
def test_motion_and_effort_pass_the_same_low_pass(derive):
    # Slow samples of a fast motion: what attenuates one side of the balance alone comes out as
    # too much inertia. The Gaussian's sampled derivatives are true to within a percent.
    frequency = 12.3
    turns = 2.0 * np.pi * frequency
    recording = counted(lambda time: 5.0 * np.sin(turns * time), rate=200.0, count=5e-5)
    recording = replace(recording, effort=np.sin(turns * recording.time))
    motion = derive(recording)
    rows = slice(motion.time.size // 4, 3 * motion.time.size // 4)
    sine, cosine = np.sin(turns * motion.time)[rows], np.cos(turns * motion.time)[rows]
    gain = motion.effort[rows] @ sine / (sine @ sine)
    for values, shape, size in ((motion.position, sine, 5.0),
                                (motion.velocity, cosine, 5.0 * turns),
                                (motion.acceleration, sine, -5.0 * turns ** 2)):
        assert values[rows] @ shape / (shape @ shape) == pytest.approx(size * gain, rel=0.01)


def test_the_motion_of_other_positions_is_that_of_a_recording_of_them():
    """With a gap in it, whose bridge goes with the positions."""
    recording = counted(stroke, jitter=1e-4)
    kept = (recording.time < 3.0) | (recording.time > 3.2)
    recording = replace(recording, time=recording.time[kept], position=recording.position[kept],
                        effort=recording.effort[kept])
    other = recording.position + 0.01 * np.sin(20.0 * recording.time)
    moved = with_position(motion_of(recording), recording, other)
    derived = motion_of(replace(recording, position=other))
    np.testing.assert_array_equal(moved.samples(), derived.samples())
