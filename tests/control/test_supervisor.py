# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Supervision: every limit in every state, latching, and that nothing unsafe ever comes out."""

from dataclasses import replace
import math

from hypothesis import given, settings, strategies
import pytest

from control.supervised import Bench, BRAKE, DT, in_enabled, STATES
from engb_core.control.causes import Cause, CAUSES, Severity, State
from engb_core.control.final_clamp import FinalClamp
from engb_core.control.supervisor_settings import SupervisorSettings
from engb_core.errors import InputError
from engb_core.model import Cogging, Joint, LoadTorque, Model, Motor


@pytest.mark.parametrize('state', STATES, ids=lambda state: state.value)
def test_the_states_are_reached(state):
    assert STATES[state]().supervisor.state is state


@pytest.mark.parametrize('state', STATES, ids=lambda state: state.value)
@pytest.mark.parametrize(('value', 'cause'), [
    (math.nan, Cause.COMMAND_NOT_FINITE), (math.inf, Cause.COMMAND_NOT_FINITE),
    (-math.inf, Cause.COMMAND_NOT_FINITE), (1e7, Cause.COMMAND_NOT_FINITE),
    (1e300, Cause.COMMAND_NOT_FINITE)])
def test_a_bad_position_command_is_not_taken_in_any_state(state, value, cause):
    bench = STATES[state]()
    before = bench.supervisor.counts[cause]
    assert not bench.controller.on_position_command(bench.now, value)
    assert bench.supervisor.counts[cause] == before + 1
    assert bench.supervisor.active(bench.now) & cause
    torque = bench.state(5)
    assert torque is None or abs(torque) <= 0.5


@pytest.mark.parametrize('state', STATES, ids=lambda state: state.value)
@pytest.mark.parametrize('value', [math.nan, -1e9, 1e9, math.inf])
def test_a_bad_force_command_is_not_taken_in_any_state(state, value):
    bench = STATES[state]()
    assert not bench.controller.on_force_command(bench.now, value)


@pytest.mark.parametrize('state', STATES, ids=lambda state: state.value)
@pytest.mark.parametrize(('sample', 'cause'), [
    ({'position': math.nan}, Cause.STATE_NOT_FINITE),
    ({'position': math.inf}, Cause.STATE_NOT_FINITE),
    ({'stamp': math.nan}, Cause.STATE_NOT_FINITE),
    ({'velocity': -math.inf}, Cause.STATE_NOT_FINITE),
    ({'position': 500.0}, Cause.STATE_JUMP)])
def test_a_bad_joint_state_is_not_used_in_any_state(state, sample, cause):
    bench = STATES[state]()
    before = bench.supervisor.counts[cause]
    setpoint = bench.controller.setpoint
    assert bench.state(**sample) is None
    assert bench.supervisor.counts[cause] == before + 1
    assert bench.controller.setpoint == setpoint


def test_a_jump_of_the_command_is_told_and_taken():
    # An emergency looks like this.
    bench = in_enabled()
    assert bench.controller.on_position_command(bench.now, 6.0 + 20.1)
    assert bench.supervisor.active(bench.now) & Cause.COMMAND_JUMP
    assert bench.controller.source.target == pytest.approx(26.1)


def test_stale_commands_latch_and_hold_until_cleared():
    bench = in_enabled()
    bench.state(int(0.24 / DT))
    assert bench.supervisor.state is State.ENABLED
    bench.state(int(0.03 / DT))
    assert bench.supervisor.latched == Cause.COMMAND_STALE
    held = bench.controller.setpoint.position
    assert not bench.controller.on_position_command(bench.now, 7.0)
    bench.state(200)
    assert bench.controller.setpoint.position == pytest.approx(held, abs=0.2)
    assert bench.supervisor.state is State.FAULT
    assert not bench.controller.clear(bench.now)
    assert bench.supervisor.state is State.READY
    assert bench.commanded(7.0).supervisor.state is State.ENABLED


@pytest.mark.parametrize(('action', 'expected'), [
    ('hold', 6.0), ('ramp_to_zero', 0.0), ('ramp_to_value', 9.0)])
def test_each_stale_action(action, expected):
    bench = Bench(supervisor=SupervisorSettings(stale_action=action), stale_value=9.0).commanded()
    for _ in range(1500):
        bench.position += 0.2 * (bench.controller.setpoint.position - bench.position)
        bench.state()
    assert bench.controller.setpoint.position == pytest.approx(expected, abs=0.01)


def test_without_joint_states_the_torque_ramps_to_zero_in_time():
    bench = Bench().commanded(25.0)
    bench.state(100)
    sent = bench.controller.clamp.output
    assert sent > 0.1
    torques = []
    for _ in range(100):
        bench.now += 0.005
        torques.append(bench.controller.on_tick(bench.now))
    first = next(index for index, torque in enumerate(torques) if torque is not None)
    assert 0.1 < (first + 1) * 0.005 < 0.111   # state_timeout and one tick
    ramp = torques[first:]
    # No faster than from full torque to none in the ramp's time, from the first tick on.
    steps = [earlier - later for earlier, later in zip([sent, *ramp], ramp, strict=False)]
    assert all(0.0 <= step <= 0.5 * 0.005 / 0.2 + 1e-12 for step in steps)
    assert ramp[int(0.2 / 0.005) + 1] == 0.0
    assert bench.supervisor.state is State.FAULT
    bench.state(20)   # they come back: latched all the same
    assert bench.controller.clamp.output == 0.0
    assert bench.supervisor.state is State.FAULT
    assert not bench.controller.clear(bench.now)
    assert bench.commanded().supervisor.state is State.ENABLED


def test_clearing_while_the_condition_lasts_does_nothing():
    bench = in_enabled()
    bench.now += 1.0
    bench.controller.on_tick(bench.now)
    assert bench.controller.clear(bench.now) & Cause.STATE_STALE
    assert bench.supervisor.state is State.FAULT


def test_before_the_first_sample_nothing_has_failed():
    bench = Bench()
    for _ in range(1000):
        bench.now += 0.005
        assert bench.controller.on_tick(bench.now) is None
    assert bench.supervisor.state is State.READY
    assert bench.supervisor.active(bench.now) & Cause.STATE_STALE


def test_who_comes_later_is_silent_who_was_first_goes_on():
    late, first = in_enabled(), in_enabled()
    late.controller.on_other_controller(late.now, True, was_first=False)
    assert late.state(10) is None
    assert late.supervisor.state is State.FAULT
    first.controller.on_other_controller(first.now, True, was_first=True)
    assert first.state(10) is not None
    assert first.supervisor.state is State.DEGRADED
    late.controller.on_other_controller(late.now, False, was_first=False)
    assert not late.controller.clear(late.now)
    assert late.state(3) is not None


def test_a_standby_whose_fault_is_cleared_stays_silent():
    bench = in_enabled()
    bench.controller.silent = True
    bench.supervisor.set(Cause.STATE_STALE, True, bench.now)
    assert bench.state(3) is None
    assert not bench.controller.clear(bench.now, speak=False)
    assert bench.state(3) is None
    bench.supervisor.set(Cause.STATE_STALE, True, bench.now)
    bench.supervisor.set(Cause.STATE_STALE, False, bench.now)
    assert not bench.controller.clear(bench.now)
    assert bench.state(3) is not None


def test_jumps_of_the_stamps_do_no_harm():
    bench = in_enabled()
    before = bench.controller.clamp.output
    for jump in (1e6, -1e6, 0.5, -0.5):
        torque = bench.state(1, stamp=bench.now + jump)
        assert torque is None or abs(torque - before) < 0.2
    assert bench.supervisor.counts[Cause.CLOCK_JUMP] >= 2
    assert bench.state(3) is not None


def test_a_lasting_tracking_error_degrades():
    bench = Bench().commanded(30.0)
    for _ in range(200):
        bench.controller.on_position_command(bench.now, 30.0 if bench.now else 0.0)
        bench.state(2)
    assert bench.supervisor.state is State.DEGRADED
    assert bench.supervisor.active(bench.now) & Cause.TRACKING_ERROR


def test_every_cause_is_described():
    assert set(CAUSES) == set(Cause)
    assert all(info.meaning and info.reaction and isinstance(info.severity, Severity)
               for info in CAUSES.values())


anything = strategies.floats(allow_nan=True, allow_infinity=True)
usual = strategies.floats(-60.0, 60.0)


@settings(max_examples=150, deadline=None)
@given(strategies.lists(strategies.one_of(
    strategies.tuples(strategies.just('state'), strategies.one_of(anything, usual),
                      strategies.one_of(anything, usual), anything,
                      strategies.floats(0.0, 0.3)),
    strategies.tuples(strategies.just('position'), strategies.one_of(anything, usual)),
    strategies.tuples(strategies.just('force'), strategies.one_of(
        anything, strategies.floats(0.0, 9000.0))),
    strategies.tuples(strategies.just('disc'), anything),
    strategies.tuples(strategies.just('tick'), strategies.floats(0.0, 0.5)),
    strategies.tuples(strategies.just('clear')),
    strategies.tuples(strategies.just('other'), strategies.booleans(), strategies.booleans()),
), max_size=60))
def test_whatever_happens_the_torque_is_finite_within_limits_and_faults_stay(events):
    bench = Bench()
    for kind, *given_values in events:
        latched = bench.supervisor.latched
        controller, torque = bench.controller, None
        if kind == 'state':
            position, velocity, effort, wait = given_values
            bench.now += wait
            torque = controller.on_state(bench.now, bench.now, position, velocity, effort)
        elif kind == 'position':
            controller.on_position_command(bench.now, *given_values)
        elif kind == 'force':
            controller.on_force_command(bench.now, *given_values)
        elif kind == 'disc':
            controller.on_disc_speed(bench.now, *given_values)
        elif kind == 'tick':
            bench.now += given_values[0]
            torque = controller.on_tick(bench.now)
        elif kind == 'other':
            controller.on_other_controller(bench.now, *given_values)
        else:
            controller.clear(bench.now)
        if torque is not None:
            assert math.isfinite(torque)
            assert abs(torque) <= 0.5
        if kind != 'clear':
            assert bench.supervisor.latched & latched == latched
            assert not (latched and bench.supervisor.state is not State.FAULT)
        assert math.isfinite(controller.setpoint.position)


@given(strategies.lists(strategies.tuples(anything, strategies.floats(0.0, 1.0)), max_size=50))
def test_the_final_clamp_lets_nothing_through(wishes):
    clamp = FinalClamp(SupervisorSettings(effort_limit=0.4, effort_rate=10.0))
    before = 0.0
    for wish, dt in wishes:
        sent = clamp.step(wish, dt)
        assert math.isfinite(sent)
        assert abs(sent) <= 0.4
        assert abs(sent - before) <= 10.0 * min(dt, 0.1) + 1e-12
        before = sent


def test_an_identified_model_is_taken_within_bounds_and_without_a_jump():
    bench = in_enabled()
    bench.position = 6.0
    before = bench.state(200)
    worn = Model(Motor(0.0174, 7.5e-5, 1.2e-3), BRAKE.load_torque, BRAKE.friction)
    bench.controller.accept_model(worn)
    assert bench.state() == pytest.approx(before, abs=0.01)
    assert bench.controller.model is worn
    motor = worn.motor
    for wrong, told in (
            (replace(worn, motor=replace(motor, inertia=3e-4)), 'inertia'),
            (replace(worn, motor=replace(motor, viscous_friction=9e-3)), 'viscous_friction'),
            (replace(worn, friction=replace(worn.friction, coulomb=-0.01)), 'coulomb'),
            (replace(worn, friction=replace(worn.friction, load_gain=0.9)), 'load_gain'),
            (replace(worn, cogging=(Cogging(1.0, 0.5),)), 'cogging'),
            (replace(worn, joint=Joint('wheel')), 'joint'),
            (replace(worn, load_torque=LoadTorque(coefficients=(0.0, 0.1))), 'effort limit')):
        with pytest.raises(InputError, match=told):
            bench.controller.accept_model(wrong)
    assert bench.controller.model is worn
