# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""PID: the equation, limits, windup, gain changes, and no NaN in or out."""

import dataclasses
import math

from hypothesis import given, strategies
import pytest

from engb_core.control.pid import ANTIWINDUP_STRATEGIES, Pid, PidGains
from engb_core.errors import InputError

DT = 1e-3


def test_it_is_the_equation():
    pid = Pid(PidGains(p=2.0, i=5.0, d=0.1))
    assert pid.step(0.5, 0.3, DT, 1.0, 0.7) == pytest.approx(2.0 * 0.5 + 0.1 * 0.7 + 0.7)
    assert pid.i_term == pytest.approx(5.0 * 0.5 * DT)


def test_a_step_of_the_set_point_does_not_kick_the_derivative():
    pid = Pid(PidGains(p=1.0, d=10.0))
    pid.step(0.0, 0.0, DT)
    assert pid.step(1.0, 0.0, DT) == pytest.approx(1.0)


def test_the_derivative_is_filtered():
    pid = Pid(PidGains(d=1.0, derivative_filter_time=0.01))
    pid.step(0.0, 0.0, DT)
    outputs = [-pid.step(0.0, 1.0, DT) for _ in range(100)]
    assert outputs[0] == pytest.approx(DT / (DT + 0.01))
    assert outputs[-1] == pytest.approx(1.0, abs=1e-3)


def saturate(strategy, time_constant=0.0):
    """Return how long the output stays up after a long saturation and a change of sign [s]."""
    pid = Pid(PidGains(p=1.0, i=10.0, u_clamp_max=0.5, u_clamp_min=-0.5,
                       antiwindup_strategy=strategy, tracking_time_constant=time_constant))
    for _ in range(3000):
        pid.step(1.0, 0.0, DT)
    steps = 0
    while pid.step(-0.05, 0.0, DT) > 0.0:
        steps += 1
        assert steps < 100_000
    return steps * DT


def test_anti_windup_lets_go_at_once():
    assert saturate('none') > 5.0
    assert saturate('back_calculation') < 1.0
    assert saturate('back_calculation', 0.01) < 0.01
    assert saturate('conditional_integration') < 0.2


def test_limits_hold_with_feedforward():
    pid = Pid(PidGains(p=1.0, u_clamp_max=0.2, u_clamp_min=-0.1))
    assert pid.step(1.0, 0.0, DT, 0.0, 5.0) == 0.2
    assert pid.saturated
    assert pid.step(-9.0, 0.0, DT, 0.0, 1.0) == -0.1


def test_a_change_of_gains_does_not_jump():
    pid = Pid(PidGains(p=2.0, i=1.0, d=0.3))
    for _ in range(50):
        before = pid.step(0.4, 0.2, DT, 0.5)
    pid.set_gains(PidGains(p=7.0, i=3.0, d=0.01))
    assert pid.step(0.4, 0.2, DT, 0.5) == pytest.approx(before, abs=2e-3)


def test_without_integral_gain_what_is_left_fades():
    pid = Pid(PidGains(p=2.0, i=1.0))
    for _ in range(500):
        pid.step(0.4, 0.0, DT)
    pid.set_gains(PidGains(p=0.5))
    for _ in range(5000):
        output = pid.step(0.4, 0.0, DT)
    assert output == pytest.approx(0.2, abs=1e-3)


def test_smooth_start_from_what_the_drive_holds():
    pid = Pid(PidGains(p=1.0, i=1.0))
    pid.reset(0.3)
    assert pid.step(0.0, 0.0, DT) == pytest.approx(0.3)


any_float = strategies.floats(allow_nan=True, allow_infinity=True)


@given(strategies.lists(strategies.tuples(any_float, any_float, any_float, any_float, any_float),
                        max_size=30),
       strategies.sampled_from(ANTIWINDUP_STRATEGIES))
def test_whatever_comes_in_the_output_is_finite_and_within_limits(inputs, strategy):
    pid = Pid(PidGains(p=3.0, i=2.0, d=0.1, u_clamp_max=0.7, u_clamp_min=-0.6, i_clamp_max=0.5,
                       i_clamp_min=-0.5, antiwindup_strategy=strategy))
    for error, velocity, dt, velocity_setpoint, feedforward in inputs:
        output = pid.step(error, velocity, dt, velocity_setpoint, feedforward)
        assert math.isfinite(output)
        assert -0.6 <= output <= 0.7
        assert -0.5 <= pid.i_term <= 0.5
    assert -0.6 <= pid.step(0.1, 0.0, DT) <= 0.7


def test_nan_changes_nothing():
    pid = Pid(PidGains(p=1.0, i=1.0, d=1.0))
    held = pid.step(0.5, 0.1, DT)
    state = dict(vars(pid))
    assert pid.step(math.nan, 0.1, DT) == held
    assert pid.step(0.5, math.inf, DT) == held
    assert pid.step(0.5, 0.1, 0.0) == held
    assert pid.rejected == 3
    assert {**vars(pid), 'rejected': 0} == state


@pytest.mark.parametrize('number', range(4))
def test_beyond_a_billion_each_input_is_a_fault(number):
    def step(value):
        inputs = [0.0, 0.0, 0.0, 0.0]   # error, velocity, its set-point, feedforward
        inputs[number] = value
        pid = Pid(PidGains(p=1.0))
        pid.step(inputs[0], inputs[1], DT, inputs[2], inputs[3])
        return pid.rejected

    assert [step(value) for value in (1e9, -1e9, 1e9 + 0.5, 1e9 - 0.5)] == [1, 1, 1, 0]


def test_a_step_of_more_than_a_second_is_none():
    pid = Pid(PidGains(i=1.0))
    assert pid.step(0.5, 0.0, 1.0) == 0.0
    assert pid.i_term == 0.5
    for dt in (1.0 + 1e-9, 1.5, -DT):
        assert pid.step(0.5, 0.0, dt) == 0.0
    assert (pid.i_term, pid.rejected) == (0.5, 3)


def test_it_begins_with_nothing():
    assert PidGains() == PidGains(p=0.0, i=0.0, d=0.0, save_i_term=False,
                                  derivative_filter_time=0.0)
    pid = Pid(PidGains(i=1.0))
    assert not pid.saturated
    assert pid.gains == PidGains(i=1.0)
    pid.set_gains(PidGains(p=1.0, i=1.0, d=1.0))
    assert pid.i_term == 0.0


def test_a_reset_forgets_error_rate_and_saturation():
    pid = Pid(PidGains(p=1.0, i=1.0, d=1.0, u_clamp_max=0.5))
    pid.step(2.0, -0.7, DT)
    assert pid.saturated
    pid.reset()
    assert (pid.i_term, pid.output, pid.saturated) == (0.0, 0.0, False)
    pid.set_gains(PidGains(p=3.0, i=1.0, d=2.0))
    assert pid.i_term == 0.0


def test_gains_cannot_be_changed_behind_its_back():
    with pytest.raises(dataclasses.FrozenInstanceError):
        PidGains().p = 1.0


@pytest.mark.parametrize(('saved', 'output', 'left'), [
    (True, 0.0, 0.2), (False, 0.0, 0.0), (True, 0.3, 0.3), (True, -0.3, -0.3), (False, 0.3, 0.3)])
def test_the_integral_part_outlives_a_reset_where_it_is_saved(saved, output, left):
    pid = Pid(PidGains(i=1.0, save_i_term=saved))
    pid.i_term = 0.2
    pid.reset(output)
    assert pid.i_term == pid.output == left


def test_the_integral_part_takes_up_a_jump_within_its_limits():
    pid = Pid(PidGains(i=1.0, i_clamp_min=-0.3, i_clamp_max=0.4))
    for torque, left in ((0.1, 0.1), (0.2, 0.3), (-0.15, 0.15), (1.0, 0.4), (-2.0, -0.3)):
        pid.shift_integral(torque)
        assert pid.i_term == pytest.approx(left, abs=1e-15)


def test_limits_of_nought_are_limits():
    pid = Pid(PidGains(p=1.0, u_clamp_max=0.0, i_clamp_min=0.0))
    assert pid.step(1.0, 0.0, DT) == 0.0
    pid = Pid(PidGains(p=1.0, u_clamp_min=0.0, i_clamp_max=0.0))
    assert pid.step(-1.0, 0.0, DT) == 0.0


def test_saturation_is_told_at_both_limits_and_not_between():
    pid = Pid(PidGains(p=1.0, u_clamp_max=0.5, u_clamp_min=-0.5))
    for error, saturated in ((0.2, False), (0.5, False), (0.6, True), (0.1, False), (-0.6, True)):
        pid.step(error, 0.0, DT)
        assert pid.saturated is saturated


def test_an_error_within_the_deadband_is_not_integrated():
    pid = Pid(PidGains(i=2.0, error_deadband=0.1))
    for error, left in ((0.09, 0.0), (-0.05, 0.0), (0.1, 0.2 * DT), (-0.1, 0.0), (0.3, 0.6 * DT)):
        pid.step(error, 0.0, DT)
        assert pid.i_term == pytest.approx(left, abs=1e-15)


@pytest.mark.parametrize(('gains', 'time'), [
    ({'p': 0.5, 'i': 0.5, 'd': 0.02}, math.sqrt(0.02 / 0.5)),   # the root of T_i T_d
    ({'p': 0.5, 'i': 0.25}, 2.0),                               # T_i
    ({'i': 0.5}, 0.1),
    ({'p': 0.5, 'i': 0.5, 'd': 0.02, 'tracking_time_constant': 0.3}, 0.3),
    ({'p': 0.5, 'i': 0.5, 'tracking_time_constant': 1e-4}, DT)])   # to the edge, not beyond
def test_back_calculation_follows_with_its_time_constant(gains, time):
    pid = Pid(PidGains(u_clamp_max=0.25, **gains))
    output = pid.step(0.5, 0.0, DT, 0.0, 1.0)
    raw = 1.0 + 0.5 * gains.get('p', 0.0)
    assert output == 0.25
    assert pid.i_term == pytest.approx((gains['i'] * 0.5 + (0.25 - raw) / time) * DT, rel=1e-12)


@pytest.mark.parametrize(('error', 'feedforward', 'integrates'), [
    (0.02, 0.0, True),      # not saturated
    (0.02, 0.6, False),     # saturated, and the error asks for more
    (-0.02, 0.6, True),     # it asks for less
    (0.0, 0.6, True)])      # it asks for nothing: nothing changes either way
def test_conditional_integration_stops_only_what_winds_up(error, feedforward, integrates):
    # As parameters of a node come: a text of its own, not this module's constant.
    strategy = ''.join(('conditional', '_integration'))
    pid = Pid(PidGains(i=10.0, u_clamp_max=0.5, antiwindup_strategy=strategy))
    pid.step(error, 0.0, DT, 0.0, feedforward)
    assert pid.i_term == (10.0 * error * DT if integrates else 0.0)


def test_back_calculation_is_known_by_its_name():
    strategy = ''.join(('back', '_calculation'))
    pid = Pid(PidGains(i=1.0, u_clamp_max=0.5, antiwindup_strategy=strategy))
    pid.step(0.0, 0.0, DT, 0.0, 1.0)
    assert pid.i_term < 0.0


def test_what_fades_does_so_in_half_a_second_or_the_time_constant():
    for constant, time in ((0.0, 0.5), (0.1, 0.5), (2.0, 2.0)):
        pid = Pid(PidGains(tracking_time_constant=constant))
        pid.i_term = 0.3
        pid.step(0.0, 0.0, DT)
        assert pid.i_term == pytest.approx(0.3 * (1.0 - DT / time), rel=1e-12)
    pid = Pid(PidGains())
    pid.i_term = 0.3
    pid.step(0.0, 0.0, 1.0)   # not beyond nought, however long the step
    assert pid.i_term == 0.0


@pytest.mark.parametrize('wrong', [
    {'p': -1.0}, {'i': math.nan}, {'u_clamp_min': 0.1}, {'i_clamp_max': -0.1},
    {'antiwindup_strategy': 'magic'}, {'derivative_filter_time': math.inf}])
def test_bad_gains_are_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong)).removesuffix('_min')[:7]):
        dataclasses.replace(PidGains(), **wrong)
