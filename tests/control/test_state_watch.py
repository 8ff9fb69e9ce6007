# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The watch over joint states, sample by sample."""

import math

import pytest

from engb_core.control.causes import Cause
from engb_core.control.state_watch import StateWatch
from engb_core.control.supervisor_settings import SupervisorSettings

SETTINGS = SupervisorSettings(largest_speed=400.0, jump_time=0.0625)
DT = 1.0 / 64.0     # at 400 rad/s: 6.25 rad
REACH = 6.25


class Feed:
    """A watch, its clocks, and what it has noted."""

    def __init__(self, settings=SETTINGS):
        self.notes = []
        self.watch = StateWatch(settings, lambda cause, now: self.notes.append((cause, now)))
        self.now, self.stamp = 100.0, 1000.0

    def __call__(self, position=0.0, velocity=0.0, passed=DT, waited=None):
        """Feed a sample so much later, by its stamp and by the steady clock."""
        self.stamp += passed
        self.now += passed if waited is None else waited
        self.notes.clear()
        return self.watch.accept(self.now, self.stamp, position, velocity)

    @property
    def told(self):
        assert all(now == self.now for _, now in self.notes)
        return [cause for cause, _ in self.notes]


@pytest.fixture
def feed():
    return Feed()


@pytest.fixture
def steady(feed):
    """One whose mean period is the samples'."""
    for _ in range(400):
        assert feed()
    return feed


def test_the_first_sample_is_believed_wherever_it_is(feed):
    assert not feed.watch.seen
    assert (feed.watch.time, feed.watch.lost) == (0.0, False)
    assert feed(-900.0)
    assert (feed.watch.seen, feed.watch.time, feed.told) == (True, 0.0, [])


@pytest.mark.parametrize(('position', 'velocity', 'stamp'), [
    (math.nan, 0.0, 0.0), (math.inf, 0.0, 0.0), (-math.inf, 0.0, 0.0), (1e6, 0.0, 0.0),
    (-1e6, 0.0, 0.0), (0.0, math.inf, 0.0), (0.0, -1.1e6, 0.0), (0.0, 1.1e6, 0.0),
    (0.0, 0.0, math.nan), (0.0, 0.0, math.inf)])
def test_what_is_no_number_is_no_sample(feed, position, velocity, stamp):
    assert not feed.watch.accept(1.0, stamp, position, velocity)
    assert feed.notes == [(Cause.STATE_NOT_FINITE, 1.0)]
    assert not feed.watch.seen


@pytest.mark.parametrize(('position', 'velocity'), [
    (999_999.0, 0.0), (-999_999.0, 0.0), (0.0, 400.0), (0.0, -400.0), (0.0, math.nan)])
def test_large_numbers_and_no_velocity_are_a_sample(feed, position, velocity):
    assert feed(position, velocity)


@pytest.mark.parametrize('velocity', [400.1, -400.1, 1e6, -1e6])
def test_a_velocity_that_no_motor_has_makes_no_sample(feed, velocity):
    assert not feed(velocity=velocity)
    assert not feed.watch.seen
    feed()
    for _ in range(3):
        assert not feed(velocity=velocity)
        assert feed.told == [Cause.STATE_JUMP]
    assert (feed(), feed.watch.lost) == (True, False)


def test_time_goes_on_by_the_stamps(feed):
    feed()
    assert feed(passed=0.015625, waited=0.0625)
    assert feed(passed=0.0625, waited=0.03125)
    assert feed.watch.time == 0.078125
    assert feed.told == []


def test_a_stamp_that_stands_is_no_new_sample(feed):
    feed()
    for _ in range(20):
        assert not feed(passed=0.0, waited=DT)
        assert feed.told == [Cause.STATE_REPEATED]
    assert feed.watch.time == 0.0
    # The pause until the next one is the stamps' to tell.
    assert feed()
    assert (feed.watch.time, feed.told) == (DT, [])


@pytest.mark.parametrize(('passed', 'waited', 'time'), [
    (-5.0, 0.03125, 0.03125),        # it was set back
    (-0.001, 0.03125, 0.03125),
    (50.0, 0.03125, 0.03125),        # it was set forward
    (0.5, 0.25, 0.25), (0.5, 0.0625, 0.0625),
    (0.25, 0.5, 0.5),                # it stood
    (-5.0, 0.0, 1e-6), (-5.0, -1.0, 1e-6)])
def test_a_clock_that_was_set_is_told_and_the_steady_clock_goes_on(feed, passed, waited, time):
    feed()
    assert feed(passed=passed, waited=waited)
    assert feed.told == [Cause.CLOCK_JUMP]
    assert feed.watch.time == pytest.approx(time)


@pytest.mark.parametrize(('passed', 'waited'), [
    (0.25, 0.25), (0.0625, 5.0), (0.125, 0.0625), (0.25, 0.171875), (0.171875, 0.25),
    (0.09375, 0.0)])
def test_late_samples_are_no_clock_jump(feed, passed, waited):
    feed()
    feed(waited=DT + max(passed - waited, 0.0))   # one that was late itself
    assert feed(passed=passed, waited=waited)
    assert feed.told == []
    assert feed.watch.time == pytest.approx(DT + passed, abs=2e-4)   # clocks may drift


@pytest.mark.parametrize('ahead', [0.005, 0.03125, 0.09375])
def test_one_stamp_that_is_ahead_of_all_before_it_turns_the_loops_time_on_by_a_sample_at_most(
        steady, ahead):
    """A stranger's, 90 ms ahead, had the loop integrate over 94 ms, and follow its reference as
    far on."""
    before = steady.watch.time
    assert steady(passed=0.5 * DT + ahead, waited=0.5 * DT)
    assert steady.watch.time - before <= 1.01 * DT
    assert steady.watch.span <= 1.01 * DT
    steady(passed=0.5 * DT - ahead, waited=0.5 * DT)
    assert steady.watch.time - before <= 2.02 * DT


def test_the_span_is_that_between_two_samples_that_were_used(steady):
    steady(passed=3.0 * DT)
    assert steady.watch.span == 3.0 * DT
    assert not steady(position=50.0)
    assert not steady(position=50.0)
    assert steady(position=0.0)
    assert steady.watch.span == pytest.approx(3.0 * DT, rel=1e-3)


def test_clocks_may_part_by_exactly_a_tenth_of_a_second():
    feed = Feed()
    feed.now = feed.stamp = 0.0
    assert feed(passed=0.0, waited=0.0)
    assert feed.watch.accept(0.1, 0.2, 0.0, 0.0)
    assert feed.notes == []
    feed = Feed()
    feed.now = feed.stamp = 0.0
    feed(passed=0.0, waited=0.0)
    assert feed.watch.accept(5.0, 0.1, 0.0, 0.0)
    assert feed.notes == []


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_an_angle_that_moves_as_fast_as_it_may_is_believed(feed, sign):
    feed()
    for count in range(1, 10):
        assert feed(sign * REACH * count)
    assert not feed(sign * (REACH * 10 + 0.01))
    assert feed.told == [Cause.STATE_JUMP]


def test_a_pause_gives_reach(feed):
    feed()
    assert feed(39.9, passed=0.1, waited=0.1)
    assert not feed(80.1, passed=0.1, waited=0.1)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_one_wild_angle_is_left_out(feed, sign):
    feed()
    assert not feed(sign * 100.0)
    assert feed(0.0)
    assert (feed.told, feed.watch.lost) == ([], False)
    # Back is where it could have gone since it was believed last, two samples ago …
    assert not feed(sign * 100.0)
    assert feed(sign * 2.0 * REACH)
    assert not feed(-sign * 100.0)
    # … and no further.
    assert not feed(sign * 4.0 * REACH + sign * 0.01)
    assert not feed(sign * 500.0)


def test_a_wild_angle_amid_good_ones_is_left_out(steady):
    for _ in range(3):
        assert not steady(100.0)
        assert steady(0.0)
        assert steady(1.0)


def test_what_went_by_before_a_jump_gives_no_reach(feed):
    feed()
    assert not feed(100.0)
    assert not feed(50.0)
    steady = Feed()
    for _ in range(50):
        assert steady()
    assert not steady(100.0)
    assert not steady(50.0)


def test_an_angle_that_jumped_and_stays_is_lost_after_its_time(feed):
    feed()
    results = []
    for _ in range(8):
        assert not feed(100.0)
        assert feed.told == [Cause.STATE_JUMP]
        results.append(feed.watch.lost)
    # The fifth sample is 62.5 ms after the jump, no longer; the sixth is.
    assert results == [False] * 5 + [True] * 3
    # It walks away from there, and is not believed for that.
    assert not feed(95.0)


def test_a_lost_angle_that_jumps_back_is_found_again(feed):
    feed()
    for _ in range(10):
        assert not feed(100.0)
    assert feed.watch.lost
    assert feed(3.0)
    assert (feed.watch.lost, feed.told) == (False, [])
    assert feed(3.0 + REACH)
    # The next jump has its own time.
    assert not feed(100.0)
    assert not feed.watch.lost


def test_an_angle_that_creeps_near_is_not_believed(feed):
    feed()
    assert not feed(7.0)
    assert not feed(6.0)
    assert not feed(5.0)


def test_believing_takes_the_angle_where_it_is(feed):
    feed()
    for _ in range(10):
        feed(100.0)
    feed.watch.believe()
    assert not feed.watch.lost
    assert feed(100.0)
    feed.watch.reset()
    feed(0.0)
    for _ in range(10):
        feed(100.0)
    feed.watch.believe()
    assert not feed(200.0)
    assert feed(100.0)


def test_reset_forgets_the_angle_and_the_clock(feed):
    feed()
    for _ in range(10):
        feed(100.0)
    feed.watch.reset()
    assert (feed.watch.seen, feed.watch.lost, feed.watch.time) == (False, False, 0.0)
    assert feed(-700.0, passed=-900.0)
    assert feed.told == []
    assert feed(-700.0 + REACH)
    assert feed.watch.time == DT


@pytest.mark.parametrize('passed', [1e-9, 0.0005, 0.001])
def test_samples_in_a_burst_are_a_millisecond_apart_at_least(feed, passed):
    feed()
    assert feed(0.399, passed=passed)
    assert not feed(0.399 + 0.411, passed=passed)


@pytest.mark.parametrize(('count', 'reach'), [
    (0, 0.4), (10, 0.4), (18, 0.4), (60, REACH), (400, REACH)])
def test_samples_in_a_burst_may_move_by_the_mean_period(count, reach):
    """Twenty samples and more tell the mean; one in a burst makes it shorter by its own part."""
    period = (count * DT + 1e-4) / (count + 1) if count >= 19 else 0.001
    assert 400.0 * period == pytest.approx(reach, rel=0.03)
    for part, taken in ((0.99, True), (1.01, False)):
        feed = Feed()
        for _ in range(count + 1):
            feed()
        assert feed(400.0 * period * part, passed=1e-4) is taken


def test_a_set_clock_does_not_touch_the_mean_period(steady):
    for _ in range(30):
        assert steady(passed=-1.0, waited=1e-4)
    assert steady(0.98 * REACH * 0.95, passed=1e-4)


def test_a_set_clock_does_not_make_time_go_back(steady):
    begin = steady.watch.taken.time
    for _ in range(30):
        assert steady(passed=-1.0, waited=DT)
    assert steady.watch.taken.time == pytest.approx(begin + 30 * DT)
    assert steady(0.98 * REACH, passed=1e-4)


@pytest.mark.parametrize('ahead', [0.03125, 0.0625, 0.09375])
def test_a_stamp_that_is_ahead_of_all_before_gives_no_room(steady, ahead):
    assert not steady(1.5 * REACH, passed=DT + ahead, waited=DT)
    assert steady.told == [Cause.STATE_JUMP]
    # The true ones, whose stamps lie behind, are believed at once.
    assert steady(0.0, passed=DT - ahead, waited=DT)
    assert steady(REACH)
    assert not steady.watch.lost


def test_a_message_that_was_late_takes_no_room_from_the_next(steady):
    assert steady(0.0, waited=3.0 * DT)
    assert steady(2.5 * REACH, passed=3.0 * DT, waited=DT)


@pytest.mark.parametrize('shift', [0.0625, -0.0625, 50.0, -50.0])
def test_of_a_clock_that_was_set_the_second_sample_is_the_measure(steady, shift):
    assert steady(0.0, passed=DT + shift, waited=DT)
    assert steady(0.0)
    assert steady(2.5 * REACH, passed=3.0 * DT)
    assert not steady(4.5 * REACH, passed=3.0 * DT, waited=DT)


def test_clocks_may_drift_apart(steady):
    for sign in (1.0, -1.0):
        for _ in range(4000):
            assert steady(passed=DT * (1.0 + sign * 5e-4), waited=DT)
        assert steady(2.5 * REACH, passed=3.0 * DT)
        assert not steady(5.5 * REACH, passed=4.0 * DT, waited=DT)
        assert steady(2.5 * REACH, passed=-2.0 * DT, waited=DT)
        for _ in range(10):
            assert steady(2.5 * REACH)
        for part in (1.5, 0.5, 0.0):
            assert steady(part * REACH)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_who_used_the_room_of_a_pause_and_from_whom_the_next_is_back_was_no_drive(steady, sign):
    assert steady(sign * 2.5 * REACH, passed=3.0 * DT)
    assert steady(0.0)
    assert (steady.told, steady.watch.lost) == ([Cause.STATE_JUMP], False)
    assert steady(sign * REACH)
    # That was its only chance: the next jump is one.
    assert not steady(sign * 2.5 * REACH)
    assert not steady(sign * 2.5 * REACH)


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize(('angle', 'back'), [
    (5.0, False), (4.0, False),     # beyond
    (1.3, False), (1.25, True),     # less than half-way back, and half-way
    (-3.95, True), (-4.1, False)])  # as far as the pause and this period reach, and beyond
def test_who_is_back_after_a_pause_is_nearer_to_where_it_was_and_within_reach(
        steady, sign, angle, back):
    assert steady(sign * 2.5 * REACH, passed=3.0 * DT)
    assert steady(sign * angle * REACH) is back
    assert steady.told == [Cause.STATE_JUMP]


@pytest.mark.parametrize('begin', [40.0, -40.0])
def test_who_is_back_is_so_wherever_it_had_been(feed, begin):
    for _ in range(400):
        feed(begin)
    assert feed(begin + 2.5 * REACH, passed=3.0 * DT)
    assert feed(begin + 1.25 * REACH)


def test_from_where_it_is_back_its_reach_counts_anew(steady):
    assert steady(2.5 * REACH, passed=3.0 * DT)
    assert steady(0.0)
    # The very next jump is one: there is nothing left to be back from.
    assert not steady(2.5 * REACH)
    # Two samples later it can be two reaches away, and no further (the mean period is a
    # twentieth longer since the pause).
    assert not steady(2.3 * REACH)
    assert not steady(-100.0)
    assert steady(0.0)
    assert not steady(-100.0)
    assert steady(1.9 * REACH)


def test_the_first_sample_used_no_room_of_a_pause(feed):
    assert feed(100.0)
    assert not feed(0.0)


def test_as_far_as_a_period_reaches_uses_no_room_of_a_pause(feed):
    # The shortest period, 1 ms, is 0.4 rad.
    for part, back in ((0.4, False), (0.41, True)):
        feed = Feed()
        feed()
        assert feed(part, passed=1e-4 if part == 0.4 else 0.0015)
        assert feed(-0.1, passed=1e-4) is back


def test_a_late_message_gives_no_room(steady):
    assert not steady(1.5 * REACH, waited=3.0 * DT)
    assert steady.told == [Cause.STATE_JUMP]


def test_what_is_believed_has_no_past(steady):
    assert steady(2.5 * REACH, passed=3.0 * DT)
    for _ in range(10):
        assert not steady(100.0)
    steady.watch.believe()
    # Back to where it was before is a jump like any other …
    assert not steady(0.0)
    # … and what went by before counts for no reach.
    assert not steady(100.0 - 4.0 * REACH)
    assert steady(100.0 - REACH)


def test_a_jump_without_a_pause_is_one(steady):
    for count in range(1, 5):
        assert steady(0.9 * count * REACH)
    assert not steady(2.0 * REACH)
    assert not steady(2.0 * REACH)


def test_the_next_true_angle_is_believed_after_some_that_walked_away(steady):
    """Each within `largest_speed` of the one before, but sped up as no motor is."""
    steady.watch.acceleration = 0.2 * REACH / DT**2
    for count in (1.0, 2.0, 3.0):
        assert steady(position=0.9 * REACH * count, passed=DT / 8.0)
    assert steady(position=0.0, passed=DT / 8.0)
    assert steady.told == [Cause.STATE_JUMP]
    assert steady(position=0.1)
    assert steady.told == []


def test_what_walks_away_as_a_motor_does_is_where_the_motor_is(steady):
    steady.watch.acceleration = 2.0 * REACH / DT**2
    for count in (1.0, 2.0, 3.0):
        steady.watch.velocity = 0.9 * REACH / DT
        assert steady(position=0.9 * REACH * count)
    assert not steady(position=0.0)


def test_a_lasting_jump_is_not_believed_however_far_the_motor_could_have_gone(steady):
    steady.watch.acceleration = 2.0 * REACH / DT**2
    for _ in range(100):
        assert not steady(position=1.5 * REACH)
    assert steady.watch.lost
    assert steady.watch.in_doubt
