# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The supervisor by itself: each watchdog's time, what is latched, what a clear takes away.

Times are binary fractions, so that what happens at a boundary does not hang on rounding.
"""

from dataclasses import replace
import math

import pytest

from engb_core.control.causes import Cause, CAUSES, Severity, State, Stop, STOPPING
from engb_core.control.command_arbiter import Command
from engb_core.control.supervisor import Supervisor
from engb_core.control.supervisor_settings import SupervisorSettings

SETTINGS = SupervisorSettings(
    command_timeout=0.25, state_timeout=0.125, observer_timeout=0.5, disc_speed_timeout=0.75,
    largest_error=2.0, error_time=0.25, drive_tolerance=0.125, drive_time=0.0625,
    drive_delay=0.0625, seized_time=0.5)
DT = 1.0 / 64.0
BEGIN = 16.0
LITTLE = 1.0 / 1024.0
UNWATCHED = replace(SETTINGS, observer_timeout=0.0, state_timeout=1e9, command_timeout=1e9)


def started(settings=SETTINGS, **options):
    supervisor = Supervisor(settings)
    for name, value in options.items():
        setattr(supervisor, name, value)
    supervisor.start(BEGIN)
    return supervisor


def commanded(settings=SETTINGS, now=BEGIN, value=6.0):
    supervisor = started(settings)
    assert supervisor.accept_command(now, Command(value), 0.0, 36.0) == value
    return supervisor


def active(supervisor, now=BEGIN):
    return supervisor.active(now)


def word(text):
    """Return a text of its own, as each message brings one."""
    return text.encode().decode()


def test_it_begins_ready_with_nothing_to_say():
    for supervisor in (Supervisor(SETTINGS), started()):
        assert supervisor.state is State.READY
        assert supervisor.stop is None
        assert (supervisor.faults, supervisor.commanded) == (0, False)
        assert supervisor.latched == Cause(0)
        assert supervisor.watch_commands is True
        assert active(supervisor) == Cause(0)
        assert set(supervisor.counts) == set(Cause)
        assert set(supervisor.counts.values()) == {0}
        assert supervisor.settings is SETTINGS


def test_all_watches_use_its_settings():
    supervisor = started()
    new = replace(SETTINGS, command_timeout=9.0)
    supervisor.settings = new
    assert [watch.settings for watch in (supervisor, supervisor.commands, supervisor.states,
                                         supervisor.torques)] == [new] * 4


@pytest.mark.parametrize(('changes', 'watch_commands', 'told'), [
    ({}, True, False), ({'state_timeout': 0.0}, True, True), ({'state_timeout': -1.0}, True, True),
    ({'command_timeout': 0.0}, True, True), ({'command_timeout': -1.0}, True, True),
    ({'command_timeout': 0.0}, False, False), ({'state_timeout': 0.0}, False, True),
    ({'observer_timeout': 0.0, 'disc_speed_timeout': 0.0}, True, False)])
def test_what_is_not_watched_is_told_and_stops_nothing(changes, watch_commands, told):
    supervisor = started(replace(SETTINGS, **changes), watch_commands=watch_commands)
    assert bool(active(supervisor) & Cause.NOT_WATCHED) is told
    assert supervisor.holds(Cause.NOT_WATCHED) is told
    assert active(supervisor, BEGIN + 100.0) == (Cause.NOT_WATCHED if told else Cause(0))
    assert supervisor.state is State.READY
    supervisor.settings = SETTINGS
    supervisor.start(BEGIN)
    assert active(supervisor) == Cause(0)


def test_a_passing_cause_is_shown_for_a_second():
    supervisor = started()
    for count in (1, 2):
        supervisor.note(Cause.STATE_JUMP, BEGIN)
        assert supervisor.counts[Cause.STATE_JUMP] == count
    assert active(supervisor, BEGIN + 1.0) == Cause.STATE_JUMP
    assert active(supervisor, BEGIN + 1.0 + LITTLE) == Cause(0)
    assert not supervisor.holds(Cause.STATE_JUMP)
    assert supervisor.state is State.READY


@pytest.mark.parametrize('cause', Cause)
def test_a_lasting_cause_counts_once_and_a_fault_stays(cause):
    supervisor = started()
    fault = CAUSES[cause].severity is Severity.FAULT
    for _ in range(3):
        supervisor.set(cause, True, BEGIN)
    assert supervisor.counts[cause] == 1
    assert supervisor.holds(cause)
    assert active(supervisor, BEGIN + 5.0) == cause
    assert supervisor.latched == (cause if fault else Cause(0))
    supervisor.set(cause, False, BEGIN + 5.0)
    assert not supervisor.holds(cause)
    assert active(supervisor, BEGIN + 5.0) == (cause if fault else Cause(0))
    supervisor.set(cause, True, BEGIN + 6.0)
    assert supervisor.counts[cause] == 2
    assert supervisor.holds(cause)
    supervisor.start(BEGIN)
    assert (active(supervisor), supervisor.latched) == (Cause(0), Cause(0))


@pytest.mark.parametrize('latch', [True, False])
@pytest.mark.parametrize('cause', [Cause.STATE_STALE, Cause.OBSERVER_STALE, Cause.STATE_JUMP])
def test_the_caller_may_say_whether_it_is_latched(cause, latch):
    supervisor = started()
    supervisor.set(cause, True, BEGIN, latch=latch)
    assert supervisor.holds(cause)
    assert supervisor.latched == (cause if latch else Cause(0))


def test_one_cause_does_not_take_another_away():
    supervisor = started()
    supervisor.set(Cause.DRIVE_WEAK, True, BEGIN)
    supervisor.set(Cause.DRIVE_OFF, True, BEGIN)
    supervisor.set(Cause.OBSERVER_STALE, True, BEGIN)
    supervisor.set(Cause.OBSERVER_STALE, False, BEGIN)
    supervisor.set(Cause.TRACKING_ERROR, False, BEGIN)
    assert supervisor.holds(Cause.DRIVE_WEAK)
    assert supervisor.holds(Cause.DRIVE_OFF)
    assert not supervisor.holds(Cause.OBSERVER_STALE)
    assert not supervisor.holds(Cause.TRACKING_ERROR)


@pytest.mark.parametrize('cause', Cause)
def test_what_degrades(cause):
    supervisor = commanded()
    assert supervisor.state is State.ENABLED
    supervisor.set(cause, True, BEGIN, latch=False)
    degrades = (CAUSES[cause].severity is Severity.DEGRADED or cause is Cause.OTHER_CONTROLLER)
    assert supervisor.state is (State.DEGRADED if degrades else State.ENABLED)
    supervisor.commanded = False
    assert supervisor.state is State.READY
    supervisor.set(cause, True, BEGIN, latch=True)
    assert supervisor.state is State.FAULT


@pytest.mark.parametrize('cause', STOPPING)
def test_each_fault_is_stopped_as_it_is_set(cause):
    for stop in CAUSES[cause].stops:
        supervisor = started(replace(SETTINGS, stops={**SETTINGS.stops, cause: stop}))
        supervisor.set(cause, True, BEGIN, latch=True)
        assert supervisor.stop is stop


def test_the_strictest_stop_counts_and_other_faults_hold():
    supervisor = started()
    supervisor.set(Cause.OTHER_CONTROLLER, True, BEGIN)
    assert supervisor.stop is Stop.HOLD
    supervisor.set(Cause.SHAFT_SEIZED, True, BEGIN)
    assert supervisor.stop is Stop.HOLD
    supervisor.set(Cause.STATE_STALE, True, BEGIN)
    assert supervisor.stop is Stop.RAMP
    supervisor.set(Cause.DRIVE_WRONG, True, BEGIN)
    assert supervisor.stop is Stop.RELEASE


# What a clear leaves though nothing has changed: all but what can only be seen while commands are
# followed or torque is given.
TRIED_ANEW = (Cause.COMMAND_STALE, Cause.OUTPUT_NOT_FINITE, Cause.SHAFT_SEIZED, Cause.DRIVE_OFF)


@pytest.mark.parametrize('cause', [cause for cause, info in CAUSES.items()
                                   if info.severity is Severity.FAULT])
def test_a_clear_takes_away_faults_that_are_gone_or_tried_anew(cause):
    supervisor = commanded()
    supervisor.set(cause, True, BEGIN)
    if cause in TRIED_ANEW:
        assert supervisor.clear(BEGIN) == Cause(0)
        assert not supervisor.holds(cause)
        assert supervisor.state is State.READY
        return
    assert supervisor.clear(BEGIN) == cause == supervisor.latched
    assert supervisor.holds(cause)
    assert supervisor.commanded      # nothing else is forgotten as long as one remains
    supervisor.set(cause, False, BEGIN)
    assert supervisor.latched == cause
    assert supervisor.clear(BEGIN) == Cause(0)
    assert supervisor.faults == 0
    assert supervisor.state is State.READY
    assert supervisor.stop is None


def test_a_clear_leaves_those_that_remain_and_their_conditions():
    supervisor = started()
    for cause in (Cause.STATE_STALE, Cause.COMMAND_STALE, Cause.DRIVE_OFF, Cause.DRIVE_WEAK,
                  Cause.TRACKING_ERROR):
        supervisor.set(cause, True, BEGIN)
    assert supervisor.clear(BEGIN) == Cause.STATE_STALE
    for cause in (Cause.COMMAND_STALE, Cause.DRIVE_OFF, Cause.DRIVE_WEAK, Cause.TRACKING_ERROR):
        assert supervisor.holds(cause)
    supervisor.set(Cause.STATE_STALE, False, BEGIN)
    supervisor.set(Cause.OBSERVER_STALE, True, BEGIN)
    assert supervisor.clear(BEGIN) == Cause(0)
    for cause in (Cause.COMMAND_STALE, Cause.DRIVE_OFF, Cause.DRIVE_WEAK, Cause.TRACKING_ERROR):
        assert not supervisor.holds(cause)
    assert supervisor.holds(Cause.OBSERVER_STALE)


def test_a_clear_begins_the_watches_over_commands_and_torque_anew():
    supervisor = commanded(UNWATCHED)
    for _ in range(20):
        supervisor.torques.asked(0.5, DT)
    supervisor.torque(BEGIN, 0.0, DT)
    supervisor.tracking(BEGIN, 3.0)
    assert supervisor.torques.short
    supervisor.clear(BEGIN + 2.0)
    assert not supervisor.torques.short
    assert supervisor.commands.source is None
    assert supervisor.commands.spoke_at == BEGIN + 2.0
    # The tracking error counts from the next sample on.
    supervisor.tracking(BEGIN + 2.0, 3.0)
    supervisor.tracking(BEGIN + 2.25, 3.0)
    assert not supervisor.holds(Cause.TRACKING_ERROR)


@pytest.mark.parametrize('says', ['refuses', 'holds_on'])
def test_what_the_drive_says_stays_until_it_says_otherwise(says):
    cause = {'refuses': Cause.DRIVE_OFF, 'holds_on': Cause.DRIVE_WRONG}[says]
    other = {'refuses': Cause.DRIVE_WRONG, 'holds_on': Cause.DRIVE_OFF}[says]
    supervisor = started()
    for word in ('obeys', 'off', ''):
        supervisor.drive_state(BEGIN, word)
        assert active(supervisor) == Cause(0)
    # What was said by then is forgotten half a second later, not before.
    for passed, told in ((0.0, False), (0.5 + LITTLE, False), (1.0, True)):
        supervisor.drive_state(BEGIN + passed, says)
        assert supervisor.latched == (cause if told else Cause(0))
    supervisor = started()
    supervisor.drive_state(BEGIN, says)
    supervisor.drive_state(BEGIN + 0.015625, says)
    assert supervisor.latched == cause
    assert not supervisor.holds(other)
    # What is measured takes none of it back.
    supervisor.torque(BEGIN, 0.0, DT)
    assert supervisor.holds(cause)
    assert not supervisor.holds(other)
    assert supervisor.clear(BEGIN) == cause
    assert supervisor.counts[cause] == 1
    supervisor.drive_state(BEGIN, 'obeys')
    assert not supervisor.holds(cause)
    assert supervisor.clear(BEGIN) == Cause(0)
    supervisor.drive_state(BEGIN, says)
    supervisor.drive_state(BEGIN + 0.015625, says)
    supervisor.start(BEGIN)
    supervisor.torque(BEGIN, 0.0, DT)
    supervisor.set(Cause.DRIVE_WEAK, True, BEGIN)
    supervisor.torque(BEGIN, 0.0, DT)
    assert not supervisor.holds(cause)


REFUSES_AND_HOLDS_ON = pytest.mark.parametrize(('says', 'cause'), [
    ('refuses', Cause.DRIVE_OFF), ('holds_on', Cause.DRIVE_WRONG)])


@REFUSES_AND_HOLDS_ON
def test_a_word_counts_once_it_was_kept_up_for_15_ms(says, cause):
    supervisor = Supervisor(SETTINGS)
    for now in (0.0, 0.010):
        supervisor.drive_state(now, word(says))
        assert supervisor.latched == Cause(0)
    supervisor.drive_state(0.015, word(says))
    assert supervisor.latched == cause


@REFUSES_AND_HOLDS_ON
@pytest.mark.parametrize('other', ['obeys', 'off', 'lost', '', 'refuses', 'holds_on'])
def test_a_word_begins_when_it_replaces_another(says, cause, other):
    supervisor = started()
    supervisor.drive_state(BEGIN, word(other))
    supervisor.drive_state(BEGIN + 4.0 * DT, word(says))
    assert supervisor.holds(cause) is (says == other)
    supervisor.drive_state(BEGIN + 5.0 * DT, word(says))
    assert supervisor.latched == cause


@pytest.mark.parametrize('says', ['obeys', 'off', 'lost', '', 'a', 'z', 'refuse', 'refuses it'])
def test_no_other_word_counts_however_long_it_is_kept_up(says):
    supervisor = started()
    for count in range(10):
        supervisor.drive_state(BEGIN + count * DT, word(says))
    assert active(supervisor) == Cause(0)


@REFUSES_AND_HOLDS_ON
def test_a_word_is_kept_up_over_half_a_second_and_no_longer(says, cause):
    for pause, kept_up in ((0.5, True), (0.5 + LITTLE, False)):
        supervisor = started()
        supervisor.drive_state(BEGIN, says)
        supervisor.drive_state(BEGIN + pause, says)
        assert supervisor.holds(cause) is kept_up


@REFUSES_AND_HOLDS_ON
def test_what_the_drive_does_not_say_any_more_holds_no_longer(says, cause):
    supervisor = started(UNWATCHED)
    supervisor.drive_state(BEGIN, says)
    supervisor.drive_state(BEGIN + DT, says)
    for passed in (0.25, 0.5):
        supervisor.watch(BEGIN + DT + passed)
        assert supervisor.holds(cause)
    supervisor.watch(BEGIN + DT + 0.5 + LITTLE)
    assert not supervisor.holds(cause)
    assert supervisor.latched == cause        # until it is cleared
    assert supervisor.clear(BEGIN + 1.0) == Cause(0)
    # One message more is a new beginning.
    supervisor.drive_state(BEGIN + 1.0, says)
    assert not supervisor.holds(cause)


def test_a_drive_that_speaks_well_is_not_made_silent_by_the_watch():
    """Looking at the clock does not begin anew what a drive has begun to say."""
    supervisor = started(UNWATCHED)
    supervisor.drive_state(BEGIN, 'refuses')
    supervisor.watch(BEGIN + DT / 2.0)
    supervisor.drive_state(BEGIN + DT, 'refuses')
    assert supervisor.latched == Cause.DRIVE_OFF


@pytest.mark.parametrize(('asked', 'given', 'cause', 'others'), [
    (0.5, 0.0, Cause.DRIVE_OFF, (Cause.DRIVE_WEAK, Cause.DRIVE_WRONG)),
    (0.5, 0.25, Cause.DRIVE_WEAK, (Cause.DRIVE_OFF, Cause.DRIVE_WRONG)),
    (0.0, 0.5, Cause.DRIVE_WRONG, (Cause.DRIVE_OFF, Cause.DRIVE_WEAK))])
def test_what_is_measured_comes_and_goes(asked, given, cause, others):
    supervisor = started(UNWATCHED)
    for _ in range(40):
        supervisor.torques.asked(asked, DT)
        supervisor.torque(BEGIN, given, DT)
    assert supervisor.holds(cause)
    assert not any(supervisor.holds(other) for other in others)
    assert supervisor.counts[cause] == 1
    # A word from the bridge takes nothing of it back.
    supervisor.drive_state(BEGIN, 'obeys')
    assert supervisor.holds(cause) or cause is Cause.DRIVE_WEAK
    for _ in range(40):
        supervisor.torque(BEGIN, asked, DT)
    assert not supervisor.holds(cause)


def test_what_is_measured_well_ends_all_that_the_drive_was_said_to_do():
    supervisor = started(UNWATCHED)
    for cause in (Cause.DRIVE_WEAK, Cause.DRIVE_OFF, Cause.DRIVE_WRONG):
        supervisor.set(cause, True, BEGIN)
    supervisor.torque(BEGIN, 0.0, DT)
    for cause in (Cause.DRIVE_WEAK, Cause.DRIVE_OFF, Cause.DRIVE_WRONG):
        assert not supervisor.holds(cause)


# How each lasting condition that the supervisor itself judges begins (from BEGIN on) and ends.
def _out_of_range(supervisor, begins):
    for _ in range(2):
        supervisor.angle(BEGIN, 99.0 if begins else 18.0, 0.0, 36.0)


def _refuses(supervisor, begins):
    for count in range(3):
        supervisor.drive_state(BEGIN + count * DT, 'refuses' if begins else 'obeys')


def _seized(supervisor, begins):
    for _ in range(40 if begins else 1):
        supervisor.shaft(BEGIN, 5.0, 3.0 if begins else 0.0, True, DT)


def _tracks_badly(supervisor, begins):
    for now in (BEGIN, BEGIN + 5.0):
        supervisor.tracking(now, 3.0 if begins else 0.0)


def _state_stale(supervisor, begins):
    supervisor.enabled_once = True      # before it is waited for: test_waiting.py
    if begins:
        supervisor.accept_state(BEGIN, 1.0, 5.0, 0.0)
        supervisor.watch(BEGIN + 0.25)
    else:
        supervisor.accept_state(BEGIN + 0.25, 1.25, 5.0, 0.0)


def _observer_stale(supervisor, begins):
    if begins:
        supervisor.watch(BEGIN + 5.0)
    else:
        supervisor.observer_spoke(BEGIN)


def _disc_stale(supervisor, begins):
    supervisor.disc_spoke(BEGIN if begins else BEGIN + 5.0)
    if begins:
        supervisor.watch(BEGIN + 5.0)


def _conflict(supervisor, begins):
    supervisor.commands.rivals = begins
    supervisor.watch(BEGIN + 5.0)


@pytest.mark.parametrize(('cause', 'judge', 'settings'), [
    (Cause.ANGLE_OUT_OF_RANGE, _out_of_range, UNWATCHED),
    (Cause.DRIVE_OFF, _refuses, UNWATCHED), (Cause.SHAFT_SEIZED, _seized, UNWATCHED),
    (Cause.TRACKING_ERROR, _tracks_badly, UNWATCHED),
    (Cause.STATE_STALE, _state_stale, replace(UNWATCHED, state_timeout=0.125)),
    (Cause.OBSERVER_STALE, _observer_stale, replace(UNWATCHED, observer_timeout=0.5)),
    (Cause.DISC_SPEED_STALE, _disc_stale, UNWATCHED),
    (Cause.COMMAND_CONFLICT, _conflict, UNWATCHED)])
@pytest.mark.parametrize('beside', [Cause(0), Cause.FORCE_UNCERTAIN, Cause.OTHER_DRIVE])
def test_each_condition_comes_and_goes_whatever_holds_beside_it(cause, judge, settings, beside):
    supervisor = started(settings)
    if beside:
        supervisor.set(beside, True, BEGIN)
    for count in (1, 2):
        judge(supervisor, True)
        assert supervisor.holds(cause)
        assert supervisor.counts[cause] == count
        judge(supervisor, False)
        assert not supervisor.holds(cause)
        assert supervisor.holds(beside) is bool(beside)


def test_a_cause_counts_whatever_holds_beside_it():
    supervisor = started()
    for cause in (Cause.COMMAND_STALE, Cause.STATE_STALE, Cause.STATE_JUMP):
        supervisor.set(cause, True, BEGIN)
        assert supervisor.counts[cause] == 1


def test_ages_count_from_zero_before_it_is_started():
    supervisor = Supervisor(SETTINGS)
    supervisor.watch(0.125)
    assert not supervisor.holds(Cause.STATE_STALE)
    supervisor.watch(0.125 + LITTLE)
    assert supervisor.holds(Cause.STATE_STALE)


def test_a_joint_state_feeds_its_watchdog():
    supervisor = started()
    supervisor.enabled_once = True
    assert supervisor.accept_state(BEGIN, 1.0, 5.0, 0.0)
    supervisor.watch(BEGIN + 0.125)
    assert active(supervisor, BEGIN + 0.125) == Cause(0)
    supervisor.watch(BEGIN + 0.125 + LITTLE)
    assert supervisor.latched == Cause.STATE_STALE
    assert supervisor.holds(Cause.STATE_STALE)
    # A sample that may not be used feeds nothing.
    assert not supervisor.accept_state(BEGIN + 0.25, 1.0, 5.0, 0.0)
    assert supervisor.holds(Cause.STATE_STALE)
    assert supervisor.accept_state(BEGIN + 0.25, 1.25, 5.0, 0.0)
    assert not supervisor.holds(Cause.STATE_STALE)
    supervisor.watch(BEGIN + 0.375)
    assert not supervisor.holds(Cause.STATE_STALE)
    assert supervisor.latched == Cause.STATE_STALE


def test_before_the_first_joint_state_nothing_has_failed():
    supervisor = started()
    supervisor.watch(BEGIN + 5.0)
    assert supervisor.holds(Cause.STATE_STALE)
    assert supervisor.latched == Cause(0)


@pytest.mark.parametrize('timeout', [0.0, -1.0])
def test_ages_that_are_not_watched(timeout):
    supervisor = commanded(replace(
        SETTINGS, state_timeout=timeout, command_timeout=timeout, observer_timeout=timeout,
        disc_speed_timeout=timeout))
    supervisor.accept_state(BEGIN, 1.0, 5.0, 0.0)
    supervisor.disc_spoke(BEGIN)
    supervisor.watch(BEGIN + 1000.0)
    assert active(supervisor, BEGIN + 1000.0) == Cause.NOT_WATCHED


def test_a_lost_angle_is_a_fault_and_the_angle_is_believed_anew():
    supervisor = started()
    supervisor.accept_state(BEGIN, 0.0, 5.0, 0.0)
    now, used = BEGIN, []
    while not supervisor.faults:
        now += DT
        used.append(supervisor.accept_state(now, now - BEGIN, 300.0, 0.0))
        assert len(used) < 20
    assert used == [False] * 4 + [True]         # after jump_time, 0.05 s
    assert supervisor.latched == Cause.ANGLE_LOST
    assert not supervisor.holds(Cause.ANGLE_LOST)
    assert supervisor.counts[Cause.ANGLE_LOST] == 1
    assert not supervisor.states.lost
    assert supervisor.clear(now) == Cause(0)
    assert supervisor.accept_state(now + DT, now + DT - BEGIN, 300.0, 0.0)


def test_a_jump_feeds_nothing():
    supervisor = commanded(replace(SETTINGS, jump_time=9.0))
    supervisor.accept_state(BEGIN, 0.0, 5.0, 0.0)
    assert not supervisor.accept_state(BEGIN + 0.0625, 0.0625, 300.0, 0.0)
    supervisor.watch(BEGIN + 0.125 + LITTLE)
    assert supervisor.latched == Cause.STATE_STALE


@pytest.mark.parametrize(('position', 'out'), [
    (-2.0, False), (38.0, False), (18.0, False), (-2.0 - LITTLE, True), (38.0 + LITTLE, True)])
def test_the_range_of_the_angle(position, out):
    supervisor = started()
    supervisor.angle(BEGIN, position, 0.0, 36.0)
    assert not supervisor.holds(Cause.ANGLE_OUT_OF_RANGE)   # one sample alone is none
    supervisor.angle(BEGIN, 18.0, 0.0, 36.0)
    supervisor.angle(BEGIN, position, 0.0, 36.0)
    assert not supervisor.holds(Cause.ANGLE_OUT_OF_RANGE)
    supervisor.angle(BEGIN, position, 0.0, 36.0)
    assert supervisor.holds(Cause.ANGLE_OUT_OF_RANGE) is out
    supervisor.angle(BEGIN + 3.0, position, 0.0, 36.0)
    assert supervisor.counts[Cause.ANGLE_OUT_OF_RANGE] == out
    supervisor.angle(BEGIN + 3.0, 18.0, 0.0, 36.0)
    assert not supervisor.holds(Cause.ANGLE_OUT_OF_RANGE)
    assert supervisor.latched == (Cause.ANGLE_OUT_OF_RANGE if out else Cause(0))
    # Shown for a second after it was seen first, if it was no fault.
    supervisor.clear(BEGIN + 3.0)
    assert active(supervisor, BEGIN + 1.5) == Cause(0)


def test_the_disc_speeds_watchdog_begins_with_its_first_message():
    supervisor = started()
    supervisor.watch(BEGIN + 0.125)
    supervisor.watch(BEGIN + 100.0)
    assert not supervisor.holds(Cause.DISC_SPEED_STALE)
    supervisor.disc_spoke(BEGIN + 100.0)
    supervisor.watch(BEGIN + 100.75)
    assert not supervisor.holds(Cause.DISC_SPEED_STALE)
    supervisor.watch(BEGIN + 100.75 + LITTLE)
    assert supervisor.holds(Cause.DISC_SPEED_STALE)
    supervisor.disc_spoke(BEGIN + 101.0)
    assert not supervisor.holds(Cause.DISC_SPEED_STALE)
    supervisor.watch(BEGIN + 101.5)
    assert not supervisor.holds(Cause.DISC_SPEED_STALE)
    supervisor.start(BEGIN + 200.0)
    supervisor.watch(BEGIN + 300.0)
    assert not supervisor.holds(Cause.DISC_SPEED_STALE)


def test_the_observers_watchdog():
    supervisor = started()
    supervisor.watch(BEGIN + 0.5)
    assert not supervisor.holds(Cause.OBSERVER_STALE)
    supervisor.watch(BEGIN + 0.5 + LITTLE)
    assert supervisor.holds(Cause.OBSERVER_STALE)
    supervisor.observer_spoke(BEGIN + 1.0)
    assert not supervisor.holds(Cause.OBSERVER_STALE)
    supervisor.watch(BEGIN + 1.5)
    assert not supervisor.holds(Cause.OBSERVER_STALE)


def test_the_commands_watchdog():
    supervisor = started()
    supervisor.watch(BEGIN + 5.0)
    assert not supervisor.holds(Cause.COMMAND_STALE)      # nobody has commanded yet
    supervisor = commanded()
    supervisor.watch(BEGIN + 0.25)
    assert not supervisor.holds(Cause.COMMAND_STALE)
    supervisor.watch(BEGIN + 0.25 + LITTLE)
    assert supervisor.latched & Cause.COMMAND_STALE
    supervisor = commanded()
    supervisor.watch_commands = False
    supervisor.watch(BEGIN + 5.0)
    assert not supervisor.holds(Cause.COMMAND_STALE)


def test_a_standby_that_has_been_speaking_takes_over():
    supervisor = started()
    for count in range(32):
        now = BEGIN + count * DT
        if count < 8:
            supervisor.accept_command(now, Command(6.0, source='a'), 0.0, 36.0)
        supervisor.accept_command(now, Command(5.0, source='b'), 0.0, 36.0)
        supervisor.watch(now)
    assert not supervisor.holds(Cause.COMMAND_STALE)
    assert supervisor.commands.source == 'b'


def test_a_refused_source_shows_as_a_conflict_for_less_than_a_second():
    supervisor = commanded(UNWATCHED)
    supervisor.watch(BEGIN)
    assert not supervisor.holds(Cause.COMMAND_CONFLICT)
    assert supervisor.accept_command(BEGIN, Command(5.0, source='b'), 0.0, 36.0) is None
    supervisor.watch(BEGIN + 1.0 - LITTLE)
    assert supervisor.holds(Cause.COMMAND_CONFLICT)
    supervisor.watch(BEGIN + 1.0)
    assert not supervisor.holds(Cause.COMMAND_CONFLICT)
    supervisor.commands.rivals = True
    supervisor.watch(BEGIN + 50.0)
    assert supervisor.holds(Cause.COMMAND_CONFLICT)
    count = supervisor.counts[Cause.COMMAND_CONFLICT]
    supervisor.watch(BEGIN + 51.0)
    assert supervisor.counts[Cause.COMMAND_CONFLICT] == count
    supervisor.commands.rivals = False
    supervisor.watch(BEGIN + 52.0)
    assert not supervisor.holds(Cause.COMMAND_CONFLICT)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_the_tracking_error_has_its_time(sign):
    supervisor = started()
    for error in (1.0, 0.0, 1.5, 2.0):          # small ones, for long
        supervisor.tracking(BEGIN - 9.0, sign * error)
        supervisor.tracking(BEGIN - 1.0, sign * error)
        supervisor.tracking(BEGIN - 0.5, sign * error)
        assert not supervisor.holds(Cause.TRACKING_ERROR)
    supervisor.tracking(BEGIN, sign * 2.0)
    supervisor.tracking(BEGIN + 9.0, sign * 2.0)
    supervisor.tracking(BEGIN + 10.0, sign * 2.5)
    supervisor.tracking(BEGIN + 10.125, sign * 2.5)
    assert not supervisor.holds(Cause.TRACKING_ERROR)
    supervisor.tracking(BEGIN + 10.25, sign * 2.5)
    assert not supervisor.holds(Cause.TRACKING_ERROR)
    supervisor.tracking(BEGIN + 10.25 + LITTLE, sign * 2.5)
    assert supervisor.holds(Cause.TRACKING_ERROR)
    assert supervisor.latched == Cause(0)
    supervisor.tracking(BEGIN + 11.0, sign * 2.0)
    assert not supervisor.holds(Cause.TRACKING_ERROR)
    supervisor.tracking(BEGIN + 11.0, sign * 2.5)
    supervisor.tracking(BEGIN + 11.25, sign * 2.5)
    assert not supervisor.holds(Cause.TRACKING_ERROR)
    supervisor.start(BEGIN + 20.0)
    supervisor.tracking(BEGIN + 20.0, sign * 2.5)
    supervisor.tracking(BEGIN + 20.25, sign * 2.5)
    assert not supervisor.holds(Cause.TRACKING_ERROR)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_a_swing_to_both_sides_is_a_tracking_error(sign):
    supervisor = started()

    def tracks(seconds, error, setpoint=10.0):
        supervisor.tracking(BEGIN + seconds, sign * error, setpoint)
        return not supervisor.holds(Cause.TRACKING_ERROR)

    assert tracks(0.0, 2.5)
    assert tracks(0.125, -2.5)
    assert tracks(0.1875, -3.0)
    assert tracks(0.25, 0.0)
    assert not tracks(0.3125, 2.5)
    assert not tracks(0.375, 0.0)              # on its way to the other side
    assert not tracks(0.3125 + 0.25, 0.0)
    assert tracks(0.3125 + 0.25 + LITTLE, 0.0)
    # Once over, it is counted anew.
    assert tracks(0.625, 2.5)
    assert tracks(0.6875, -2.5)
    assert supervisor.counts[Cause.TRACKING_ERROR] == 1
    supervisor.start(BEGIN)
    assert tracks(0.0, 2.5)


def test_one_side_after_the_other_at_another_set_point_is_no_swing():
    supervisor = started()
    for step in range(12):      # steps that are followed, 8 rad up and 8 rad down
        error = 2.5 if step % 2 == 0 else -2.5
        supervisor.tracking(BEGIN + 0.125 * step, error, 10.0 + 8.0 * (step % 2))
        supervisor.tracking(BEGIN + 0.125 * step + 0.0625, 0.0, 10.0 + 8.0 * (step % 2))
        assert not supervisor.holds(Cause.TRACKING_ERROR)


def test_one_side_again_and_again_is_no_swing():
    supervisor = started()
    for step in range(12):
        supervisor.tracking(BEGIN + 0.125 * step, 2.5, 10.0)
        supervisor.tracking(BEGIN + 0.125 * step + 0.0625, 0.0, 10.0)
        assert not supervisor.holds(Cause.TRACKING_ERROR)


def test_a_seized_shaft_is_a_fault_until_it_moves():
    supervisor = started()
    seized = [supervisor.shaft(BEGIN, 5.0, 3.0, True, DT) for _ in range(34)]
    assert seized == [False] * 33 + [True]          # one for the place, 32 are half a second
    assert supervisor.latched == Cause.SHAFT_SEIZED
    assert supervisor.shaft(BEGIN, 5.0, 3.0, True, DT)
    assert supervisor.counts[Cause.SHAFT_SEIZED] == 1
    assert not supervisor.shaft(BEGIN, 9.0, 3.0, True, DT)
    assert not supervisor.holds(Cause.SHAFT_SEIZED)
    assert supervisor.latched == Cause.SHAFT_SEIZED


def test_commands_are_followed_within_their_range():
    supervisor = started()
    assert supervisor.accept_command(BEGIN, Command(math.nan), 0.0, 36.0) is None
    assert not supervisor.commanded
    assert supervisor.accept_command(BEGIN, Command(99.0), 0.0, 36.0) == 36.0
    assert supervisor.commanded is True
    assert supervisor.counts[Cause.COMMAND_OUT_OF_RANGE] == 1
    assert supervisor.accept_command(BEGIN, Command(-1.0), 2.0, 36.0) == 2.0


def test_in_a_fault_only_a_source_that_has_been_speaking_is_listened_to():
    supervisor = started()
    supervisor.set(Cause.OTHER_CONTROLLER, True, BEGIN)
    heard = [supervisor.accept_command(BEGIN + count * DT, Command(6.0), 0.0, 36.0)
             for count in range(18)]
    # 16 periods are the quarter of a second that a source must have been speaking.
    assert heard == [None] * 16 + [6.0] * 2
    assert not supervisor.commanded
    assert supervisor.state is State.FAULT


def test_starting_anew_forgets_all_that_was_watched():
    supervisor = commanded()
    supervisor.accept_state(BEGIN, 0.0, 5.0, 0.0)
    for _ in range(40):
        supervisor.torques.asked(0.5, DT)
        supervisor.torque(BEGIN, 0.0, DT)
    supervisor.note(Cause.STATE_JUMP, BEGIN + 99.5)
    supervisor.start(BEGIN + 100.0)
    assert active(supervisor, BEGIN + 100.0) == Cause(0)
    assert not supervisor.states.seen
    assert not supervisor.torques.off
    assert supervisor.commands.source is None
    assert supervisor.commands.spoke_at == BEGIN + 100.0
    assert not supervisor.commanded
    supervisor.watch(BEGIN + 100.125)
    assert active(supervisor, BEGIN + 100.125) == Cause(0)
