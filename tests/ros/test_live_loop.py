# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The loop that tests disturb is disturbed by nothing else: not by what the test itself does."""

import time

from sensor_msgs.msg import JointState

from engb_core.control.causes import Cause
from ros.loops import closed_loop, COMMAND_TIMEOUT


def test_commands_go_on_while_the_test_is_at_something_else(runner, probe):
    """A test that wrote a file for a quarter of a second made its own commands stale."""
    loop = closed_loop(runner, probe)

    def busy():
        time.sleep(4.0 * COMMAND_TIMEOUT)   # handles no messages
        loop.during(0.1)
        return not loop.is_in('fault')

    assert loop.undisturbed(busy), loop.words()
    loop.target = None
    loop.until(lambda: loop.is_in('fault') and loop.has(Cause.COMMAND_STALE), 'the fault')
    runner.stop()


def test_a_joint_state_without_an_angle_does_not_hide_where_the_brake_is(runner, probe):
    """A test that hears its own garbage asked it for the brake's angle."""
    loop = closed_loop(runner, probe)
    loop.go(10.0)
    loop.states.append(JointState())
    assert abs(loop.position - 10.0) < 0.5
    assert abs(loop.effort) < 0.75
    runner.stop()
