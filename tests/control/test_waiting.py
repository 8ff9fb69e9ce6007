# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Before the first command a drive that falls silent is waited for; after it, it is a fault.

While a system starts, a drive may say something and then be silent for seconds: others are being
loaded. Nothing was asked of the brake by then, so there is nothing that a user would have to
acknowledge before the first use.
"""

import pytest

from control.supervised import Bench, DT, in_ready, LIMITS
from engb_core.control.causes import Cause, State
from engb_core.errors import InputError

TIMEOUT = LIMITS.state_timeout


def silent(bench, seconds=1.0):
    """Let the drive be silent; return the torques that the watchdog sends meanwhile."""
    torques = []
    for _ in range(round(seconds / 0.005)):
        bench.now += 0.005
        torques.append(bench.controller.on_tick(bench.now))
    return torques


def holds_stale(bench):
    return bench.supervisor.holds(Cause.STATE_STALE)


def test_a_drive_that_falls_silent_before_the_first_command_is_told_and_waited_for():
    bench = in_ready()
    silent(bench)
    assert bench.supervisor.state is State.READY
    assert bench.supervisor.latched == Cause(0)
    assert bench.supervisor.active(bench.now) & Cause.STATE_STALE
    assert bench.supervisor.counts[Cause.STATE_STALE] == 1
    bench.state(100)
    assert not holds_stale(bench)
    assert bench.commanded().supervisor.state is State.ENABLED     # without a clear


def test_the_torque_goes_as_in_the_fault_while_it_waits():
    waits, fails = in_ready(), in_ready()
    fails.supervisor.enabled_once = True
    for bench in (waits, fails):
        bench.controller.clamp.output = 0.4
    torques = silent(waits)
    assert torques == silent(fails)
    assert torques[-1] == 0.0
    assert fails.supervisor.state is State.FAULT
    # One sample, or a few, are no drive yet.
    assert waits.state(round(0.9 * TIMEOUT / DT)) == 0.0
    assert holds_stale(waits)


def test_it_then_holds_the_angle_that_it_finds():
    bench = in_ready()
    silent(bench)
    bench.position = 9.0
    torque = bench.state(round(1.1 * TIMEOUT / DT))
    assert not holds_stale(bench)
    assert bench.controller.setpoint.position == pytest.approx(9.0)
    assert abs(torque) < 0.5
    # No jump of the torque: it begins where it was.
    bench = in_ready()
    bench.controller.clamp.output = 0.0
    silent(bench)
    sent = [bench.state() for _ in range(round(1.2 * TIMEOUT / DT))]
    assert max(map(abs, sent[:round(0.9 * TIMEOUT / DT)])) == 0.0


def test_a_command_is_not_taken_until_joint_states_have_come_without_a_gap():
    bench = in_ready()
    silent(bench)
    for _ in range(3):      # each begins anew
        assert not bench.controller.on_position_command(bench.now, 6.0)
        bench.state(round(0.9 * TIMEOUT / DT))
        assert not bench.controller.on_position_command(bench.now, 6.0)
        silent(bench, 2.0 * TIMEOUT)
    assert bench.supervisor.state is State.READY
    bench.state(round(1.1 * TIMEOUT / DT))
    assert bench.controller.on_position_command(bench.now, 6.0)
    assert bench.supervisor.state is State.ENABLED


def test_a_first_sample_that_comes_late_is_held_at_once_but_not_commanded_yet():
    bench = Bench()
    silent(bench)
    assert bench.state() is not None
    assert not holds_stale(bench)
    assert not bench.controller.on_position_command(bench.now, 6.0)
    bench.state(round(1.1 * TIMEOUT / DT))
    assert bench.controller.on_position_command(bench.now, 6.0)


def test_a_reference_does_not_begin_while_it_waits():
    bench = in_ready()
    silent(bench)
    with pytest.raises(InputError, match='joint states'):
        bench.controller.start_reference()


def test_a_clear_while_it_waits_changes_nothing():
    bench = in_ready()
    silent(bench)
    assert bench.controller.clear(bench.now) == Cause(0)
    assert holds_stale(bench)
    assert not bench.controller.on_position_command(bench.now, 6.0)


@pytest.mark.parametrize('cleared', [False, True])
def test_once_it_was_enabled_a_silent_drive_is_latched(cleared):
    bench = in_ready().commanded()
    if cleared:
        silent(bench)
        bench.state(3)
        assert not bench.controller.clear(bench.now)
        assert bench.supervisor.state is State.READY
    silent(bench)
    bench.state(100)
    assert bench.supervisor.latched & Cause.STATE_STALE
    assert bench.supervisor.state is State.FAULT


def test_who_took_over_a_torque_has_been_enabled():
    bench = in_ready()
    bench.controller.silent = True
    bench.controller.take_over(bench.now, 0.2)
    silent(bench)
    bench.state(100)
    assert bench.supervisor.latched == Cause.STATE_STALE


def test_activated_anew_it_waits_again():
    bench = in_ready().commanded()
    bench.controller.start(bench.now)
    bench.state(3)
    silent(bench)
    bench.state(100)
    assert bench.supervisor.latched == Cause(0)


def test_another_fault_is_latched_while_it_waits_and_clearing_it_waits_on():
    bench = in_ready()
    bench.controller.clamp.output = 0.4
    silent(bench)
    bench.supervisor.set(Cause.DRIVE_WRONG, True, bench.now)
    bench.supervisor.set(Cause.DRIVE_WRONG, False, bench.now)
    assert bench.supervisor.state is State.FAULT
    assert bench.supervisor.latched == Cause.DRIVE_WRONG
    assert bench.controller.clear(bench.now) == Cause(0)
    assert bench.supervisor.state is State.READY
    assert holds_stale(bench)
    assert set(silent(bench)) == {0.0}
    assert not bench.controller.on_position_command(bench.now, 6.0)
    bench.state(round(1.1 * TIMEOUT / DT))
    assert bench.commanded().supervisor.state is State.ENABLED
