# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Loads that are no clamp's, and recordings that tell too little of something."""

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.identify.cogging import find_orders
from engb_core.identify.nominal_plant import (
    fit_free_motor,
    fit_response,
    frequency_response,
    FrequencyResponse,
)
from engb_core.identify.online import StrokeTracker
from engb_core.identify.procedure import identify
from engb_core.identify.self_energizing import fit_together
from engb_core.identify.smoothing import motions
from engb_core.identify.strokes import find_strokes
from engb_core.mechanism.kinematics import CHOSEN
from engb_core.model import LoadTorque, Model
from engb_core.recording import Recording

from .bench import simulate, stroke_reference


def arm(phase=0.0, size=4000):
    """A weight on an arm that swings, by its equation of motion."""
    time = np.arange(size) * 1e-3
    position = 3.0 * np.sin(2 * np.pi * 0.7 * time) + np.sin(2 * np.pi * 2.3 * time)
    velocity = np.gradient(position, time)
    load = 0.03 * np.sin(position + phase)
    effort = (6.8e-5 * np.gradient(velocity, time) + 1.1e-3 * velocity + load
              + (0.012 + 0.1 * np.abs(load)) * np.clip(velocity / 0.5, -1.0, 1.0)
              + np.random.default_rng(1).normal(0.0, 1e-3, time.size))
    return Recording.from_samples('arm', time, position, effort)


def test_a_weight_on_an_arm_is_found_as_the_sinusoid_that_it_is():
    start = Model(load_torque=LoadTorque('sinusoid', amplitude=0.02))
    found = identify([arm(0.4)], start)
    load = found.model.load_torque
    assert (load.form, load.amplitude, load.phase) == (
        'sinusoid', pytest.approx(0.03, rel=0.03), pytest.approx(0.4, abs=0.03))
    angle = np.linspace(-4.0, 4.0, 40)
    np.testing.assert_allclose(found.load_torque(angle), 0.03 * np.sin(angle + 0.4), atol=2e-3)
    assert found.model.motor.inertia == pytest.approx(6.8e-5, rel=0.05)
    with pytest.raises(InputError, match='needs a load of form polynomial'):
        fit_together(found, found, CHOSEN)


def test_a_range_of_less_than_a_turn_shows_no_order():
    pieces = motions(simulate(stroke_reference(top=5.0, count=1)))
    assert find_orders(pieces, np.zeros(sum(piece.rows.size for piece in pieces))) == ()


def test_runs_that_are_too_short_or_stand_still_are_refused():
    short = simulate(stroke_reference(count=1))
    with pytest.raises(InputError, match='record at least 6 s'):
        frequency_response([short])
    still = Recording.from_samples('still', short.time, np.zeros(short.time.size), short.effort)
    with pytest.raises(InputError, match='the motor does not move in any of these runs'):
        fit_free_motor([still])
    with pytest.raises(InputError, match='strokes'):
        find_strokes(motions(still))


def test_runs_of_another_rate_do_not_count_beside_the_first_and_no_coherence_is_told():
    rng = np.random.default_rng(2)

    def noise(rate):
        time = np.arange(int(8 * rate)) / rate
        return Recording.from_samples('noise', time, np.cumsum(rng.normal(size=time.size)) * 1e-3,
                                      rng.normal(size=time.size))

    one, other = noise(1000.0), noise(500.0)
    response = frequency_response([one, other])
    np.testing.assert_array_equal(response.response, frequency_response([one]).response)
    silent = FrequencyResponse(response.frequency, response.response,
                               np.zeros(response.frequency.size), response.segments)
    with pytest.raises(InputError, match='no coherent response; excite the motor more strongly'):
        fit_response(silent)


def test_pieces_that_are_too_short_are_left_out_and_a_shaft_without_counts_stands():
    time = np.r_[np.arange(1500) * 1e-3, 5.0 + np.arange(10) * 1e-3, 8.0 + np.arange(1500) * 1e-3]
    recording = Recording.from_samples('parts', time, 0.0 * time + 1.0, np.sin(time))
    pieces = motions(recording)
    assert [round(float(piece.time[0])) for piece in pieces] == [0, 8]
    assert np.max(np.abs(pieces[0].velocity)) < 1e-12


def test_strokes_of_a_few_samples_tell_nothing_online():
    tracker = StrokeTracker(Model())
    time = np.arange(0.0, 3.0, 0.05)
    for moment in time:
        assert tracker.step(moment, 10.0 - 10.0 * np.cos(2.0 * np.pi * moment),
                            np.sin(2.0 * np.pi * moment), 0.1) is None

