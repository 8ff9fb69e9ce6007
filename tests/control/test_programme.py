# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A trajectory that was interrupted goes on by an explicit command alone, never by itself."""

import pytest

from control.supervised import Bench, DT
from engb_core.control.causes import Cause, State
from engb_core.control.reference import ReferenceSettings
from engb_core.errors import InputError

STROKES = ReferenceSettings(kind='strokes', slow_speeds=(), amplitudes=(12.0,), stop_time=0.1)


def in_a_stroke(**options):
    """Return a controller in the midst of a stroke, on a motor that obeys."""
    bench = Bench(reference=STROKES, **options)
    bench.position = 0.0
    follow(bench, 0.4)
    assert 1.0 < bench.position < 11.0
    assert bench.supervisor.state is State.ENABLED
    return bench


def follow(bench, seconds):
    """Let time pass; the motor is where the set-point was."""
    for _ in range(round(seconds / DT)):
        bench.state()
        bench.position = bench.controller.setpoint.position


def silent(bench):
    """The drive says nothing for a while: the torque goes."""
    for _ in range(100):
        bench.now += 0.005
        bench.controller.on_tick(bench.now)
    assert bench.supervisor.latched & Cause.STATE_STALE


def stands(bench):
    """Return whether nothing moves for a while that is longer than the whole trajectory."""
    place = bench.position
    follow(bench, 2.0)
    return bench.position == place and bench.supervisor.state is State.READY


@pytest.mark.parametrize('refused', [False, True])
def test_a_clear_after_a_fault_holds_the_position_until_the_trajectory_is_started(refused):
    """It had begun again by itself: who cleared the fault stood beside a brake that moved."""
    bench = in_a_stroke()
    silent(bench)
    follow(bench, 0.1)
    if refused:
        with pytest.raises(InputError, match='a fault is latched'):
            bench.controller.start_reference()
    assert not bench.controller.clear(bench.now)
    assert stands(bench)
    bench.controller.start_reference()
    follow(bench, 0.4)
    assert bench.supervisor.state is State.ENABLED
    assert bench.controller.source.running


def test_a_drive_that_was_started_anew_is_held_where_it_stands():
    bench = in_a_stroke()
    silent(bench)
    bench.position = 0.0
    follow(bench, 0.3)
    assert not bench.controller.clear(bench.now)
    assert stands(bench)


def test_who_yielded_to_another_controller_begins_nothing_when_it_is_cleared():
    bench = in_a_stroke()
    bench.controller.on_other_controller(bench.now, True, False)
    bench.state(5)
    bench.controller.on_other_controller(bench.now, False, False)
    assert not bench.controller.clear(bench.now)
    assert stands(bench)


def test_a_standby_that_takes_over_does_not_begin_the_trajectory_anew():
    bench = Bench(reference=STROKES)
    bench.controller.silent = True
    bench.state(5)
    bench.controller.take_over(bench.now, 0.0)
    assert stands(bench)


def test_activated_anew_it_begins_as_at_the_first_time():
    bench = in_a_stroke()
    bench.position = 0.0
    bench.controller.start(bench.now)
    follow(bench, 0.4)
    assert bench.position > 1.0
