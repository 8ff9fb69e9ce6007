# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a controller says of a drive that it cannot work with, and a drive of itself."""

import pytest

from engb_core.control.causes import Cause
from engb_ros.files import TRUE_BRAKE
from engb_ros.interface import JOINT_STATES
from engb_ros.processes.live_loop import LiveLoop
from ros.loops import plant


def said(runner, node, words):
    """Return the lines of a node's log that hold these words."""
    return [line for line in runner.processes[node].output.splitlines() if words in line]


@pytest.mark.parametrize('rate', [20.0, 50.0])
def test_a_drive_that_is_too_slow_for_the_gains_is_told_and_never_driven(runner, probe, rate):
    """At 50 Hz the shipped gains had swung the brake for ever, at 20 Hz thrown it."""
    loop = LiveLoop(runner, probe, plant(rate=rate), model=str(TRUE_BRAKE))
    loop.target = 20.0
    loop.during(3.0)
    assert loop.is_in('ready')
    assert loop.has(Cause.STATE_STALE)
    assert max(abs(message.position[0]) for message in loop.states) < 1.0
    lines = said(runner, 'controller', 'joint states come every')
    assert len(lines) == 1
    assert 'no phase margin below 89.4 Hz; let the drive send faster' in lines[0]
    runner.stop()


def test_a_drive_of_another_joint_is_told_once(runner, probe):
    """It had waited for ever, and its log said nothing."""
    for node, parameters in plant(joint='wheel'):
        runner.start(node, parameters=parameters)
    runner.start('controller', parameters={'model': str(TRUE_BRAKE)})
    runner.wait_until(lambda: said(runner, 'controller', 'joint'), 'the word', pause=probe.spin)
    states = probe.listen(JOINT_STATES)
    runner.wait_until(lambda: len(states) > 100, 'more samples', pause=probe.spin)
    lines = said(runner, 'controller', 'joint_states tell of')
    assert len(lines) == 1
    assert "of 'wheel', and nothing of 'motor', the joint that this controller drives" in lines[0]
    runner.stop()


def test_a_drive_that_gives_no_torque_says_so_and_suspects_nobody(runner, probe):
    """It had asked whether somebody else was on the topic."""
    loop = LiveLoop(runner, probe, plant(effort_limit=0.0), model=str(TRUE_BRAKE))
    loop.target = 20.0
    loop.until(lambda: loop.is_in('fault') and loop.has(Cause.DRIVE_OFF), 'the drive to be missed')
    assert len(said(runner, 'plant', 'effort_limit is 0: this drive gives no torque')) == 1
    assert not said(runner, 'plant', 'someone else')
    runner.stop()
