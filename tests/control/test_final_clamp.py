# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The final clamp, number by number."""

import math

import pytest

from engb_core.control.final_clamp import FinalClamp
from engb_core.control.supervisor_settings import SupervisorSettings

# 0.5 N·m, 10 N·m/s, and 0.2 s from full torque to none.
SETTINGS = SupervisorSettings(effort_limit=0.5, effort_rate=10.0, ramp_time=0.2)


@pytest.fixture
def clamp():
    return FinalClamp(SETTINGS)


def at(clamp, torque):
    """Bring it to a torque within its limits."""
    while clamp.output != torque:
        clamp.step(torque, 0.1)
    return clamp


def test_it_begins_with_nothing(clamp):
    assert (clamp.output, clamp.limited, clamp.activity) == (0.0, False, 0)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_the_slew_rate_is_followed_for_at_most_a_tenth_of_a_second(clamp, sign):
    assert clamp.step(sign * 0.4, 0.002) == pytest.approx(sign * 0.02)
    assert clamp.step(sign * 0.4, 0.002) == pytest.approx(sign * 0.04)
    assert clamp.step(sign * 0.4, 0.0) == pytest.approx(sign * 0.04)
    assert clamp.step(sign * 0.4, -0.5) == pytest.approx(sign * 0.04)
    slow = FinalClamp(SupervisorSettings(effort_limit=0.5, effort_rate=1.0))
    assert slow.step(sign * 0.4, 3.0) == pytest.approx(sign * 0.1)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_the_limit_holds_and_what_was_changed_is_told(clamp, sign):
    assert clamp.step(sign * 0.25, 0.1) == sign * 0.25
    assert (clamp.limited, clamp.activity) == (False, 0)
    assert clamp.step(sign * 7.0, 0.1) == sign * 0.5
    assert (clamp.limited, clamp.activity) == (True, 1)
    assert clamp.step(sign * 0.5, 0.1) == sign * 0.5
    assert (clamp.limited, clamp.activity) == (False, 1)
    assert clamp.step(sign * 0.5 - sign, 0.001) == pytest.approx(sign * 0.49)
    assert (clamp.limited, clamp.activity) == (True, 2)


@pytest.mark.parametrize('wish', [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_counts_as_nothing(clamp, wish):
    assert at(clamp, 0.3).step(wish, 0.1) == 0.0
    assert clamp.limited
    assert clamp.output == 0.0


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_a_lower_limit_holds_at_once_whatever_the_slew_rate(clamp, sign):
    at(clamp, sign * 0.5)
    clamp.settings = SupervisorSettings(effort_limit=0.2, effort_rate=1.0)
    assert clamp.step(sign * 0.5, 0.001) == sign * 0.2
    at(clamp, 0.0)
    clamp.settings = SETTINGS
    at(clamp, sign * 0.5)
    clamp.settings = SupervisorSettings(effort_limit=0.2, effort_rate=1.0)
    assert clamp.step(-sign * 0.5, 0.001) == sign * 0.2


def test_release_is_at_once(clamp):
    assert at(clamp, 0.4).release() == 0.0
    assert clamp.output == 0.0


def test_the_ramp_takes_its_time_from_full_torque(clamp):
    at(clamp, 0.5)
    assert clamp.ramp_down(0.05) == pytest.approx(0.375)
    assert clamp.ramp_down(0.05) == pytest.approx(0.25)
    assert clamp.output == pytest.approx(0.25)
    assert clamp.ramp_down(0.0) == pytest.approx(0.25)
    assert clamp.ramp_down(-1.0) == pytest.approx(0.25)
    assert clamp.ramp_down(9.0) == 0.0
    assert clamp.ramp_down(0.05) == 0.0


def test_torque_that_releases_goes_at_once(clamp):
    assert at(clamp, -0.3).ramp_down(0.001) == 0.0
    assert clamp.output == 0.0
