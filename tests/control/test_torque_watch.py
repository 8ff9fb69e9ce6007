# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The watch over the drive's torque, sample by sample.

Times are binary fractions, so that what happens at a boundary does not hang on rounding.
"""

from dataclasses import replace
import math

import pytest

from engb_core.control.supervisor_settings import SupervisorSettings
from engb_core.control.torque_watch import TorqueWatch

DT = 1.0 / 64.0
# An eighth of a mean's time for each sample; four samples fill the delay, the fifth goes beyond.
SETTINGS = SupervisorSettings(drive_tolerance=0.1, drive_time=0.125, drive_delay=0.0625,
                              seized_time=1.0)
SIGNS = pytest.mark.parametrize('sign', [1.0, -1.0])


def asked(torque, settings=SETTINGS):
    """Return a watch whose drive has been asked for a torque for longer than it may lag."""
    watch = TorqueWatch(settings)
    for _ in range(10):
        watch.asked(torque, DT)
    return watch


def found(watch):
    """Return what holds now, in a word."""
    names = [name for name in ('off', 'weak', 'wrong') if getattr(watch, name)]
    return ' and '.join(names) or 'well'


def told(watch, torque, count, dt=DT):
    """Return what is found after each of so many equal samples."""
    results = []
    for _ in range(count):
        watch.given(torque, dt)
        results.append(found(watch))
    return results


def test_a_watch_begins_with_nothing_asked_and_nothing_wrong():
    watch = TorqueWatch(SETTINGS)
    assert (found(watch), watch.short, watch.seized) == ('well', False, False)
    assert told(watch, 0.0, 20) == ['well'] * 20
    assert not watch.short


@SIGNS
def test_a_drive_that_obeys_is_well(sign):
    watch = asked(sign * 0.5)
    assert told(watch, sign * 0.5, 30) == ['well'] * 30
    assert not watch.short


@SIGNS
def test_a_drive_without_torque_is_off_once_the_mean_lacks_more_than_the_tolerance(sign):
    watch = asked(sign * 0.5)
    # 0.5·(1 − (7/8)^n) exceeds 0.1 from the second sample on.
    assert told(watch, 0.0, 3) == ['well', 'off', 'off']
    assert watch.short


@SIGNS
def test_a_drive_that_gives_half_is_weak(sign):
    assert told(asked(sign * 0.5), sign * 0.3, 7) == ['well'] * 5 + ['weak'] * 2
    # However soon it is found: what it gives is averaged from nothing.
    assert told(asked(sign * 2.0), sign * 1.0, 2) == ['weak'] * 2


@SIGNS
def test_a_drive_is_off_where_it_gives_less_than_a_tenth(sign):
    assert told(asked(sign * 0.5), sign * 0.02, 40)[-1] == 'off'
    assert told(asked(sign * 0.5), sign * 0.08, 40)[-1] == 'weak'


@SIGNS
def test_a_drive_that_goes_off_is_weak_first(sign):
    watch = asked(sign * 0.5)
    told(watch, sign * 0.5, 60)
    # The first one may be a flaw: the middle one of three counts.
    assert told(watch, 0.0, 7) == ['well', 'well', 'weak', 'weak', 'weak', 'off', 'off']
    assert told(watch, sign * 0.5, 30)[-1] == 'well'


@SIGNS
def test_more_than_was_asked_is_wrong(sign):
    watch = asked(sign * 0.2)
    assert told(watch, sign * 0.7, 2) == ['well', 'wrong']
    assert not watch.short


@SIGNS
def test_torque_the_other_way_round_is_wrong_beyond_the_tolerance(sign):
    assert told(asked(sign * 0.5), -sign * 0.3, 2) == ['well', 'wrong']
    watch = asked(sign * 0.5)
    # Within the tolerance it is noise: what lacks is what was asked, not more.
    assert told(watch, -sign * 0.1, 2) == ['well', 'weak']
    assert told(asked(sign * 0.09375), -sign * 0.1, 40) == ['well'] * 40


@SIGNS
def test_torque_that_nobody_asked_for_is_wrong(sign):
    assert told(asked(0.0), sign * 0.3, 5)[-1] == 'wrong'
    watch = asked(0.0)
    assert told(watch, sign * 0.1, 80) == ['well'] * 80
    # The mean stands at the tolerance: two samples more than that are enough.
    assert told(watch, sign * 0.5, 2) == ['well', 'wrong']


@SIGNS
@pytest.mark.parametrize('size', [0.5, 50.0, 1e5, 1e300])
def test_one_sample_counts_for_nothing_however_large(sign, size):
    for mean in (0.4, 0.6):       # what is right, and as far off as may be
        watch = asked(0.5)
        told(watch, mean, 80)
        assert told(watch, sign * size, 1) == ['well']
        assert not watch.short
        assert told(watch, mean, 80) == ['well'] * 80
        watch.reset()
        assert told(watch, sign * size, 1) == ['well']


@SIGNS
def test_neither_is_more_torque_than_is_taken_away_the_less(sign):
    """What was asked with one sign and what is given with it count by their sizes."""
    watch = asked(-sign * 0.2)
    assert told(watch, -sign * 0.7, 2) == ['well', 'wrong']
    watch = asked(-sign * 0.2)
    assert told(watch, sign * 0.5, 2) == ['well', 'wrong']


@SIGNS
def test_the_drive_may_lag_by_its_delay_and_no_more(sign):
    watch = asked(0.0)
    short = []
    for _ in range(11):
        watch.asked(sign * 0.5, DT)
        watch.given(0.0, DT)
        short.append(watch.short)
    # The old wish counts for the span in which it ended and for one more.
    assert short == [False] * 9 + [True] * 2
    fresh = TorqueWatch(SETTINGS)
    short = []
    for _ in range(11):
        fresh.asked(sign * 0.5, DT)
        fresh.given(0.0, DT)
        short.append(fresh.short)
    assert short == [False] * 9 + [True] * 2


@SIGNS
def test_torque_that_is_taken_back_may_stay_for_the_delay(sign):
    watch = asked(sign * 0.5)
    results = []
    for _ in range(14):
        watch.asked(sign * 0.25, DT)
        watch.given(sign * 0.5, DT)
        results.append(found(watch))
    # 0.25·(1 − (7/8)^n) exceeds 0.1 from the fourth sample beyond.
    assert results == ['well'] * 12 + ['wrong'] + ['wrong']


@SIGNS
def test_the_shortest_wish_may_be_followed(sign):
    watch = asked(sign * 0.5)
    watch.asked(sign * 0.1, DT)
    watch.asked(sign * 0.5, DT)
    watch.given(sign * 0.1, DT)
    assert not watch.short
    watch = asked(sign * 0.1)
    watch.asked(sign * 0.9, DT)
    watch.asked(sign * 0.1, DT)
    assert told(watch, sign * 0.9, 20) == ['well'] * 20


@SIGNS
def test_two_samples_that_are_short_are_told_at_once(sign):
    watch = asked(sign * 0.5)
    watch.given(sign * 0.5, DT)
    watch.given(sign * 0.39, DT)
    assert not watch.short
    watch.given(sign * 0.39, DT)
    assert watch.short
    watch.given(sign * 0.41, DT)
    assert watch.short
    watch.given(sign * 0.41, DT)
    assert not watch.short


def test_a_difference_that_equals_the_tolerance_is_none():
    exact = replace(SETTINGS, drive_tolerance=0.125)
    watch = asked(0.5, exact)
    watch.given(0.375, DT)
    assert not watch.short
    quick = replace(exact, drive_time=DT)
    assert told(asked(0.5, quick), 0.375, 1) == ['well']
    assert told(asked(0.5, quick), 0.625, 1) == ['well']
    assert told(asked(0.5, quick), 0.374, 1) == ['weak']
    assert told(asked(0.5, quick), 0.626, 1) == ['wrong']


def test_the_mean_takes_up_no_more_than_the_whole_difference():
    quick = replace(SETTINGS, drive_time=DT / 2.0)
    assert told(asked(0.5, quick), 0.42, 3) == ['well'] * 3
    assert told(asked(0.5, quick), 0.58, 3) == ['well'] * 3
    # What it gives counts once, too: at a tenth of what lacks it is off, at more it is weak.
    assert told(asked(0.5, quick), 0.03, 1) == ['off']
    assert told(asked(0.5, quick), 0.07, 1) == ['weak']
    assert told(asked(1.0, quick), 0.1, 1) == ['off']
    assert told(asked(1.0, quick), 0.11, 1) == ['weak']


@SIGNS
def test_what_lies_between_the_wishes_of_the_delay_makes_no_credit(sign):
    """Torque within its range is right, however far from the range's ends."""
    watch = TorqueWatch(SETTINGS)
    for torque in (sign * 0.2, sign * 0.9) * 5:
        watch.asked(torque, DT)
        watch.asked(torque, DT)
    assert told(watch, sign * 0.4, 80) == ['well'] * 80
    # 0.5·(1 − (7/8)^n) exceeds 0.1 from the second sample on; the first may be a flaw.
    assert told(watch, sign * 1.4, 3) == ['well', 'well', 'wrong']
    # And short of the range likewise: 0.2·(1 − (7/8)^n) does from the sixth on, and by then it
    # has given less than a tenth.
    watch = TorqueWatch(SETTINGS)
    for torque in (sign * 0.2, sign * 0.9) * 5:
        watch.asked(torque, DT)
        watch.asked(torque, DT)
    assert told(watch, sign * 0.4, 80) == ['well'] * 80
    assert told(watch, 0.0, 8) == ['well'] * 6 + ['off'] * 2


@SIGNS
def test_a_little_more_than_asked_counts_as_that_and_not_as_its_opposite(sign):
    """Below the tolerance nothing is told, yet the mean begins from there."""
    watch = asked(sign * 0.0625)
    assert told(watch, sign * 0.09375, 80) == ['well'] * 80
    # From 0.03125 towards 0.1875: 0.03125 + 0.15625·(1 − (7/8)^n) exceeds 0.1 from the fifth on;
    # from nothing it would from the sixth.
    assert told(watch, sign * 0.25, 8) == ['well'] * 5 + ['wrong'] * 3
    # And it is no credit against a lack: 0.25·(1 − (7/8)^n) exceeds 0.1 from the fourth on.
    watch = asked(sign * 0.0625)
    told(watch, sign * 0.09375, 80)
    for _ in range(10):
        watch.asked(sign * 0.34375, DT)
    assert told(watch, sign * 0.09375, 5) == ['well'] * 3 + ['weak'] * 2


def test_a_late_sample_counts_as_20_ms():
    watch = asked(0.5)
    assert told(watch, 0.0, 2, dt=5.0) == ['well', 'off']
    settings = replace(SETTINGS, drive_time=2.0)
    watch = asked(0.5, settings)
    assert 'off' not in told(watch, 0.0, 20, dt=5.0)
    assert told(watch, 0.0, 10, dt=5.0)[-1] == 'off'


@pytest.mark.parametrize('torque', [math.nan, math.inf, -math.inf])
def test_a_drive_that_measures_nothing_is_not_judged(torque):
    watch = asked(0.5)
    told(watch, 0.0, 10)
    assert told(watch, torque, 1) == ['well']
    assert not watch.short
    # The mean stays: with the next measurement it is as it was.
    assert told(watch, 0.0, 1) == ['off']
    watch = asked(0.2)
    told(watch, 0.9, 10)
    assert told(watch, torque, 1) == ['well']
    watch = asked(0.5)
    told(watch, 0.3, 10)
    assert told(watch, torque, 1) == ['well']


@pytest.mark.parametrize('tolerance', [0.0, -1.0])
def test_without_a_tolerance_nothing_is_judged(tolerance):
    watch = asked(0.5)
    watch.settings = replace(SETTINGS, drive_tolerance=tolerance)
    assert told(watch, 0.0, 10) == ['well'] * 10
    assert not watch.short
    watch.settings = replace(SETTINGS, drive_tolerance=0.015625)
    assert told(watch, 0.0, 2)[-1] == 'off'


def test_reset_forgets_what_was_asked_and_given():
    watch = asked(0.5)
    told(watch, 0.0, 20)
    watch.reset()
    assert (found(watch), watch.short) == ('well', False)
    assert told(watch, 0.0, 5) == ['well'] * 5
    assert not watch.short
    assert told(watch, 0.5, 3) == ['well', 'well', 'wrong']


STANDS = {'position': 5.0, 'error': 2.5, 'full': True, 'dt': DT, 'largest_error': 2.0}


def stands(watch, count, **changes):
    """Return after which of so many equal samples the shaft was seized."""
    seized = []
    for _ in range(count):
        watch.moves(**{**STANDS, **changes})
        seized.append(watch.seized)
    return seized


@pytest.mark.parametrize('error', [2.5, -2.5])
def test_a_shaft_that_stands_at_full_torque_for_longer_than_its_time_is_seized(error):
    # The first sample says where; 64 more are exactly one second.
    watch = TorqueWatch(SETTINGS)
    assert stands(watch, 67, error=error) == [False] * 65 + [True] * 2


@pytest.mark.parametrize('change', [
    {'full': False}, {'error': 2.0}, {'error': -2.0}, {'error': 0.5}, {'position': 5.25},
    {'position': 4.75}])
def test_what_moves_or_need_not_is_not_seized(change):
    watch = TorqueWatch(SETTINGS)
    stands(watch, 70)
    assert stands(watch, 1, **change) == [False]
    # And the second begins anew, from the place where it is now.
    rest = {name: value for name, value in change.items() if name == 'position'}
    assert stands(watch, 66, **rest) == [False] * 64 + [True] * 2


@pytest.mark.parametrize('position', [5.125, 4.875])
def test_what_moves_by_less_than_a_tenth_of_the_largest_error_stands(position):
    watch = TorqueWatch(SETTINGS)
    stands(watch, 60)
    assert stands(watch, 6, position=position)[-1]


def test_a_movement_of_exactly_a_tenth_stands():
    watch = TorqueWatch(SETTINGS)
    options = {'largest_error': 10.0, 'error': 11.0}
    stands(watch, 60, **options)
    assert stands(watch, 6, position=6.0, **options)[-1]


def test_late_samples_count_as_20_ms_for_a_shaft_too():
    watch = TorqueWatch(SETTINGS)
    assert stands(watch, 50, dt=7.0) == [False] * 50
    assert stands(watch, 3, dt=7.0)[-1]


def test_without_a_time_no_shaft_is_seized():
    for seconds in (0.0, -1.0):
        watch = TorqueWatch(replace(SETTINGS, seized_time=seconds))
        assert not any(stands(watch, 100))
    watch = TorqueWatch(replace(SETTINGS, seized_time=0.5))
    assert stands(watch, 34) == [False] * 33 + [True]


def test_a_set_point_that_was_taken_back_begins_anew():
    watch = TorqueWatch(SETTINGS)
    stands(watch, 60)
    watch.moved()
    assert stands(watch, 66) == [False] * 65 + [True]
    watch.reset()
    assert not watch.seized
    assert stands(watch, 66) == [False] * 65 + [True]
