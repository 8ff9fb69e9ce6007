# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Faults of a recording are found and kept out, and a healthy recording has none."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.problem import problem_of
from engb_core.model import Controller, Friction, LoadTorque, Model
from engb_core.physics.plant import physics_of
from engb_core.recording import Recording, Reference
from engb_core.signals.data_faults import cleaned
from engb_core.signals.stale_samples import stale_samples

from .bench import Bench, strokes

MODEL = Model()
# Of the bench's brake.
TRUE = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6)),
             friction=Friction(0.012, 0.11, 0.03))


@pytest.fixture(scope='module')
def healthy() -> Recording:
    return Bench(noise=2e-3).run(strokes())


def names(recording: Recording, model: Model = MODEL) -> list[str]:
    return [entry.fault for entry in cleaned(recording, model)[1]]


def test_a_healthy_recording_has_no_fault(healthy):
    clean, faults = cleaned(healthy, MODEL)
    assert not faults
    assert clean is healthy


@pytest.mark.parametrize('count', [1, 2, 3])
def test_an_encoder_that_jumps_away_and_back(healthy, count):
    position = healthy.position.copy()
    position[700:700 + count] += 1.5
    clean, faults = cleaned(replace(healthy, position=position), MODEL)
    assert [entry.fault for entry in faults] == ['position_glitch']
    assert faults[0].begin == pytest.approx(healthy.time[700])
    kept = np.delete(healthy.time, np.arange(700, 700 + count))
    np.testing.assert_array_equal(clean.time, kept)


def test_a_step_that_stays_is_no_glitch(healthy):
    position = healthy.position + 1.5 * (np.arange(healthy.position.size) > 700)
    assert names(replace(healthy, position=position)) == []


def test_spikes_of_effort_are_left_out_and_told(healthy):
    effort = healthy.effort.copy()
    places = np.array([300, 900, 1500])
    effort[places] += [0.8, -0.7, 0.9]
    clean, faults = cleaned(replace(healthy, effort=effort), MODEL)
    assert [entry.fault for entry in faults] == ['effort_glitch']
    np.testing.assert_array_equal(clean.time, np.delete(healthy.time, places))


def test_spikes_side_by_side_hide_no_others(healthy):
    """Two that are not alike look like a step: all others had stayed, as effort was taken to move
    so far within a sample."""
    effort = healthy.effort.copy()
    places = np.array([300, 900, 901, 1500])
    effort[places] += [0.8, -0.9, -0.6, 0.7]
    clean, faults = cleaned(replace(healthy, effort=effort), MODEL)
    assert [entry.fault for entry in faults] == ['effort_glitch']
    np.testing.assert_array_equal(clean.time, np.delete(healthy.time, places))


def test_a_jump_of_the_encoder_is_not_what_a_spike_of_effort_would_allow(healthy):
    # At most 0.2 N·m drive the shaft; the spikes of 2 N·m never did.
    position, effort = healthy.position.copy(), healthy.effort.copy()
    position[[700, 1100]] += 0.06
    effort[[300, 900, 1500]] += [2.0, -1.9, 2.1]
    assert names(replace(healthy, position=position, effort=effort)) == ['position_glitch',
                                                                         'effort_glitch']


def test_lost_samples_and_jitter(healthy):
    keep = np.ones(healthy.time.size, bool)
    keep[400:440] = False
    assert names(_rows(healthy, keep)) == ['samples_lost']
    rng = np.random.default_rng(1)
    late = rng.uniform(0.0, 0.6 * healthy.interval, healthy.time.size)
    assert names(replace(healthy, time=healthy.time + late - late[0])) == ['jittering_stamps']


def test_a_log_that_repeats_each_value(healthy):
    times = 5
    rows = np.repeat(np.arange(0, healthy.time.size, times), times)[:healthy.time.size]
    log = replace(healthy, position=healthy.position[rows], effort=healthy.effort[rows],
                  velocity=None)
    clean, faults = cleaned(log, MODEL)
    assert 'repeated_values' in [entry.fault for entry in faults]
    assert clean.interval == pytest.approx(times * healthy.interval)


def test_samples_that_a_bus_tells_twice(healthy):
    """One in five stands for the one before: the shaft does not stand still that often."""
    fresh = np.random.default_rng(3).random(healthy.time.size) > 0.2
    fresh[0] = True
    rows = np.maximum.accumulate(np.where(fresh, np.arange(fresh.size), 0))
    log = replace(healthy, position=healthy.position[rows], effort=healthy.effort[rows],
                  velocity=None)
    clean, faults = cleaned(log, MODEL)
    assert 'stale_samples' in [entry.fault for entry in faults]
    assert not {'jittering_stamps', 'position_glitch'} & {entry.fault for entry in faults}
    np.testing.assert_array_equal(clean.time, healthy.time[fresh])


def test_a_shaft_at_rest_is_not_told_twice(healthy):
    """Position and effort of a shaft that a brake holds do not change, and are told anew."""
    rows = np.concatenate([np.arange(1000), np.full(500, 1000), np.arange(1000, 2000)])
    step = np.diff(healthy.time[:2])[0]
    rests = Recording('run', step * np.arange(rows.size), healthy.position[rows],
                      healthy.effort[rows])
    assert not stale_samples(rests).any()


def test_a_sensor_at_its_limit(healthy):
    limit = 0.7 * float(healthy.effort.max())
    clipped = replace(healthy, effort=np.minimum(healthy.effort, limit))
    assert names(clipped) == ['clipped_effort']
    # A limit that the model file knows of is the controller's own.
    known = replace(MODEL, controller=Controller(0.3, 1.0, 0.004, limit, 1000.0))
    assert names(clipped, known) == []


@pytest.mark.parametrize('levels', [(0.03, 0.06), (0.0, 0.05, -0.05, 0.05)])
def test_a_command_in_steps_is_at_no_limit(levels):
    """A torque that is commanded stands at its largest value as it stands at any other."""
    effort = np.repeat(levels, 2000)
    time = np.arange(effort.size) / 1000.0
    speed = np.cumsum(effort - 0.02 * np.sign(effort)) * 1e-2
    position = 1e-3 * np.round(np.cumsum(speed) * 1e-3 / 1e-3)
    assert 'clipped_effort' not in names(Recording('run', time, position, effort))


def test_a_spike_beyond_the_limit_does_not_hide_it(healthy):
    effort = np.minimum(healthy.effort, 0.7 * float(healthy.effort.max()))
    effort[healthy.time.size // 2] = 3.0 * effort.max()
    assert names(replace(healthy, effort=effort)) == ['effort_glitch', 'clipped_effort']


def test_effort_that_was_cut_off_is_not_judged(healthy):
    """It only says that there was at least so much: the true model is no worse beside it."""
    clipped = replace(healthy, effort=np.minimum(healthy.effort,
                                                 0.6 * float(healthy.effort.max())))
    clean, _ = cleaned(clipped, MODEL)

    def error(recording: Recording) -> float:
        (run,) = problem_of([recording], TRUE).runs
        return float(np.sqrt(np.mean((run.measured - run.predicted(physics_of(TRUE))) ** 2)))

    assert error(clean) < 1.2 * error(healthy)
    assert error(clipped) > 3.0 * error(healthy)


def test_an_effort_that_is_a_command(healthy):
    wanted = healthy.position + 0.01 * np.sin(7.0 * healthy.time)
    effort = 3.0 * (wanted - healthy.position)
    told = replace(healthy, effort=effort, reference=Reference(healthy.time, wanted))
    assert names(told) == ['effort_is_command']
    measured = replace(told, effort=effort + 0.05 * np.random.default_rng(1).standard_normal(
        effort.size) * effort.std() * 5.0)
    assert 'effort_is_command' not in names(measured)


def _rows(recording: Recording, keep: np.ndarray) -> Recording:
    return replace(recording, time=recording.time[keep], position=recording.position[keep],
                   effort=recording.effort[keep],
                   velocity=None if recording.velocity is None else recording.velocity[keep])


@pytest.mark.parametrize('count', [1, 2])
def test_an_encoder_that_jumps_while_the_shaft_moves_fast(healthy, count):
    """The motion between the samples beside the jump is no small part of it."""
    fastest = int(np.argmax(np.abs(np.gradient(healthy.position))))
    # At every fourth sample: 250 Hz.
    slow = replace(healthy, time=healthy.time[fastest % 4::4] - healthy.time[fastest % 4],
                   position=healthy.position[fastest % 4::4].copy(),
                   effort=healthy.effort[fastest % 4::4], velocity=None)
    place = fastest // 4
    step = slow.position[place + 1] - slow.position[place]
    slow.position[place:place + count] -= 4.0 * step * (count + 1) / 2.0
    assert names(slow) == ['position_glitch']


def test_jitter_of_the_stamps_of_a_fast_motion_is_no_glitch():
    """A sample that came later has moved on; the motion hardly needs any torque."""
    generator = np.random.default_rng(3)
    time = np.arange(5000) * 2e-3 + 2.5e-4 * generator.standard_normal(5000)
    position = 30.0 * np.sin(0.8 * time)
    effort = 2e-3 * np.sin(0.8 * time)
    assert 'position_glitch' not in names(Recording('run', time - time[0], position, effort))


def test_samples_that_are_read_off_their_even_stamps(healthy):
    """As of a servo on a bus that a host polls: told as that, and not as glitches."""
    rng = np.random.default_rng(2)
    taken = healthy.time + 0.2 * healthy.interval * rng.standard_normal(healthy.time.size)
    polled = replace(healthy, position=np.interp(taken, healthy.time, healthy.position))
    _, faults = cleaned(polled, MODEL)
    assert [entry.fault for entry in faults] == ['jittering_stamps']
    assert 'before or after' in faults[0].statement


def test_a_current_that_the_samples_fold(healthy):
    """The ripple of a fast loop, far above half the sampling rate, falls between the samples: it
    looks like noise, which a shaft at rest does not show, and is told as what it is."""
    speed = np.abs(np.gradient(healthy.position, healthy.time))
    moving = speed > 0.02 * speed.max()
    size = 1.6 * float(np.std(healthy.effort[moving]))
    # Between two samples pass many periods, and not as many each time.
    ripple = size * np.sin(np.random.default_rng(4).uniform(0.0, 2.0 * np.pi, speed.size))
    folded = replace(healthy, effort=healthy.effort + np.where(moving, ripple, 0.0))
    assert names(folded) == ['aliased_effort']
    problem = problem_of([cleaned(folded, TRUE)[0]], TRUE)
    left = problem.runs[0].measured - problem.runs[0].predicted(physics_of(TRUE))
    assert 0.5 < float(np.mean((left / problem.runs[0].sigma) ** 2)) < 2.0
