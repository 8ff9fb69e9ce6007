# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The loop on the plant: what feedforward and observer are worth; faults stay harmless."""

from dataclasses import replace
import math

import numpy as np
import pytest

from engb_core.bench.virtual_brake import DriveSettings, VirtualBrake
from engb_core.control.loop import LoopSettings, PositionLoop
from engb_core.control.pid import PidGains
from engb_core.control.reference import MotionLimiter, ReferenceSettings, ReferenceSource
from engb_core.control.trajectory import identification_strokes, Setpoint
from engb_core.errors import InputError
from engb_core.model import Model
from engb_ros.files import TRUE_BRAKE

BRAKE = Model.read(TRUE_BRAKE)
NOMINAL = Model(BRAKE.motor)
GAINS = PidGains(0.4, 1.5, 0.006, 0.75, -0.75, 0.5, -0.5)
STROKES = identification_strokes([34.0], acceleration=80.0, stop=0.5)


def tracking(model, **settings):
    """Return the tracking error of a high-load stroke (n,) [rad]."""
    loop = PositionLoop(model, LoopSettings(GAINS, **settings))
    brake = VirtualBrake(BRAKE, DriveSettings(rate=1000.0))
    errors = []
    measured = brake.advance()
    while measured.time < STROKES.duration:
        setpoint = STROKES.at(measured.time)
        brake.command(loop.step(*measured[:4], setpoint))
        measured = brake.advance()
        errors.append(setpoint.position - measured.position)
    return np.array(errors)


def rms(errors):
    return float(np.sqrt(np.mean(errors**2)))


def test_the_identified_feedforward_makes_tracking_several_times_better():
    nominal, identified = tracking(NOMINAL), tracking(BRAKE)
    assert rms(identified) < 0.3 * rms(nominal)
    assert np.abs(identified).max() < 0.4 * np.abs(nominal).max()


def test_the_observer_makes_up_for_what_the_model_lacks():
    assert rms(tracking(NOMINAL, disturbance_compensation=True)) < 0.5 * rms(tracking(NOMINAL))


def test_with_the_right_model_the_observer_finds_nothing():
    loop = PositionLoop(BRAKE, LoopSettings(GAINS, disturbance_compensation=True))
    brake = VirtualBrake(BRAKE)
    measured, found = brake.advance(), []
    while measured.time < STROKES.duration:
        brake.command(loop.step(*measured[:4], STROKES.at(measured.time)))
        measured = brake.advance()
        found.append(loop.disturbance)
    assert rms(np.array(found)) < 0.006


def test_a_velocity_that_the_drive_does_not_give_is_derived():
    loop = PositionLoop(BRAKE, LoopSettings(GAINS))
    brake = VirtualBrake(BRAKE)
    measured = brake.advance()
    while measured.time < STROKES.duration:
        brake.command(loop.step(measured.time, measured.position, math.nan, math.nan,
                                STROKES.at(measured.time)))
        measured = brake.advance()
    assert abs(measured.position) < 0.05


def test_faulty_samples_change_nothing():
    loop = PositionLoop(BRAKE, LoopSettings(GAINS))
    for index in range(100):
        held = loop.step(1e-3 * index, 0.0, 0.0, 0.0, Setpoint(0.05))
    for sample in ((0.1, math.nan, 0.0), (0.1, 0.0, math.inf), (math.nan, 0.0, 0.0),
                   (0.099, 5.0, 5.0), (0.05, 5.0, 5.0)):
        assert loop.step(*sample, 0.0, Setpoint(0.05)) == held
    # A torque that cannot be computed is none: the one of before must not stand for it.
    assert math.isnan(loop.step(0.1, 0.0, 0.0, 0.0, Setpoint(math.nan)))
    assert loop.step(0.101, 0.0, 0.0, 0.0, Setpoint(0.05)) == pytest.approx(held, rel=0.1)


def test_a_jump_of_the_clock_integrates_nothing():
    loop = PositionLoop(NOMINAL, LoopSettings(GAINS))
    loop.step(0.0, 0.0, 0.0, 0.0, Setpoint(0.5))
    loop.step(1e6, 0.0, 0.0, 0.0, Setpoint(0.5))
    loop.step(5.0, 0.0, 0.0, 0.0, Setpoint(0.5))
    assert abs(loop.pid.i_term) < 1e-5
    loop.step(5.001, 0.0, 0.0, 0.0, Setpoint(0.5))
    assert loop.pid.i_term == pytest.approx(1.5 * 0.5 * 1e-3, rel=0.01)


def test_gains_change_without_a_jump_while_it_runs():
    loop = PositionLoop(NOMINAL, LoopSettings(GAINS))
    for index in range(200):
        before = loop.step(1e-3 * index, 0.1, 0.0, 0.0, Setpoint(0.2))
    loop.set_settings(LoopSettings(replace(GAINS, p=0.9)))
    assert loop.step(0.2, 0.1, 0.0, 0.0, Setpoint(0.2)) == pytest.approx(before, abs=1e-3)


def test_the_motion_limiter_keeps_its_limits_and_does_not_overshoot():
    limiter = MotionLimiter(20.0, 40.0, 300.0)
    limiter.reset(1.0)
    path = [limiter.step(30.0, 1e-3) for _ in range(3000)]
    path += [limiter.step(-2.0, 1e-3) for _ in range(3000)]
    position, velocity, acceleration = np.array(path).T
    assert velocity.max() == pytest.approx(20.0)
    assert velocity.min() == pytest.approx(-40.0)
    assert np.abs(acceleration).max() < 300.0 * 1.001
    assert position.max() <= 30.0 + 300.0 * 1e-3**2   # a sample's worth
    assert position[2999] == pytest.approx(30.0, abs=1e-6)
    assert position.min() >= -2.0 - 300.0 * 1e-3**2
    assert position[-1] == pytest.approx(-2.0, abs=1e-6)


def test_a_reference_starts_where_the_motor_stands():
    source = ReferenceSource(ReferenceSettings('strokes', slow_speeds=()))
    setpoint = source.at(10.0, 3.0)
    assert setpoint.position == pytest.approx(3.0)
    path = [source.at(10.0 + 1e-3 * index, 3.0).position for index in range(40000)]
    assert np.abs(np.diff(path)).max() < 0.08
    assert max(path) == pytest.approx(36.0, abs=1e-3)
    assert source.finished


def test_a_trajectory_waits_for_its_request():
    source = ReferenceSource(ReferenceSettings('strokes', start_on_request=True))
    assert [source.at(1e-3 * index, 0.5).position for index in range(500)] == [0.5] * 500
    source.start()
    for index in range(500, 40000):
        source.at(1e-3 * index, 0.5)
    assert source.finished


def test_commands_have_no_trajectory_to_start():
    with pytest.raises(InputError, match='no trajectory'):
        ReferenceSource(ReferenceSettings()).start()
