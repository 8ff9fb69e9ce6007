# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a controller says of a drive that it cannot work with."""

import pytest

from engb_core.control.causes import Cause
from engb_ros.files import TRUE_BRAKE
from ros.loops import LiveLoop, plant


@pytest.mark.parametrize('rate', [20.0, 50.0])
def test_a_drive_that_is_too_slow_for_the_gains_is_told_and_never_driven(runner, probe, rate):
    """At 50 Hz the shipped gains had swung the brake for ever, at 20 Hz thrown it."""
    loop = LiveLoop(runner, probe, plant(rate=rate), model=str(TRUE_BRAKE))
    loop.target = 20.0
    loop.during(3.0)
    assert loop.is_in('ready')
    assert loop.has(Cause.STATE_STALE)
    assert max(abs(message.position[0]) for message in loop.states) < 1.0
    lines = [line for line in runner.processes['controller'].output.splitlines()
             if 'joint states come every' in line]
    assert len(lines) == 1
    assert 'no phase margin below 89.4 Hz; let the drive send faster' in lines[0]
    runner.stop()
