# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Signals of next to no samples, without motion or without torque: nothing is made of them."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.model import EffectSetting, Model
from engb_core.physics.plant import physics_of
from engb_core.prediction import find_phases
from engb_core.recording import Recording
from engb_core.signals import count_edges, data_faults, sharp_motion
from engb_core.signals.count_edges import passing, quantum_of
from engb_core.signals.gaussian import moving_on
from engb_core.signals.motion import motion_of
from engb_core.signals.order_periodogram import line_amplitude
from engb_core.signals.plausibility import Plausibility
from engb_core.signals.position_error import effort_of_recording
from engb_core.signals.sampling_noise import sampling_noise
from engb_core.signals.unit_readings import SI, UnitReadings

TIME = np.arange(600) * 2e-3


def recording(position=None, effort=None, size=TIME.size):
    time = TIME[:size]
    return Recording('a', time, np.sin(3.0 * time) if position is None else position[:size],
                     0.1 * np.cos(3.0 * time) if effort is None else effort[:size])


def test_a_shaft_without_counts_passes_none():
    still = recording(position=np.zeros(600))
    assert quantum_of(still.position) == 0.0
    assert not passing(still).any()


@pytest.mark.parametrize(('edge', 'time', 'beyond'), [
    ([1.0, 1.0], 0.5, 0.0), ([1.0, 2.0], 0.5, 0.5), ([1.0, 2.0], -3.0, 0.0)])
def test_how_far_a_shaft_goes_on_beyond_its_last_edge(edge, time, beyond):
    assert count_edges._going_on(np.array(edge), time) == beyond


@pytest.mark.parametrize('size', [2, 5])
def test_few_samples_have_no_glitches(size):
    run = recording(size=size)
    noise = sampling_noise(run)
    assert (noise.white, noise.jitter) == (0.0, 0.0)
    assert not data_faults._impossible(run, Model(), noise, 1.0).any()
    assert not data_faults._spikes(run.effort).any()
    assert data_faults._repeated(run) == []


def test_an_effort_that_is_nothing_but_spikes_has_none():
    effort = np.zeros(120)
    effort[1::4] = 5.0
    assert not data_faults._spikes(effort).any()
    one = 1e-3 * np.sin(np.arange(120))
    one[60] += 5.0
    assert np.flatnonzero(data_faults._spikes(one)).tolist() == [60]


def test_without_a_torque_nothing_bounds_a_motion():
    run = recording(effort=np.zeros(600))
    assert not data_faults._impossible(run, Model(), sampling_noise(run), 0.0).any()


def test_positions_on_a_line_have_no_noise():
    noise = sampling_noise(recording(position=np.zeros(600)))
    assert (noise.white, noise.jitter) == (0.0, 0.0)


def test_a_signal_shorter_than_the_filter_is_held_beyond_its_ends():
    taps = np.full(9, 1.0 / 9.0)
    np.testing.assert_allclose(moving_on(np.array([2.0, 2.0, 2.0]), taps), [2.0, 2.0, 2.0])
    line = np.arange(40.0)
    np.testing.assert_allclose(moving_on(line, taps), line, atol=1e-12)     # goes on as it came


def test_two_positions_go_on_where_they_are():
    found = sharp_motion._going_on(np.array([1.0, 2.0]), 2)
    assert found[0] == 1.0 and found[-1] == 2.0 and found.size == 2 + 4 * sharp_motion.REMEMBERED


def test_an_order_that_no_speed_brings_into_the_band_has_no_amplitude():
    motion = motion_of(recording())
    moving = np.ones(motion.time.size, bool)
    above = np.zeros(motion.time.size)
    assert line_amplitude(motion, moving, 1.0, above, 1e-6) == (0.0, 0.0)
    assert line_amplitude(motion, moving, 1.0, above, 20.0)[1] > 0.0


def test_an_effort_of_nothing_tells_no_unit():
    reading = UnitReadings(recording(effort=np.zeros(600)), Model()).read(SI, SI)
    assert (reading.left, reading.factor, reading.efforts) == (1.0, 1.0, (SI,))


def test_a_motion_that_is_no_number_has_no_refit():
    position = np.sin(3.0 * TIME)
    position[300] = np.inf
    with np.errstate(all='ignore'):
        assert UnitReadings(recording(position=position), Model()).left_by_free_refit() == 0.0


def test_a_motion_faster_than_anything_is_told_with_its_speed():
    fast = recording(position=1e7 * np.sin(3.0 * TIME))
    told = Plausibility(fast, Model())._units()
    assert 'faster than anything does' in told


def test_a_disc_that_hardly_turns_tells_no_phase():
    model = Model(effects=(EffectSetting('disc_runout', {'amplitude': 0.01, 'phase': 0.3}),))
    short = motion_of(replace(recording(size=12)))
    assert find_phases(short, model).effects[0].parameters['phase'] == 0.3


@pytest.mark.parametrize(('acts_as', 'size'), [('position_shift', 1e-2), ('position_delay', 2e-3)])
def test_what_a_position_sensor_adds_is_taken_off(acts_as, size):
    model = Model(effects=(EffectSetting('law', {'a': size}, 'a * abs(velocity)', acts_as),))
    run = recording()
    motion = motion_of(run)
    plain = effort_of_recording(run, motion, motion.samples(), physics_of(Model()))
    found = effort_of_recording(run, motion, motion.samples(), physics_of(model))
    assert np.isfinite(found).all()
    assert np.abs(found - plain).max() > 1e-6
