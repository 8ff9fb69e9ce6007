# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""An excitation ends, and lets go, on whatever joint states there are."""

import math

import pytest

from engb_core.control.excitation import ExcitationRun, ExcitationSettings

PERIOD = 0.004


def run(samples, duration=1.0, real_time=True):
    """Return the run after these samples (steady clock, stamp, position, velocity), and its
    torques."""
    made = ExcitationRun(ExcitationSettings(amplitude=0.07, hold=0.5, duration=duration), 500.0,
                         real_time)
    return made, [made.step(*sample) for sample in samples]


def samples(seconds, stamp=lambda time: time, position=lambda time: 0.0, velocity=0.0):
    times = [PERIOD * number for number in range(round(seconds / PERIOD))]
    return [(time, stamp(time), position(time), velocity) for time in times]


def test_it_ends_by_the_stamps():
    made, torques = run(samples(1.2))
    assert torques[:10] == [0.07] * 10 and torques[-10:] == [0.0] * 10
    assert not made.fault


def test_stamps_that_stand_still_let_go_at_once():
    made, torques = run(samples(0.3, stamp=lambda time: 5.0))
    assert torques[0] == 0.07
    assert torques[-40:] == [0.0] * 40
    assert 'have not advanced' in made.fault


def test_stamps_that_creep_end_it_by_the_steady_clock():
    slow = samples(1.5, stamp=lambda time: 1e-3 * time)
    made, torques = run(slow)
    assert torques[round(1.0 / PERIOD)] == 0.07 and torques[-1] == 0.0
    assert 'use_sim_time' in made.fault
    made, torques = run(slow, real_time=False)   # simulated time may pass slowly
    assert torques[-1] == 0.07 and not made.fault


def test_without_a_velocity_the_angles_tell_the_speed():
    runaway = samples(0.5, position=lambda time: 900.0 * time, velocity=None)
    made, torques = run(runaway)
    assert '/s is too fast' in made.fault and torques[-1] == 0.0
    made, torques = run(samples(0.5, position=lambda time: 400.0 * time, velocity=None))
    assert not made.fault and torques[-1] == 0.07


@pytest.mark.parametrize(('position', 'velocity'), [
    (0.0, math.nan), (0.0, math.inf), (math.nan, 0.0), (math.nan, None)])
def test_what_is_no_number_lets_go_for_good(position, velocity):
    good = samples(0.1)
    made, torques = run([*good, (0.1, 0.1, position, velocity), (0.104, 0.104, 0.0, 0.0)])
    assert torques[len(good) - 1:] == [0.07, 0.0, 0.0]
    assert made.fault


def test_it_begins_anew():
    made, _ = run(samples(0.3, velocity=900.0))
    assert made.fault
    made.restart()
    assert made.step(10.0, 0.0, 0.0, 0.0) == 0.07 and not made.fault
