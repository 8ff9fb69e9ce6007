# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Each way in which torque could be wrong, on the brake: what is done about it, and how soon."""

from collections import deque
from dataclasses import replace
import math

import pytest

from control.supervised import Bench, BRAKE, FORCE, GAINS, in_enabled, LIMITS
from engb_core.bench.virtual_brake import DriveSettings, VirtualBrake
from engb_core.control.brake_controller import BrakeController
from engb_core.control.brake_settings import ControllerSettings
from engb_core.control.causes import Cause, State, Stop
from engb_core.control.command_arbiter import Command
from engb_core.control.final_clamp import FinalClamp
from engb_core.control.loop import LoopSettings
from engb_core.control.supervisor_settings import default_stops, SupervisorSettings
from engb_core.control.velocity_watch import VelocityWatch
from engb_core.errors import InputError
from engb_core.model import Cogging, LoadTorque

DT = 0.001


class Brake:
    """A controller on the simulated brake, with what may lie between them."""

    def __init__(self, model=BRAKE, **options):
        self.brake = VirtualBrake(BRAKE, DriveSettings(rate=1.0 / DT))
        options.setdefault('force', FORCE)
        self.controller = BrakeController(model, ControllerSettings(
            LoopSettings(GAINS), **{'position_max': 40.0, **options}))
        self.now = 100.0
        self.controller.start(self.now)
        self.sent = 0.0
        self.asked = None
        self.offset = 0.0          # the encoder's
        self.stamp = lambda now: now
        self.link = lambda torque: torque
        self.velocity = lambda velocity: velocity   # as the drive tells them
        self.effort = lambda effort: effort
        self.count = 0

    def run(self, seconds):
        """Let time pass; a command comes each 20 ms."""
        for _ in range(round(seconds / DT)):
            measured = self.brake.advance()
            self.now += DT
            self.count += 1
            if self.asked is not None and self.count % 20 == 0:
                self.controller.on_command(
                    self.now, self.asked(self.now) if callable(self.asked) else self.asked)
            torque = self.controller.on_state(
                self.now, self.stamp(self.now), measured.position + self.offset,
                self.velocity(measured.velocity), self.effort(measured.effort))
            if torque is None:
                torque = self.controller.on_tick(self.now)
            if torque is not None:
                self.sent = torque
                given = self.link(torque)
                if given is not None:
                    self.brake.command(given)
        return self

    def at(self, angle):
        self.asked = Command(angle)
        self.run(0.8)
        assert self.angle == pytest.approx(angle, abs=0.3)
        assert self.state is State.ENABLED
        return self

    @property
    def angle(self):
        return self.brake.plant.position

    @property
    def state(self):
        return self.controller.supervisor.state

    def latched(self, cause):
        return bool(self.controller.supervisor.latched & cause)

    def until_no_torque(self, limit):
        """Return after how long no torque is sent [s]."""
        begin = self.now
        while self.sent != 0.0:
            self.run(DT)
            assert self.now - begin < limit
        return self.now - begin


# Stamps.

def test_stamps_that_stand_still_end_in_a_fault_without_torque():
    brake = Brake().at(10.0)
    stood = brake.now
    brake.stamp = lambda now: min(now, stood)
    assert brake.until_no_torque(0.35) < 0.1 + 0.2 + 0.01
    assert brake.latched(Cause.STATE_STALE)
    assert brake.controller.supervisor.active(brake.now) & Cause.STATE_REPEATED
    brake.run(1.0)
    assert -1.0 < brake.angle < 10.5   # it ran to −56 rad once


def test_stamps_of_nought_are_told():
    brake = Brake()
    brake.stamp = lambda now: 0.0
    brake.asked = Command(10.0)
    brake.run(0.3)
    # Of samples that never came in time no loop is closed: they are waited for.
    assert brake.state is State.READY
    assert brake.controller.supervisor.active(brake.now) & Cause.STATE_STALE
    assert brake.sent == 0.0
    brake = Brake().at(10.0)
    brake.stamp = lambda now: 0.0
    brake.run(0.3)
    assert brake.latched(Cause.STATE_STALE)


@pytest.mark.parametrize('step', [-0.09, -0.02, -3600.0, 0.5, 3600.0])
def test_a_clock_that_is_set_stops_nothing_and_is_told(step):
    brake = Brake().at(10.0)
    begin = brake.now
    brake.stamp = lambda now: now + (step if now > begin else 0.0)
    brake.asked = Command(20.0)
    brake.run(0.02)
    assert brake.controller.supervisor.counts[Cause.CLOCK_JUMP] == 1
    before = brake.controller.setpoint.position
    brake.run(0.02)
    assert brake.controller.setpoint.position > before
    brake.run(0.8)
    assert brake.angle == pytest.approx(20.0, abs=0.3)
    assert brake.state is State.ENABLED


# The encoder.

@pytest.mark.parametrize('jump', [-20.0, 5.0, 500.0])
def test_an_angle_that_jumped_and_stays_is_never_believed_by_itself(jump):
    brake = Brake().at(20.0)
    brake.offset = jump
    took = brake.until_no_torque(0.4)
    assert took < 0.05 + 0.2 + 0.01
    assert brake.latched(Cause.ANGLE_LOST)
    brake.run(1.0)
    assert brake.angle < 21.0   # it was driven to 40 rad once
    if jump == 5.0:
        assert not brake.controller.clear(brake.now)   # whoever clears it believes the new angle
        brake.asked = None
        brake.run(0.3)
        assert brake.state is State.READY


def test_a_short_glitch_of_the_angle_changes_nothing():
    brake = Brake().at(20.0)
    for jump in (-20.0, 300.0):
        brake.offset = jump
        brake.run(0.02)
        brake.offset = 0.0
        brake.run(0.1)
        assert brake.state is State.ENABLED
        assert brake.angle == pytest.approx(20.0, abs=0.5)


def test_a_force_stays_through_a_jump_of_the_angle_until_the_torque_goes():
    brake = Brake()
    brake.asked = Command(3000.0, by_force=True)
    brake.run(1.0)
    before = brake.angle
    brake.offset = -20.0
    brake.run(1.0)
    assert brake.latched(Cause.ANGLE_LOST)
    assert brake.angle < before + 0.5   # 3000 N became 6329 N once


def test_an_angle_out_of_its_range_is_a_fault():
    brake = Brake(position_max=15.0).at(14.0)
    brake.link = lambda torque: 0.75   # someone else pushes on
    brake.run(0.5)
    assert brake.latched(Cause.ANGLE_OUT_OF_RANGE | Cause.DRIVE_WRONG)
    assert brake.sent == 0.0


# Requests.

def test_a_ramp_beyond_the_highest_force_does_not_lock_the_brake():
    brake = Brake(force_max=6000.0)
    for index in range(200):
        brake.asked = Command(index * 40.0, by_force=True)
        brake.run(0.02)
    assert brake.state is State.ENABLED
    assert brake.controller.supervisor.counts[Cause.COMMAND_OUT_OF_RANGE]
    assert brake.controller.estimator.force == pytest.approx(6000.0, rel=0.05)
    brake.asked = Command(0.0, by_force=True)
    brake.run(0.8)
    assert brake.controller.estimator.force == 0.0


def test_a_saturated_request_does_not_live_on_when_its_source_falls_silent():
    brake = Brake(force_max=6000.0)
    brake.asked = Command(9500.0, by_force=True)
    brake.run(1.0)
    brake.asked = None
    brake.run(0.3)
    assert brake.latched(Cause.COMMAND_STALE)


def test_after_stale_commands_a_lower_request_passes_but_not_a_single_one_nor_a_higher():
    brake = Brake().at(20.0)
    brake.asked = None
    brake.run(0.4)
    assert brake.latched(Cause.COMMAND_STALE)
    assert not brake.controller.on_position_command(brake.now, 0.0)   # one message removes nothing
    brake.run(0.5)
    assert brake.angle == pytest.approx(20.0, abs=0.3)
    brake.asked = Command(30.0)
    brake.run(1.0)
    assert brake.angle == pytest.approx(20.0, abs=0.3)
    brake.asked = Command(3.0)
    brake.run(1.0)
    assert brake.angle == pytest.approx(3.0, abs=0.3)
    assert brake.state is State.FAULT
    assert not brake.controller.clear(brake.now)
    brake.at(12.0)


# Sources.

def test_of_two_named_sources_the_first_is_obeyed_and_the_second_is_told():
    brake = Brake()
    for index in range(60):
        brake.asked = Command(10.0, source='stack', stamp=index + 1, counter=index)
        brake.run(0.02)
        brake.controller.on_command(brake.now, Command(30.0, source='stranger', stamp=index + 1))
    assert brake.angle == pytest.approx(10.0, abs=0.3)
    assert brake.state is State.DEGRADED
    assert brake.controller.supervisor.active(brake.now) & Cause.COMMAND_CONFLICT


def test_a_second_source_takes_over_when_the_first_falls_silent():
    brake = Brake()
    for index in range(200):
        if index < 60:
            brake.controller.on_command(brake.now, Command(10.0, source='primary'))
        brake.controller.on_command(brake.now, Command(12.0, source='standby'))
        brake.run(0.02)
    assert brake.angle == pytest.approx(12.0, abs=0.3)
    assert not brake.controller.supervisor.faults


def test_only_the_named_source_is_obeyed_where_one_is_named():
    brake = Brake(supervisor=SupervisorSettings(command_source='stack'))
    brake.asked = Command(10.0, source='stranger')
    brake.run(0.5)
    assert brake.state is State.READY
    assert brake.controller.on_command(brake.now, Command(10.0, source='stack'))


def test_two_sources_without_a_name_do_not_swing_the_brake():
    brake = Brake().at(10.0)
    brake.controller.supervisor.commands.rivals = True
    angles = []
    for index in range(100):
        brake.controller.on_position_command(brake.now, 25.0 if index % 2 else 3.0)
        brake.asked = None
        brake.run(0.02)
        angles.append(brake.angle)
    assert max(angles[50:]) - min(angles[50:]) < 0.5   # it swung between both
    assert brake.state is State.DEGRADED


def test_late_and_repeated_commands_are_not_taken():
    brake = Brake()
    controller, now = brake.controller, brake.run(0.01).now
    assert controller.on_command(now, Command(5.0, source='a', stamp=1000, counter=7))
    for command, cause in (
            (Command(9.0, source='a', stamp=1000, counter=8), Cause.COMMAND_REPEATED),
            (Command(9.0, source='a', stamp=2000, counter=7), Cause.COMMAND_REPEATED),
            (Command(9.0, source='a', stamp=2000, counter=8, age=0.3), Cause.COMMAND_LATE),
            (Command(9.0, source='a', stamp=2000, counter=8, age=-0.3), Cause.COMMAND_LATE)):
        assert not controller.on_command(now, command)
        assert controller.supervisor.active(now) & cause
    assert controller.on_command(now, Command(9.0, source='a', stamp=2000, counter=8))


def stamped(value, now, counter=None, ahead=0.0):
    """Return a stamped command of the stack's."""
    return Command(value, source='stack', stamp=int(1e9 * (now + ahead)), age=-ahead,
                   counter=counter)


class Stack:
    """A stack that stamps and, if asked to, counts its commands."""

    def __init__(self, value, counts):
        self.value, self.counter, self.shift = value, 0 if counts else None, 0.0

    def __call__(self, now):
        if self.counter is not None:
            self.counter += 1
        command = stamped(self.value, now + self.shift, self.counter)
        return replace(command, age=0.0)


@pytest.mark.parametrize('counts', [True, False])
@pytest.mark.parametrize(('beyond', 'ahead'), [
    (1, 0.0), (20, 0.0), (10**9, 0.0), (1, 0.2), (20, 0.2), (-3, 0.2)])
def test_one_forged_command_in_the_stacks_name_releases_no_brake(counts, beyond, ahead):
    """Its stamp or counter had made all that the stack sent afterwards a repetition: the brake let
    go for `command_timeout`, and stale commands ended in a fault."""
    brake = Brake()
    stack = brake.asked = Stack(20.0, counts)
    brake.run(1.0)
    assert brake.angle == pytest.approx(20.0, abs=0.3)
    counter = stack.counter + beyond if counts else None
    brake.controller.on_command(brake.now, stamped(0.0, brake.now + 0.001, counter, ahead))
    angles = [brake.run(0.001).angle for _ in range(600)]
    assert min(angles) > 19.0
    assert brake.state is State.ENABLED


def test_a_counter_that_stands_is_a_repetition_whatever_came_before():
    bench = Bench()
    bench.state(3)
    taken = [bench.controller.on_command(bench.now, Command(
        5.0, source='a', stamp=1000 * index, counter=min(index, 3))) for index in range(1, 7)]
    assert taken == [True] * 3 + [False] * 3
    assert not bench.controller.on_command(bench.now, Command(
        5.0, source='a', stamp=1000, counter=1))   # a replay


@pytest.mark.parametrize('back', [0.4, 3600.0])
def test_a_lower_request_goes_through_after_the_clock_was_set_back(back):
    brake = Brake()
    stack = brake.asked = Stack(20.0, True)
    brake.run(1.0)
    stack.shift = -back
    brake.controller.supervisor.commands.clock_was_set()
    brake.run(0.5)
    assert brake.state is State.ENABLED
    stack.value = 5.0
    brake.run(1.0)
    assert brake.angle == pytest.approx(5.0, abs=0.3)


def test_an_angle_and_a_force_of_two_nameless_publishers_do_not_swing_the_brake():
    brake = Brake()
    brake.asked = Command(4000.0, by_force=True)
    brake.run(1.5)
    brake.controller.supervisor.commands.rivals = True
    before, angles = brake.angle, []
    for _ in range(60):
        brake.controller.on_command(brake.now, Command(0.0))
        brake.run(0.02)
        angles.append(brake.angle)
    assert max(angles) - min(angles) < 1.0   # it swung between both
    assert angles[-1] == pytest.approx(before, abs=0.5)
    assert brake.state is State.DEGRADED
    brake.asked = None
    for _ in range(40):   # the one who asked for force is silent: the other one is left
        brake.controller.on_command(brake.now, Command(3.0))
        brake.run(0.02)
    assert brake.angle == pytest.approx(3.0, abs=0.5)


def test_many_names_do_not_fill_the_memory():
    bench = Bench()
    bench.state(3)
    for index in range(1000):
        bench.controller.on_command(bench.now, Command(5.0, source=f'name {index}'))
    assert len(bench.supervisor.commands._sources) <= 16


def test_a_force_without_a_mechanism_is_told():
    bench = Bench(force=None)
    bench.state(3)
    assert not bench.controller.on_force_command(bench.now, 1000.0)
    assert bench.supervisor.active(bench.now) & Cause.FORCE_NOT_CONFIGURED


# The drive.

@pytest.mark.parametrize('effort', [math.nan, math.inf, -1e308])
def test_a_drive_that_tells_no_torque_any_more_is_told(effort):
    """Nothing said that nobody watched any more whether the drive obeys."""
    brake = Brake().at(20.0)
    brake.effort = lambda _: effort
    brake.run(0.05)
    assert brake.state is State.ENABLED   # a few samples without are none
    brake.run(0.1)
    assert brake.state is State.DEGRADED
    assert brake.controller.supervisor.active(brake.now) & Cause.EFFORT_MISSING
    assert brake.angle == pytest.approx(20.0, abs=0.3)
    brake.effort = lambda effort: effort
    brake.run(0.02)
    assert brake.state is State.ENABLED


def test_a_drive_that_is_not_to_be_watched_may_tell_no_torque():
    brake = Brake(supervisor=replace(LIMITS, drive_tolerance=0.0)).at(20.0)
    brake.effort = lambda _: math.nan
    brake.run(0.5)
    assert brake.state is State.ENABLED


@pytest.mark.parametrize('effort', [1e5, -1e5, 5.0, -5.0])
def test_one_wrong_torque_moves_no_contact(effort):
    """In mid-stroke it had made the contact wander by a radian: a clamp force off by a tenth."""
    def contact(spoilt):
        brake = Brake()
        brake.asked = Command(1000.0, by_force=True)
        brake.run(1.5)
        brake.asked = Command(5000.0, by_force=True)
        brake.run(0.25)
        if spoilt:
            brake.effort = lambda _: effort
        brake.run(DT)
        brake.effort = lambda effort: effort
        brake.run(1.0)
        assert brake.state is State.ENABLED
        return brake.controller.estimator.contact_angle

    assert contact(True) == pytest.approx(contact(False), abs=0.02)


VELOCITIES = {'reversed': lambda velocity: -velocity, 'none': lambda _: 0.0,
              'a tenth': lambda velocity: 0.1 * velocity, 'stands': lambda _: 50.0}


@pytest.mark.parametrize('name', VELOCITIES)
def test_a_velocity_that_is_not_that_of_the_angles_is_not_used(name):
    """Reversed, it had driven the brake from 10 rad to −69."""
    brake = Brake().at(10.0)
    brake.velocity = VELOCITIES[name]
    brake.asked = Command(20.0)
    angles, told = [], False
    for _ in range(1000):
        angles.append(brake.run(DT).angle)
        told = told or (brake.controller.supervisor.holds(Cause.VELOCITY_WRONG)
                        and brake.state is State.DEGRADED)
    assert told
    assert min(angles) > 9.0
    assert max(angles) < 21.0
    assert angles[-1] == pytest.approx(20.0, abs=0.3)


def test_a_velocity_in_revolutions_per_minute_ends_in_no_torque_at_the_worst():
    brake = Brake().at(10.0)
    brake.velocity = lambda velocity: 60.0 / math.tau * velocity
    brake.asked = Command(20.0)
    angles = [brake.run(DT).angle for _ in range(1000)]
    assert min(angles) > 5.0
    assert max(angles) < 21.0


@pytest.mark.parametrize('target', [2.0, 36.0])
def test_a_drive_whose_velocity_is_filtered_is_believed(target):
    brake = Brake().at(20.0)
    slow = [0.0]

    def filtered(velocity):   # 30 Hz
        slow[0] += (velocity - slow[0]) * DT * math.tau * 30.0
        return slow[0]
    brake.velocity = filtered
    brake.asked = Command(target)
    brake.run(1.0)
    assert brake.angle == pytest.approx(target, abs=0.3)
    assert not brake.controller.supervisor.counts[Cause.VELOCITY_WRONG]


def test_an_angle_that_is_off_once_does_not_make_a_velocity_wrong():
    brake = Brake().at(20.0)
    brake.offset = 0.39   # as far as `largest_speed` lets it
    brake.run(DT)
    brake.offset = 0.0
    brake.run(0.1)
    assert not brake.controller.supervisor.counts[Cause.VELOCITY_WRONG]


@pytest.mark.parametrize(('bunch', 'period', 'gap', 'arrive_in_bunches', 'tells'), [
    (3, 0.005, 1e-3, True, True), (4, 0.005, 1e-3, True, True), (3, 0.005, 1e-4, False, True),
    (2, 0.005, 1e-3, False, True), (16, 0.001, 3e-4, True, True),
    (2, 0.005, 1e-4, True, False), (8, 0.001, 1e-4, True, False), (16, 0.001, 1e-4, True, False)])
def test_samples_in_bunches_with_stamps_of_when_they_were_read_make_no_wild_velocity(
        bunch, period, gap, arrive_in_bunches, tells):
    """As a USB adapter hands them over. Angles divided by such stamps had discarded the drive's
    true velocity, or had been the loop's own: full torque to and fro, and a fault."""
    brake = Brake()
    waiting, angles, torques, every = [], [], [], round(period / DT)
    base, number = brake.now, 0
    for count in range(3000):
        measured = brake.brake.advance()
        brake.now += DT
        if count % 20 == 0:
            brake.controller.on_command(brake.now, Command(35.0 if count > 1500 else 2.0))
        if count % every == 0:
            if not arrive_in_bunches:
                base = brake.now if number % bunch == 0 else base
                waiting.append((base + gap * (number % bunch), measured))
            else:
                waiting.append((math.nan, measured))
            number += 1
        if len(waiting) == bunch or not arrive_in_bunches:
            for place, (stamp, sample) in enumerate(waiting):
                now = brake.now + (gap * place if arrive_in_bunches else 0.0)
                torque = brake.controller.on_state(
                    now, now if arrive_in_bunches else stamp, sample.position,
                    sample.velocity if tells else math.nan, sample.effort)
                if torque is not None:
                    brake.brake.command(torque)
                    torques.append(torque)
            waiting.clear()
        if count > 1500:
            angles.append(brake.angle)
    assert brake.state is State.ENABLED
    assert not brake.controller.supervisor.counts[Cause.VELOCITY_WRONG]
    assert min(angles) > 1.0
    assert max(angles) < 36.0
    assert angles[-1] == pytest.approx(35.0, abs=0.3)
    # It had been three tenths of the time and more.
    assert sum(abs(torque) > 0.7 for torque in torques) < 0.01 * len(torques)


def delayed(brake, seconds):
    """Let all that the drive tells come so much later, with the stamps of when it comes."""
    samples, advance = deque(maxlen=round(seconds / DT) + 1), brake.brake.advance

    def late():
        samples.append(advance())
        return samples[0]
    brake.brake.advance = late
    return brake


def test_a_short_constant_delay_does_no_harm():
    brake = delayed(Brake(), 0.005)
    for angle in (10.0, 20.0, 5.0):
        brake.at(angle)


@pytest.mark.parametrize('delay', [0.015, 0.02])
def test_a_constant_delay_with_which_the_loop_swings_is_told(delay):
    brake = delayed(Brake().at(10.0), delay)
    brake.asked = Command(20.0)   # at rest friction holds it: it takes a move
    brake.run(2.0)
    assert brake.state is State.DEGRADED
    assert brake.controller.supervisor.holds(Cause.TRACKING_ERROR)


def reversed_angles(brake):
    advance = brake.brake.advance

    def told():
        measured = advance()
        return measured._replace(position=-measured.position, velocity=-measured.velocity)
    brake.brake.advance = told


def reversed_torques(brake):
    brake.link = lambda torque: -torque
    brake.effort = lambda effort: -effort


@pytest.mark.parametrize('starts', [True, False])
@pytest.mark.parametrize('reverse', [reversed_angles, reversed_torques])
def test_what_runs_away_with_a_wrong_sign_ends_without_torque(reverse, starts):
    brake = Brake()
    if not starts:
        brake.at(10.0)
    reverse(brake)
    brake.asked = Command(10.0)
    begin = brake.now
    while brake.state is not State.FAULT:
        brake.run(DT)
        assert brake.now - begin < 0.2
    assert brake.latched(Cause.ANGLE_LOST | Cause.ANGLE_OUT_OF_RANGE)
    brake.until_no_torque(0.25)


def test_the_velocity_of_a_coarse_encoder_is_believed():
    """24 counts a turn, as three Hall sensors at four pole pairs give."""
    count = math.tau / 24.0
    watch = VelocityWatch(25.0)
    wrong, angle, time = False, 0.0, 0.0
    for _ in range(2000):
        time += DT
        angle += 100.0 * DT
        assert watch.step(time, DT, count * math.floor(angle / count), 100.0) == 100.0
        wrong = wrong or watch.wrong
    assert not wrong


def test_a_drive_that_lets_go_is_a_fault_and_finds_no_torque_when_it_comes_back():
    brake = Brake().at(20.0)
    brake.link = lambda torque: 0.0
    brake.run(1.0)
    assert brake.latched(Cause.DRIVE_OFF)
    assert brake.sent == 0.0   # it wound up to full torque once
    brake.link = lambda torque: torque
    brake.run(1.0)
    assert brake.sent == 0.0
    assert not brake.controller.clear(brake.now)
    brake.at(10.0)


def test_a_weak_drive_degrades_and_nothing_winds_up():
    brake = Brake().at(20.0)
    brake.link = lambda torque: 0.4 * torque
    brake.asked = Command(34.0)
    brake.run(1.5)
    assert brake.controller.supervisor.active(brake.now) & Cause.DRIVE_WEAK
    assert brake.state is State.DEGRADED


@pytest.mark.parametrize('link', [lambda torque: -torque - 0.3, lambda torque: 0.6])
def test_a_drive_that_gives_another_torque_is_a_fault(link):
    brake = Brake().at(20.0)
    brake.link = link
    brake.run(0.5)
    assert brake.latched(Cause.DRIVE_WRONG)
    assert brake.sent == 0.0


WORDS = [('refuses', Cause.DRIVE_OFF), ('holds_on', Cause.DRIVE_WRONG)]


def say(brake, word, times):
    """Say something of the drive at a bridge's pace."""
    for _ in range(times):
        brake.controller.on_drive_state(brake.now, word)
        brake.run(0.01)


@pytest.mark.parametrize(('word', 'cause'), WORDS)
def test_what_the_bridge_says_of_its_drive_counts(word, cause):
    brake = Brake().at(10.0)
    say(brake, word, 3)
    assert brake.latched(cause)
    assert brake.controller.clear(brake.now) & cause
    brake.controller.on_drive_state(brake.now, 'obeys')
    assert not brake.controller.clear(brake.now)


@pytest.mark.parametrize(('word', 'cause'), WORDS)
def test_what_the_bridge_says_no_longer_can_be_cleared(word, cause):
    brake = Brake().at(10.0)
    say(brake, word, 3)
    assert brake.controller.clear(brake.now) & cause
    brake.run(0.6)
    assert not brake.controller.clear(brake.now)


@pytest.mark.parametrize(('word', 'cause'), WORDS)
def test_one_word_about_the_drive_releases_no_brake(word, cause):
    brake = Brake().at(10.0)
    for _ in range(3):            # nor does another one, long after
        say(brake, word, 1)
        brake.run(0.6)
        assert not brake.latched(cause)
    say(brake, word, 2)
    assert not brake.latched(cause)


@pytest.mark.parametrize('effort', [1e5, -1e5, 5.0, -5.0, 0.0])
def test_one_measured_torque_releases_no_brake(effort):
    brake = Brake().at(20.0)
    state = brake.controller.on_state(brake.now + 0.5 * DT, brake.now + 0.5 * DT, brake.angle,
                                      0.0, effort)
    assert math.isfinite(state)
    brake.run(0.5)
    assert brake.state is State.ENABLED
    assert brake.angle > 19.0


@pytest.mark.parametrize('pause', [0.0, 0.03])
@pytest.mark.parametrize('shift', [1.5, -1.5, 5.0, -5.0, 10.0, -10.0, 30.0, -60.0])
@pytest.mark.parametrize('ahead', [0.0, 0.02, 0.09, -0.09, 1.0, -1.0, 3600.0])
def test_one_forged_joint_state_releases_no_brake(ahead, shift, pause):
    """Of whatever stamp, also in a pause of the drive's own, which gives room."""
    brake = Brake().at(20.0)
    brake.now += pause
    brake.controller.on_state(brake.now, brake.now + 0.5 * DT + ahead, brake.angle + shift, 0.0,
                              0.0)
    brake.run(0.5)
    assert brake.state is State.ENABLED
    assert brake.angle > 19.0


def test_a_seized_shaft_does_not_keep_full_torque():
    bench = in_enabled(supervisor=replace(LIMITS, command_timeout=0.0))
    bench.controller.on_position_command(bench.now, 30.0)
    assert bench.state(300) == 0.5
    bench.state(800)
    assert bench.supervisor.latched & Cause.SHAFT_SEIZED
    assert abs(bench.state(1500)) < 0.1


def test_nothing_is_integrated_while_the_drive_is_short():
    brake = Brake(supervisor=SupervisorSettings(drive_time=100.0)).at(20.0)
    brake.link = lambda torque: 0.0
    brake.run(0.15)
    before = brake.controller.loop.pid.i_term
    brake.run(0.5)
    assert brake.controller.loop.pid.i_term == before


# Models.

def test_a_model_that_would_brake_otherwise_is_refused():
    bench = in_enabled()
    load = BRAKE.load_torque
    for changes, told in (
            ({'load_torque': replace(load, coefficients=tuple(
                0.1 * value for value in load.coefficients))}, 'the load at'),
            ({'load_torque': replace(load, contact_angle=14.0)}, 'contact begins'),
            ({'load_torque': LoadTorque('sinusoid', amplitude=0.2)}, 'form'),
            ({'motor': replace(BRAKE.motor, torque_constant=0.03)}, 'torque_constant'),
            ({'cogging': (Cogging(1e308, 0.001),)}, 'order'),
            ({'cogging': (Cogging(1.0, 1e-6),) * 3000}, 'harmonics'),
            ({'load_torque': replace(load, coefficients=(0.0, 1e308, 1e308))}, 'finite')):
        with pytest.raises(InputError, match=told):
            bench.controller.accept_model(replace(BRAKE, **changes))
    assert bench.controller.model is BRAKE
    worn = replace(load, contact_angle=7.0, coefficients=tuple(
        1.2 * value for value in load.coefficients))
    bench.controller.accept_model(replace(BRAKE, load_torque=worn))


def test_a_controller_does_not_start_with_a_model_that_has_no_torque():
    with pytest.raises(InputError, match='order'):
        Brake(replace(BRAKE, cogging=(Cogging(1e308, 0.001),)))


# Stops.

@pytest.mark.parametrize('stop', list(Stop))
def test_the_stop_of_a_fault_is_chosen(stop):
    stops = {**default_stops(), Cause.SHAFT_SEIZED: stop}
    bench = in_enabled(supervisor=replace(LIMITS, command_timeout=0.0, stops=stops))
    bench.controller.on_position_command(bench.now, 30.0)
    bench.state(300)
    while not bench.supervisor.latched & Cause.SHAFT_SEIZED:
        before = bench.state()
    after = bench.state(2)
    if stop is Stop.RELEASE:
        assert after == 0.0
    elif stop is Stop.RAMP:
        assert 0.0 < after < before
        assert bench.state(110) == 0.0
    else:
        assert bench.controller.source.target == pytest.approx(bench.position)


def test_a_torque_that_cannot_be_computed_is_a_fault_that_can_be_cleared():
    bench = in_enabled()
    good = bench.controller.loop.torques.torque
    for broken in (lambda setpoint: math.nan, lambda setpoint: math.sin(math.inf)):
        bench.controller.loop.torques.torque = broken
        assert math.isfinite(bench.state())
        assert bench.supervisor.latched & Cause.OUTPUT_NOT_FINITE
        assert bench.state(200) == 0.0
        bench.controller.loop.torques.torque = good
        assert not bench.controller.clear(bench.now)
        bench.commanded(6.0)
        assert bench.supervisor.state is State.ENABLED


# Live changes.

@pytest.mark.parametrize('change', [
    {'load_feedforward': False}, {'friction_feedforward': False}, {'cogging_feedforward': False},
    {'disturbance_compensation': True}, {'disturbance_cutoff': 5.0}])
def test_the_torque_does_not_jump_at_a_live_change(change):
    brake = Brake().at(30.0)
    controller = brake.controller
    before = brake.sent
    for settings in (replace(controller.settings.loop, **change), controller.settings.loop):
        controller.apply(replace(controller.settings, loop=settings))
        brake.run(DT)
        assert brake.sent == pytest.approx(before, abs=0.02)   # 0.19 N·m once
        before = brake.sent


def test_clearing_a_healthy_brake_changes_nothing():
    brake = Brake().at(30.0)
    before = brake.sent
    assert before > 0.1
    assert not brake.controller.clear(brake.now)
    brake.run(DT)
    assert brake.sent == pytest.approx(before, abs=0.02)
    assert brake.state is State.ENABLED


def test_clearing_stale_commands_keeps_the_torque():
    brake = Brake().at(30.0)
    brake.asked = None
    brake.run(0.4)
    before = brake.sent
    assert not brake.controller.clear(brake.now)
    brake.run(DT)
    assert brake.sent == pytest.approx(before, abs=0.02)
    brake.run(0.5)
    assert brake.angle == pytest.approx(30.0, abs=0.5)


def test_a_disc_speed_that_nobody_tells_any_more_counts_as_none():
    brake = Brake()
    brake.controller.on_disc_speed(brake.now, 60.0)
    brake.run(0.4)
    assert not brake.controller.supervisor.holds(Cause.DISC_SPEED_STALE)
    brake.run(0.2)
    assert brake.controller.supervisor.holds(Cause.DISC_SPEED_STALE)
    assert brake.controller.loop.torques.load_ratio == 1.0


def test_torque_that_releases_is_not_ramped_but_gone_at_once():
    clamp = FinalClamp(SupervisorSettings())
    clamp.output = -0.5
    assert clamp.ramp_down(0.004) == 0.0
    clamp.output = 0.5
    assert 0.4 < clamp.ramp_down(0.004) < 0.5


class Shaft:
    """A brake's motor under the torque that is asked for, with the model's load [rad, rad/s]."""

    def __init__(self, bench):
        self.bench, self.angle, self.speed = bench, 0.0, 0.0

    def turn(self, torque, dt):
        """Go on by `dt` [s] under `torque` [N·m]."""
        load = self.bench.controller.loop.torques.load_torque(self.angle)
        friction = 0.004 * math.tanh(self.speed / 0.5)
        self.speed += dt * (torque - load - friction) / BRAKE.motor.inertia
        self.angle += dt * self.speed

    def track(self, target, until, longest=3.0):
        """Track `target` [rad] until a condition on the torque is met; return the torque."""
        bench = self.bench
        for step in range(int(longest / DT)):
            if step % 20 == 0:
                bench.controller.on_position_command(bench.now, target)
            torque = bench.state(position=self.angle, velocity=self.speed)
            if until(torque):
                return torque
            self.turn(torque, DT)
        raise AssertionError('it never came to that')


def test_a_drive_that_falls_silent_in_the_midst_of_a_move_leaves_no_torque_to_a_free_motor():
    """What speeds a motor up holds no load: ramped down unseen it would drive it out of its
    range."""
    bench = Bench(supervisor=replace(LIMITS, largest_command_step=0.0))
    shaft = Shaft(bench)
    shaft.track(30.0, lambda torque: torque > 0.02 and shaft.speed > 5.0)
    assert bench.controller.loop.torques.load_torque(shaft.angle) == 0.0
    bench.now += 0.11   # nothing is heard of the drive
    torque = bench.controller.on_tick(bench.now)
    assert bench.supervisor.stop is Stop.RAMP
    assert torque == pytest.approx(0.0, abs=0.005)


def test_a_drive_that_falls_silent_while_a_load_is_held_is_ramped_down_from_that_load():
    bench = Bench(supervisor=replace(LIMITS, largest_command_step=0.0))
    shaft = Shaft(bench)
    time = bench.now
    torque = shaft.track(30.0, lambda torque: bench.now - time > 2.0)
    load = bench.controller.loop.torques.load_torque(shaft.angle)
    assert load > 0.05
    bench.now += 0.11
    assert bench.controller.on_tick(bench.now) == pytest.approx(torque, abs=0.01)
    bench.now += 0.02
    assert 0.0 < bench.controller.on_tick(bench.now) < torque


@pytest.mark.parametrize('after', [0.1, 0.2, 0.26, 0.3, 0.34, 0.4])
def test_a_computer_that_stalls_once_in_a_move_leaves_the_brake_near_it(after):
    """The drive keeps to the last torque for less than its `command_timeout` of 0.1 s."""
    brake = Brake().at(0.5)
    brake.asked = Command(20.0)
    brake.run(after)
    for _ in range(round(0.09 / DT)):
        brake.brake.advance()
        brake.now += DT
    highest = brake.angle
    for _ in range(round(0.8 / DT)):
        highest = max(highest, brake.run(DT).angle)
    assert highest < 23.0
    assert brake.angle == pytest.approx(20.0, abs=0.3)
    assert brake.state is State.ENABLED
