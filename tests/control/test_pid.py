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


@pytest.mark.parametrize('wrong', [
    {'p': -1.0}, {'i': math.nan}, {'u_clamp_min': 0.1}, {'i_clamp_max': -0.1},
    {'antiwindup_strategy': 'magic'}, {'derivative_filter_time': math.inf}])
def test_bad_gains_are_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong)).removesuffix('_min')[:7]):
        dataclasses.replace(PidGains(), **wrong)
