# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which faults a loop under test begins again after: of a computer that let somebody wait."""

import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import UInt32

from engb_core.control.causes import Cause
from ros.loops import ShippedLoop, STATE_TIMEOUT


def loop_that_saw(pause, *causes):
    """A loop whose drive told nothing for `pause` [s], and whose controller then told these."""
    loop = object.__new__(ShippedLoop)
    loop.states, loop.causes = [JointState(), JointState()], []
    loop.states[1].header.stamp.nanosec = round(1e9 * pause)
    for message in loop.states:
        message.position = [12.0]
    loop._mark()
    loop._begin = 0
    loop.causes += [UInt32(data=cause.value) for cause in causes]
    return loop


THROWN_OUT = Cause.STATE_STALE | Cause.ANGLE_OUT_OF_RANGE


@pytest.mark.parametrize(('pause', 'causes', 'began_late', 'was_late'), [
    (2.0, (Cause.STATE_STALE,), True, True),
    # The torque went, and the brake was thrown out of its range: its consequence.
    (2.0, (Cause.STATE_STALE, THROWN_OUT), True, False),
    (2.0, (Cause.STATE_STALE, Cause(0), Cause.ANGLE_OUT_OF_RANGE), True, False),
    # What comes first is no consequence of lateness.
    (2.0, (Cause.ANGLE_OUT_OF_RANGE, THROWN_OUT), False, False),
])
def test_what_follows_from_lateness_is_begun_again(pause, causes, began_late, was_late):
    loop = loop_that_saw(pause * STATE_TIMEOUT, *causes)
    assert loop.began_late() == began_late
    assert loop.was_late() == was_late
