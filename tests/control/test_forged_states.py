# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Forged joint states between those of a drive at 250 Hz: what they can do to an applied brake."""

import copy
import functools
import math

import pytest

from control.test_hazards import Brake, DT
from engb_core.control.causes import Cause, State
from engb_core.control.command_arbiter import Command

# One joint state for so many steps of the drive's own clock.
EVERY = 4

# One message may let the brake go by so much [rad].
LET_GO = 1.0


class Forged(Brake):
    """A drive whose joint states come at 250 Hz, with somebody else's between them."""

    def __init__(self):
        super().__init__()
        self.lowest = math.inf

    def given(self, torque):
        if torque is not None:
            self.sent = torque
            self.brake.command(torque)

    def run(self, seconds, forged=None):
        """Let time pass; `forged` returns what is sent after each step: (seconds that the stamp
        is ahead, angle, velocity, torque), or nothing."""
        for step in range(round(seconds / DT)):
            measured = self.brake.advance()
            self.now += DT
            self.count += 1
            if self.asked is not None and self.count % 20 == 0:
                self.controller.on_command(self.now, self.asked)
            if self.count % EVERY == 0:
                self.given(self.controller.on_state(self.now, self.now, measured.position,
                                                    measured.velocity, measured.effort))
            self.given(self.controller.on_tick(self.now))
            sample = forged(step, measured) if forged else None
            if sample is not None:
                ahead, *sample = sample
                now = self.now + 0.5 * DT
                self.given(self.controller.on_state(now, now + ahead, *sample))
            self.lowest = min(self.lowest, self.angle)
        return self

    def let_go(self, forged, seconds=1.0):
        """Return how far the brake lets go [rad] while something is forged, and after it."""
        before = self.lowest = self.angle
        self.run(seconds, forged)
        return before - self.lowest


@functools.cache
def applied_at(angle):
    brake = Forged().at(angle)
    brake.run(0.5)
    while brake.count % EVERY:
        brake.run(DT)
    return brake


def at(angle):
    """Return a brake that is applied [rad], and has been for a while."""
    return copy.deepcopy(applied_at(angle))


def once(steps, ahead, angle, velocity):
    """Forge one sample, so many steps after one of the drive's."""
    return lambda step, measured: ((ahead, measured.position + angle, velocity, measured.effort)
                                   if step == steps else None)


@pytest.mark.parametrize('velocity', [399.0, -399.0, 150.0, 60.0, math.nan])
@pytest.mark.parametrize('angle', [0.0, 0.7, 1.5])
@pytest.mark.parametrize('ahead', [0.0, 0.003, 0.09, -0.09, 0.5])
@pytest.mark.parametrize('applied', [20.0, 35.0])
def test_one_forged_speed_releases_no_brake(applied, ahead, angle, velocity):
    """One of 399 rad/s, just below `largest_speed`, had let the brake go by a cycle of full
    torque; one without a velocity, its angle off, likewise by that of the angles."""
    for steps in range(EVERY):
        brake = at(applied)
        assert brake.let_go(once(steps, ahead, angle, velocity)) < LET_GO
        assert brake.state is State.ENABLED
        assert not brake.controller.supervisor.counts[Cause.VELOCITY_WRONG]


def some(count, every, angle, velocity, walks=False):
    """Forge so many, one each so many steps, their angle off by the same or by more and more."""
    def forged(step, measured):
        if step % every or step >= count * every:
            return None
        off = angle * (step // every + 1) if walks else angle
        return 0.0, measured.position + off, velocity, measured.effort
    return forged


@pytest.mark.parametrize('velocity', [399.0, -399.0, 80.0, 20.0, math.nan])
@pytest.mark.parametrize('angle', [1.5, 1.0, -1.0, -1.5])
@pytest.mark.parametrize(('count', 'every', 'walks'), [
    (2, 1, False), (2, 1, True), (3, 1, True), (2, EVERY, False)])
def test_two_forged_joint_states_release_no_brake(count, every, walks, angle, velocity):
    """The second had turned the torque round, and the true angle, a jump from the forged one, was
    not used for 50 ms: the brake was thrown out of its range, by 72 rad."""
    brake = at(35.0)
    assert brake.let_go(some(count, every, angle, velocity, walks)) < LET_GO
    assert brake.state is State.ENABLED


@pytest.mark.parametrize('angle', [1.5, -1.5])
def test_five_forged_joint_states_between_those_of_the_drive_release_no_brake(angle):
    brake = at(35.0)
    assert brake.let_go(some(5, EVERY, angle, 399.0)) < 3.0
    assert brake.state is State.ENABLED


def test_while_nobody_knows_the_angle_the_motor_gets_what_holds_the_load():
    """In the midst of a move it had kept the torque of that moment for 50 ms."""
    brake = Brake().at(5.0)
    brake.asked = Command(30.0)
    brake.run(0.06)
    assert brake.sent > 0.05   # it speeds up
    brake.offset = 30.0
    brake.run(2.0 * DT)
    assert brake.sent == pytest.approx(
        brake.controller.loop.held_torque(brake.angle), abs=0.005)
    assert brake.sent < 0.04
    assert brake.state is State.ENABLED
