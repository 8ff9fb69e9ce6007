# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Every limit of a controller, swept over its values, in every state."""

from dataclasses import replace
import math
import sys

from hypothesis import given, settings, strategies
import pytest

from control.supervised import BRAKE, DT, in_enabled, LIMITS, STATES
from engb_core.control.brake_controller import BrakeController
from engb_core.control.brake_settings import ControllerSettings
from engb_core.control.causes import Cause, State
from engb_core.control.reference import MotionLimiter

in_each_state = pytest.mark.parametrize('state', STATES, ids=lambda state: state.value)
TRACKING = (State.ENABLED, State.DEGRADED)


def limits(**changes):
    """Return the supervisor's settings with other limits, commands never stale."""
    return replace(LIMITS, **{'command_timeout': 0.0, 'largest_command_step': math.inf, **changes})


def faulty(**changes):
    """Return options for a bench; stale commands are what brings it into a fault."""
    return {'supervisor': limits(command_timeout=0.25, **changes)}


@in_each_state
@pytest.mark.parametrize('highest', [8.0, 20.0, 36.0])
@pytest.mark.parametrize('lowest', [-5.0, 0.0, 5.0])
def test_the_range_of_positions(state, lowest, highest):
    bench = STATES[state](position_min=lowest, position_max=highest, **faulty())
    for inside in (lowest, 0.5 * (lowest + highest), highest):
        taken = bench.controller.on_position_command(bench.now, inside)
        assert taken is (state is not State.FAULT)
    before = bench.supervisor.counts[Cause.COMMAND_OUT_OF_RANGE]
    for outside, end in ((highest + 1e-6, highest), (lowest - 1e-6, lowest)):
        # Who asks too much is not silent: the range's end is what he gets.
        taken = bench.controller.on_position_command(bench.now, outside)
        assert taken is (state is not State.FAULT)
        assert not taken or bench.controller.source.target == end
    assert bench.supervisor.counts[Cause.COMMAND_OUT_OF_RANGE] == before + 2


@in_each_state
@pytest.mark.parametrize('highest', [500.0, 4000.0, 8000.0])
def test_the_range_of_forces(state, highest):
    bench = STATES[state](force_max=highest, **faulty())
    for inside in (0.0, 0.5 * highest, highest):
        taken = bench.controller.on_force_command(bench.now, inside)
        assert taken is (state is not State.FAULT)
    for outside in (-1e-6, highest + 1e-3):
        taken = bench.controller.on_force_command(bench.now, outside)
        assert taken is (state is not State.FAULT)


@in_each_state
@pytest.mark.parametrize('largest', [0.5, 3.0, 20.0])
def test_the_step_of_a_command(state, largest):
    bench = STATES[state](position_min=-50.0, position_max=50.0,
                          **faulty(largest_command_step=largest))
    first = 6.0 if state is not State.READY else 30.0   # there no command came before
    count = bench.supervisor.counts[Cause.COMMAND_JUMP]
    taken = bench.controller.on_position_command(bench.now, first)
    assert taken is (state is not State.FAULT)
    bench.controller.on_position_command(bench.now, first + 0.99 * largest)
    bench.controller.on_position_command(bench.now, first)
    assert bench.supervisor.counts[Cause.COMMAND_JUMP] == count
    # It is told and followed: an emergency looks like this.
    taken = bench.controller.on_position_command(bench.now, first - 1.01 * largest)
    assert taken is (state is not State.FAULT)
    assert bench.supervisor.counts[Cause.COMMAND_JUMP] == count + 1


@in_each_state
@pytest.mark.parametrize('largest', [10.0, 100.0, 400.0])
@pytest.mark.parametrize('sign', [-1.0, 1.0])
def test_the_speed_of_an_angle(state, largest, sign):
    bench = STATES[state](**faulty(largest_speed=largest))
    count = bench.supervisor.counts[Cause.STATE_JUMP]
    bench.position += sign * 0.99 * largest * DT
    bench.state()
    assert bench.supervisor.counts[Cause.STATE_JUMP] == count
    bench.position += sign * 1.01 * largest * DT
    assert bench.state() is None
    assert bench.supervisor.counts[Cause.STATE_JUMP] == count + 1


@in_each_state
@pytest.mark.parametrize('limit', [0.01, 0.1, 0.5, 0.75])
@pytest.mark.parametrize('rate', [0.5, 20.0, 1000.0])
def test_the_final_clamp(state, limit, rate):
    bench = STATES[state](position_min=-100.0, position_max=100.0,
                          **faulty(effort_limit=limit, effort_rate=rate))
    slowest = max(rate, limit / bench.controller.settings.supervisor.ramp_time)
    before = bench.controller.clamp.output
    for index in range(300):
        # Far off to either side, as a disturbed motor would be.
        bench.position += 0.3 if index // 60 % 2 else -0.3
        if index % 50 == 0:
            bench.controller.on_position_command(bench.now, 0.1 * index)
        sent = bench.state(velocity=(-1) ** index * 200.0)
        if sent is None:
            continue
        assert abs(sent) <= limit
        assert abs(sent - before) <= slowest * DT + 1e-12
        before = sent


@in_each_state
@pytest.mark.parametrize('timeout', [0.05, 0.25, 1.0])
def test_the_age_of_a_command(state, timeout):
    bench = STATES[state](supervisor=limits(command_timeout=timeout))
    if state in TRACKING:
        bench.controller.on_position_command(bench.now, 6.0)
    bench.state(int(0.98 * timeout / DT))
    assert bool(bench.supervisor.latched & Cause.COMMAND_STALE) is (state is State.FAULT)
    bench.state(int(0.02 * timeout / DT) + 2)
    assert bool(bench.supervisor.latched & Cause.COMMAND_STALE) is (state is not State.READY)


@in_each_state
@pytest.mark.parametrize('timeout', [0.02, 0.1, 0.5])
def test_the_age_of_a_joint_state(state, timeout):
    bench = STATES[state](**faulty(state_timeout=timeout))
    bench.controller.on_tick(bench.now + 0.98 * timeout)
    assert not bench.supervisor.holds(Cause.STATE_STALE)
    bench.controller.on_tick(bench.now + 1.02 * timeout)
    assert bench.supervisor.holds(Cause.STATE_STALE)
    # Before the first command it is waited for (test_waiting.py).
    assert bool(bench.supervisor.latched & Cause.STATE_STALE) is (state is not State.READY)
    assert (bench.supervisor.state is State.FAULT) is (state is not State.READY)


@in_each_state
@pytest.mark.parametrize('ramp', [0.02, 0.2, 1.0])
def test_the_ramp_to_no_torque(state, ramp):
    bench = STATES[state](**faulty(ramp_time=ramp))
    bench.controller.clamp.output = 0.4
    bench.now += 0.2   # no joint state for too long
    assert bench.supervisor.settings.state_timeout < 0.2
    bench.controller.on_tick(bench.now)
    bench.controller.clamp.output = 0.4
    torques = []
    while not torques or torques[-1] > 0.0:
        bench.now += DT
        torques.append(bench.controller.on_tick(bench.now))
    # Full torque (0.5) would take the whole ramp; 0.4 takes its part.
    assert len(torques) * DT == pytest.approx(0.8 * ramp, abs=1.5 * DT)


@pytest.mark.parametrize('largest', [0.5, 2.0])
@pytest.mark.parametrize('time', [0.1, 0.5])
def test_the_tracking_error_and_its_time(largest, time):
    bench = in_enabled(supervisor=limits(largest_error=largest, error_time=time))
    # It jammed: the set-point goes away from the angle and stays there.
    bench.controller.on_position_command(bench.now, bench.position + largest - 0.01)
    bench.state(int(2.0 * (time + 0.5) / DT))
    assert bench.supervisor.state is State.ENABLED
    bench.controller.on_position_command(bench.now, bench.position + largest + 0.01)
    bench.state(int(0.9 * time / DT))
    assert bench.supervisor.state is State.ENABLED
    bench.state(int((0.1 * time + 0.3) / DT))
    assert bench.supervisor.state is State.DEGRADED


@given(strategies.lists(strategies.tuples(strategies.floats(-50.0, 50.0),
                                          strategies.floats(0.0, 0.2)), max_size=100),
       strategies.floats(0.1, 100.0), strategies.floats(0.1, 100.0),
       strategies.floats(1.0, 1000.0))
def test_the_limiter_of_motion_keeps_its_limits(course, apply, release, acceleration):
    limiter = MotionLimiter(apply, release, acceleration)
    for target, dt in course:
        position, velocity = limiter.position, limiter.velocity
        found = limiter.step(target, dt)
        assert -release - 1e-9 <= found.velocity <= apply + 1e-9
        assert abs(found.velocity - velocity) <= acceleration * dt + 1e-9
        assert abs(found.position - position) <= max(apply, release) * dt + 1e-9


@settings(deadline=None, max_examples=50)
@given(strategies.floats(-50.0, 50.0), strategies.floats(0.002, 0.02),
       strategies.floats(0.5, 100.0), strategies.floats(5.0, 1000.0))
def test_the_limiter_of_motion_arrives_and_does_not_overshoot(target, dt, speed, acceleration):
    limiter = MotionLimiter(speed, speed, acceleration)
    needed = abs(target) / speed + 2.0 * speed / acceleration + 3.0 * math.sqrt(
        abs(target) / acceleration)
    for _ in range(int(needed / dt) + 200):
        before = abs(target - limiter.position)
        limiter.step(target, dt)
        assert abs(target - limiter.position) <= before + 1e-9
    assert limiter.position == pytest.approx(target, abs=1e-3)


def test_no_array_is_made_in_a_cycle():
    bench = in_enabled(supervisor=limits())
    bench.controller.on_force_command(bench.now, 3000.0)
    bench.state(20)
    arrays = []

    def watch(frame, event, argument):
        code = frame.f_code.co_filename
        if 'numpy' in code or (event == 'c_call' and 'numpy' in str(
                getattr(argument, '__module__', '') or type(argument.__self__).__module__)):
            arrays.append((event, code, getattr(argument, '__name__', argument)))

    sys.setprofile(watch)
    try:
        bench.state(50)
        bench.controller.on_tick(bench.now)
    finally:
        sys.setprofile(None)
    assert not arrays


def test_settings_that_change_while_it_runs_reach_every_part():
    bench = in_enabled(supervisor=limits())
    controller: BrakeController = bench.controller
    wanted = controller.settings
    assert isinstance(wanted, ControllerSettings)
    controller.on_force_command(bench.now, 0.0)
    bench.state(2)
    before = controller.report.position_input
    controller.apply(replace(wanted, supervisor=limits(effort_limit=0.02),
                             force=replace(wanted.force, running_clearance=3.0)))
    controller.on_force_command(bench.now, 0.0)
    assert controller.report.position_input == pytest.approx(before - 1.0)
    assert abs(bench.state(5)) <= 0.02
    assert controller.model is BRAKE
