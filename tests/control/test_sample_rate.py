# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Joint states that come too seldom for the loop's gains close no loop."""

from dataclasses import replace
import math

import numpy as np
import pytest

from control.supervised import BRAKE, GAINS
from engb_core.bench.virtual_brake import DriveSettings, VirtualBrake
from engb_core.control.brake_controller import BrakeController
from engb_core.control.brake_settings import ControllerSettings
from engb_core.control.causes import Cause, State
from engb_core.control.gain_checks import delay_margin
from engb_core.control.loop import LoopSettings
from engb_core.control.pid import PidGains
from engb_core.control.reference import ReferenceSettings
from engb_core.control.sample_clock import SampleClock
from engb_core.errors import InputError

# Below this rate the shipped gains have no phase margin [Hz].
LOWEST = 1.0 / delay_margin(GAINS, BRAKE.motor)


class Loop:
    """A controller on the simulated brake, whose torque the drive takes up so many samples
    late."""

    def __init__(self, rate, late=0, gains=GAINS, **settings):
        self.period, self.late = 1.0 / rate, [0.0] * late
        self.brake = VirtualBrake(BRAKE, DriveSettings(rate=rate))
        self.controller = BrakeController(BRAKE, ControllerSettings(
            LoopSettings(gains), **{'position_max': 40.0, **settings}))
        self.now, self.angles, self.torques = 100.0, [], []
        self.controller.start(self.now)

    def run(self, seconds, asked=None):
        for _ in range(round(seconds / self.period)):
            measured = self.brake.advance()
            self.now += self.period
            if asked is not None:
                self.controller.on_position_command(self.now, asked)
            torque = self.controller.on_state(self.now, self.now, measured.position,
                                              measured.velocity, measured.effort)
            self.torques.append(torque)
            self.late.append(torque or 0.0)
            self.brake.command(self.late.pop(0))
            self.angles.append(self.brake.plant.position)
        return self

    @property
    def supervisor(self):
        return self.controller.supervisor


def test_the_delay_margin_is_that_of_the_open_loop():
    assert delay_margin(GAINS, BRAKE.motor) == pytest.approx(0.0112, abs=5e-5)
    motor = BRAKE.motor
    for gains in (GAINS, replace(GAINS, derivative_filter_time=0.005), replace(GAINS, d=0.0),
                  PidGains(0.1, 0.3, 0.002), PidGains(2.0, 0.0, 0.02)):
        omega = np.logspace(-2.0, 4.0, 2_000_001)
        s = 1j * omega
        opened = ((gains.p + gains.i / s + gains.d * s / (1.0 + gains.derivative_filter_time * s))
                  / (motor.inertia * s**2 + motor.viscous_friction * s))
        last = np.flatnonzero(np.abs(opened) >= 1.0)[-1]
        margin = np.pi + np.angle(opened[last])
        assert delay_margin(gains, motor) == pytest.approx(margin / omega[last], rel=1e-4)


def test_a_loop_that_no_delay_brings_to_swing_has_no_bound():
    assert delay_margin(PidGains(), BRAKE.motor) == math.inf
    # Without p it swings by itself: no matter of delay.
    assert delay_margin(PidGains(i=1.0), BRAKE.motor) == math.inf


@pytest.mark.parametrize(('rate', 'late'), [(50.0, 0), (0.65 * LOWEST, 0), (LOWEST, 1)])
def test_below_the_bound_the_brake_swings(rate, late):
    """What is refused is refused with reason: the loop closed all the same."""
    loop = Loop(rate, late)
    loop.supervisor.longest_interval = math.inf
    loop.run(6.0, 20.0)
    assert np.ptp(loop.angles[len(loop.angles) // 2:]) > 2.0


@pytest.mark.parametrize('late', [0.0, 1.0])
def test_well_above_it_the_brake_stands(late):
    loop = Loop(2.5 * LOWEST, int(late)).run(4.0, 20.0)
    assert loop.supervisor.state is State.ENABLED
    assert np.ptp(loop.angles[len(loop.angles) // 2:]) < 0.2


@pytest.mark.parametrize('rate', [20.0, 50.0, 0.95 * LOWEST])
def test_too_slow_a_drive_is_told_and_never_driven(rate):
    loop = Loop(rate).run(4.0, 20.0)
    assert loop.supervisor.state is State.READY
    assert loop.supervisor.latched == Cause(0)
    assert loop.supervisor.active(loop.now) & Cause.STATE_STALE
    assert not any(loop.torques[5:])   # it had begun to hold where it stood
    assert np.ptp(loop.angles) < 0.1
    words = loop.supervisor.waits_for
    assert f'every {1e3 / rate:.3g} ms ({rate:.3g} Hz)' in words
    assert f'no phase margin below {LOWEST:.3g} Hz' in words


def test_a_trajectory_does_not_begin_on_too_slow_a_drive():
    strokes = ReferenceSettings(kind='strokes')
    loop = Loop(50.0, reference=strokes).run(3.0)
    assert loop.supervisor.state is State.READY
    assert not any(loop.torques[5:])   # it had begun to hold where it stood
    with pytest.raises(InputError, match='joint states come every 20 ms'):
        loop.controller.start_reference()
    assert Loop(1.05 * LOWEST, reference=strokes).run(0.3).supervisor.state is State.ENABLED


def test_lower_gains_close_the_loop_on_a_slow_drive():
    low = replace(GAINS, p=0.1, i=0.3, d=0.002)
    loop = Loop(50.0, gains=low).run(4.0, 10.0)
    assert loop.supervisor.state is State.ENABLED
    assert np.ptp(loop.angles[len(loop.angles) // 2:]) < 0.3
    # And while it waits, too.
    loop = Loop(50.0).run(1.0, 10.0)
    assert loop.supervisor.state is State.READY
    loop.controller.apply(replace(loop.controller.settings, loop=LoopSettings(low)))
    assert loop.run(1.0, 10.0).supervisor.state is State.ENABLED


def test_a_pause_before_the_first_command_makes_no_drive_slow():
    loop = Loop(250.0).run(0.02)
    loop.now += 0.09
    loop.run(0.02, 5.0)
    loop.run(0.3, 5.0)
    assert loop.supervisor.state is State.ENABLED


def test_once_it_was_enabled_the_rate_is_no_matter_of_waiting():
    loop = Loop(250.0).run(1.0, 5.0)
    loop.period, loop.brake = 0.02, VirtualBrake(BRAKE, DriveSettings(rate=50.0))
    loop.run(0.5, 5.0)
    assert not loop.supervisor.too_slow


def test_the_pace_is_that_of_the_fewest_samples_that_tell_it():
    clock = SampleClock()
    assert clock.pace == 0.0
    clock.step(0.5)
    assert clock.pace == 0.5
    for _ in range(3):
        clock.step(0.004)
    assert clock.pace == pytest.approx(0.512 / 4)
    for _ in range(20):
        clock.step(0.004)
    assert clock.pace == pytest.approx(0.004)
    for _ in range(20):   # it is the least
        clock.step(0.02)
    assert clock.pace == pytest.approx(0.004)
    clock.reset()
    assert clock.pace == 0.0
