# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Stamps that jitter about even samples, and a recording that ends in the midst of a motion."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.model import Friction, LoadTorque, Model, Motor
from engb_core.prediction import predict_effort
from engb_core.recording import Recording
from engb_core.signals.data_faults import cleaned
from engb_core.signals.stamps import evenly_timed

STEP, COUNT = 2e-3, 2.0 * np.pi / 131_072
MODEL = Model(motor=Motor(inertia=0.5, viscous_friction=0.7),
              load_torque=LoadTorque(coefficients=(0.0, 0.0, 0.0, 0.0)),
              friction=Friction(0.2, 0.0, 0.05))


def swing(step: float = STEP, seconds: float = 20.2) -> Recording:
    """Return a swing that has speed at its end, with the effort that it takes."""
    time = np.arange(0.0, seconds, step)
    waves = ((1.2, 2.0 * np.pi * 0.4), (0.3, 2.0 * np.pi * 1.1))
    position, velocity, acceleration = (
        sum(size * rate ** order * np.sin(rate * time + 0.5 * np.pi * order)
            for size, rate in waves) for order in range(3))
    effort = (0.5 * acceleration + 0.7 * velocity
              + 0.2 * np.clip(velocity / 0.05, -1.0, 1.0))
    return Recording(name='swing', time=time, position=COUNT * np.round(position / COUNT),
                     effort=effort)


def lossy(recording: Recording, part: float) -> Recording:
    kept = np.random.default_rng(2).random(recording.time.size) >= part
    kept[0] = True
    return replace(recording, time=recording.time[kept], position=recording.position[kept],
                   effort=recording.effort[kept])


@pytest.mark.parametrize('lost', [0.0, 0.04])
def test_even_samples_behind_a_queue_are_found(lost):
    true = lossy(swing(), lost)
    random = np.random.default_rng(1)
    stamped = replace(true, time=np.sort(
        true.time * (1.0 + 5e-5) + 0.12 * STEP * random.standard_normal(true.time.size)))
    found = evenly_timed(stamped)
    off = found.time - true.time * (1.0 + 5e-5)
    assert np.std(off) < 0.3 * 0.12 * STEP
    assert np.abs(off).max() < 0.5 * STEP
    assert [fault.fault for fault in cleaned(stamped, MODEL)[1]][0] == 'jittering_stamps'


def test_samples_that_now_and_then_come_much_too_late_are_all_counted():
    # A stamp that is late makes one step long and the next one short.
    true = swing(1e-3)
    random = np.random.default_rng(1)
    size = true.time.size
    late = np.where(random.random(size) < 0.08, random.exponential(0.45e-3, size), 0.0)
    stamped = Recording.from_samples('late', np.maximum.accumulate(true.time + late),
                                     true.position, true.effort)
    found = evenly_timed(stamped)
    np.testing.assert_allclose(np.diff(found.time), 1e-3, rtol=0.01)


def test_samples_that_leave_a_queue_in_bursts_are_found():
    # An adapter that is polled: one to six samples within tens of microseconds, stamped then.
    true = swing()
    random = np.random.default_rng(4)
    stamp, first = true.time.copy(), 0
    while first < stamp.size:
        last = min(first + random.integers(1, 7), stamp.size)
        arrives = stamp[last - 1] + 0.25e-3 + random.exponential(0.25e-3)
        stamp[first:last] = arrives + np.cumsum(random.uniform(15e-6, 60e-6, last - first))
        first = last
    stamped = Recording.from_samples('run', np.maximum.accumulate(stamp), true.position,
                                     true.effort)
    assert stamped.interval == pytest.approx(STEP, rel=0.01)
    found = evenly_timed(stamped)
    np.testing.assert_allclose(np.diff(found.time), STEP, rtol=0.01)
    assert [fault.fault for fault in cleaned(stamped, MODEL)[1]][0] == 'jittering_stamps'


def test_a_recording_of_bursts_that_were_taken_so_stands():
    whole = swing(STEP / 40.0)
    rows = (np.arange(0, whole.time.size - 200, 200)[:, None] + np.arange(5)).ravel()
    bursts = replace(whole, time=whole.time[rows], position=whole.position[rows],
                     effort=whole.effort[rows])
    assert evenly_timed(bursts) is bursts


def test_stamps_of_uneven_samples_stand():
    whole = swing(STEP / 20.0)
    rows = np.arange(0, whole.time.size - 20, 20)
    rows = rows + np.random.default_rng(1).integers(-5, 6, rows.size).clip(-rows)
    uneven = replace(whole, time=whole.time[rows], position=whole.position[rows],
                     effort=whole.effort[rows])
    assert evenly_timed(uneven) is uneven


def test_a_prediction_by_jittering_stamps_is_as_good_as_by_even_ones():
    true = swing()
    random = np.random.default_rng(3)
    stamped = replace(true, time=np.sort(
        true.time + 0.12 * STEP * random.standard_normal(true.time.size)))
    errors = [np.sqrt(np.mean((predict_effort(entry, MODEL) - true.effort)[10:] ** 2))
              for entry in (true, stamped)]
    assert errors[1] < 2.0 * errors[0]


@pytest.mark.parametrize('step', [2e-3, 1e-2])
def test_a_recording_may_end_in_motion(step):
    recording = swing(step)
    off = np.abs(predict_effort(recording, MODEL) - recording.effort)
    # Differences at the last sample itself had given half the acceleration.
    assert off[-5:].max() < np.quantile(off[10:-10], 0.999)
