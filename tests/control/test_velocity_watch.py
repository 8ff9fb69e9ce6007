# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The watch over told velocities, sample by sample."""

import math

import pytest

from engb_core.control.velocity_watch import VelocityWatch

DT = 0.004
FASTEST = 20_000.0     # [rad/s²]: 80 rad/s from one sample to the next


class Feed:
    """A watch, and an angle that moves."""

    def __init__(self, tolerance=25.0):
        self.watch = VelocityWatch(tolerance)
        self.watch.acceleration = FASTEST
        self.time = self.angle = 0.0
        for _ in range(3):
            self(0.1)   # the encoder's count is finer than what moves below

    def __call__(self, velocity, moves=0.0, told=None, span=DT):
        """Move at `velocity` for a sample, tell `told`; return what is used [rad/s]."""
        self.time += DT
        self.angle += velocity * DT
        return self.watch.step(self.time, span, self.angle + moves,
                               velocity if told is None else told)


@pytest.fixture
def feed():
    made = Feed()
    for _ in range(100):
        made(10.0)
    return made


@pytest.mark.parametrize('told', [399.0, -399.0, 200.0])
@pytest.mark.parametrize('count', [1, 2, 3, 20])
def test_velocities_that_the_angles_do_not_show_are_not_used_however_many(feed, told, count):
    for _ in range(count):
        assert feed(10.0, told=told) == pytest.approx(10.0)
    assert feed(10.0) == pytest.approx(10.0)


@pytest.mark.parametrize('told', [399.0, 284.0, math.nan])
@pytest.mark.parametrize('moves', [1.5, -1.5])
def test_an_angle_forged_to_match_is_worth_no_more_than_the_motor_can_do(feed, moves, told):
    assert abs(feed(10.0, moves, told=math.copysign(told, moves)) - 10.0) <= FASTEST * DT + 1.0
    assert feed(10.0) == pytest.approx(10.0)


def test_two_in_a_row_whose_angles_and_velocities_agree_are_believed(feed):
    feed(400.0, told=284.0)
    assert feed(400.0, told=399.0) > 300.0


def test_a_change_that_the_motor_can_make_is_used_whatever_the_drives_filter(feed):
    velocity = 10.0
    for _ in range(5):
        velocity += 0.9 * FASTEST * DT
        assert feed(velocity) == velocity


def test_an_end_stop_is_believed_with_the_second_sample():
    feed = Feed()
    for _ in range(100):
        feed(300.0)
    used = [feed(150.0, told=0.0), *(feed(0.0) for _ in range(3))]
    assert used[0] > 200.0
    assert used[1] < 60.0
    assert used[2] == used[3] == 0.0


def test_after_a_pause_there_is_room_for_what_may_have_happened(feed):
    feed.time += 10 * DT
    feed.angle += 0.5 * 300.0 * 10 * DT
    assert feed(300.0, span=11 * DT) == 300.0


def test_a_tolerance_of_nought_uses_what_is_told():
    feed = Feed(0.0)
    for velocity in (10.0, 399.0, -399.0):
        assert feed(10.0, told=velocity) == velocity
    assert not feed.watch.wrong
