# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Trajectories of the controller node: who begins them, and which ones it refuses."""

import signal

import pytest

from engb_core.control.causes import Cause
from engb_ros.files import TRUE_BRAKE
from engb_ros.interface import START_REFERENCE
from engb_ros.processes.live_loop import LiveLoop
from engb_ros.processes.runner import node_command
from ros.loops import plant


def test_after_a_clear_the_strokes_wait_for_a_command(runner, probe):
    """They had begun again by themselves, against what the service answered."""
    loop = LiveLoop(runner, probe, plant(), model=str(TRUE_BRAKE), reference='strokes',
                    slow_speeds=[50.0])
    loop.until(lambda: loop.position > 8.0, 'a stroke')
    drive = runner.processes['plant']
    drive.signal(signal.SIGSTOP)
    loop.until(lambda: loop.is_in('fault') and loop.has(Cause.STATE_STALE), 'the silence')
    drive.signal(signal.SIGCONT)
    answers = []

    def cleared():
        answers.append(loop.clear())
        return answers[-1].success

    loop.until(cleared, 'the fault to be cleared')
    assert 'until ~/start_reference begins the reference anew' in answers[-1].message
    told, begin = len(loop.state), len(loop.states)
    loop.during(2.0)
    assert 'enabled' not in {message.data for message in loop.state[told:]}
    angles = [message.position[0] for message in loop.states[begin:]]
    assert max(angles) < angles[0] + 1.0

    def started():   # a busy computer may have let it wait meanwhile
        return loop.clear().success and probe.call('controller', START_REFERENCE).success

    loop.until(started, 'the strokes to be started')
    loop.until(lambda: loop.is_in('enabled') and loop.position > 8.0, 'a stroke')
    runner.stop()


@pytest.mark.parametrize(('rows', 'told'), [
    ('0,0\n2,60\n10,60\n', 'line 3: 60 rad lies beyond position_max, 40 rad; change the row'),
    ('0,0\n2,5000\n', 'line 3: 5000 rad lies beyond position_max'),
    ('0,0\n0.001,39\n5,39\n', 'the move to line 3 takes'),
    ('0,0\n1e300,5\n', 'line 3 comes 1e+300 s after the first row'),
])
def test_a_file_that_the_brake_could_not_follow_ends_in_one_line_and_status_2(
        runner, tmp_path, rows, told):
    """It had been tracked to the end of the range and beyond, or thrown the brake."""
    path = tmp_path / 'far.csv'
    path.write_text('time,position\n' + rows)
    process = runner.start_command('controller', node_command('controller', parameters={
        'model': str(TRUE_BRAKE), 'reference': 'file', 'reference_file': str(path)}))
    assert process.wait(60.0) == 2
    assert [line for line in process.output.splitlines() if line.strip()] == [
        line for line in process.output.splitlines() if f'controller: {path}: ' in line
        and told in line]
    assert 'Traceback' not in process.output
