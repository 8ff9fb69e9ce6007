# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The identifier gives up what is under way when it ends, and overwrites what it did not make."""

import signal

from lifecycle_msgs.srv import ChangeState
import pytest
from sensor_msgs.msg import JointState

from engb_core.model import Model
from engb_ros.interface import IDENTIFY, JOINT_STATES, Service, WRITE_MODEL
from tests.identify.bench import simulate, stroke_reference

CHANGE_STATE = Service('~/change_state', 'lifecycle_msgs/srv/ChangeState', '')
CLEANUP, CONFIGURE, ACTIVATE, DEACTIVATE = 2, 1, 3, 4


@pytest.fixture(scope='module')
def strokes():
    """So many that an identification takes a while."""
    return simulate(stroke_reference(count=6))


def feed(runner, probe, recording, parameters=None):
    """Start an identifier and give it the samples, as fast as it takes them."""
    process = runner.start('identifier', parameters=parameters or {})
    publisher = probe.advertise(JOINT_STATES)
    runner.wait_until(publisher.get_subscription_count, 'the identifier', pause=probe.spin)
    message = JointState(name=['motor'], position=[0.0], effort=[0.0])
    rows = zip(recording.time.tolist(), recording.position.tolist(), recording.effort.tolist(),
               strict=True)
    for number, (time, *values) in enumerate(rows):
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(round(1e9 * time), 10**9)
        message.position[0], message.effort[0] = values
        publisher.publish(message)
        if number % 200 == 0:
            probe.spin(0.01)
    return process


def change(probe, transition):
    request = ChangeState.Request()
    request.transition.id = transition
    return probe.call('identifier', CHANGE_STATE, request=request).success


def begin(runner, probe):
    """Ask for an identification, once enough has come."""
    runner.wait_until(lambda: probe.call('identifier', IDENTIFY).success, 'enough samples',
                      pause=probe.spin)


def test_a_signal_gives_up_what_is_under_way(runner, probe, strokes):
    process = feed(runner, probe, strokes)
    begin(runner, probe)
    process.signal(signal.SIGINT)
    assert process.wait(4.0) == 0   # launch waits 5 s
    runner.processes.clear()
    assert process.output.count('is given up') == 1
    assert 'identified' not in process.output


def test_a_cleanup_gives_up_what_is_under_way_and_nothing_of_it_is_left(runner, probe, strokes):
    process = feed(runner, probe, strokes)
    begin(runner, probe)
    assert change(probe, DEACTIVATE) and change(probe, CLEANUP)
    assert change(probe, CONFIGURE) and change(probe, ACTIVATE)
    answer = probe.call('identifier', WRITE_MODEL)
    assert not answer.success and 'nothing is identified' in answer.message
    runner.stop()
    assert process.output_path.read_text().count('is given up') == 1


def test_a_file_that_it_did_not_write_stays(runner, probe, strokes, tmp_path):
    path = tmp_path / 'precious.yaml'
    path.write_text('my hand-made model\n')
    feed(runner, probe, strokes, {'model_out': str(path)})
    begin(runner, probe)
    answers = []

    def answered():
        answers.append(probe.call('identifier', WRITE_MODEL))
        return 'nothing is identified' not in answers[-1].message

    runner.wait_until(answered, 'the model', pause=probe.spin, timeout=120.0)
    assert not answers[-1].success
    assert 'engb did not write it' in answers[-1].message
    assert f'parameter model_out {path}' in answers[-1].message
    assert path.read_text() == 'my hand-made model\n'
    path.unlink()
    for _ in range(2):   # its own it writes again
        answer = probe.call('identifier', WRITE_MODEL)
        assert answer.success and answer.message == str(path)
    assert Model.read(path).motor.inertia > 0.0
    path.write_text(path.read_text() + '# by hand\n')
    assert not probe.call('identifier', WRITE_MODEL).success
    assert [entry.name for entry in tmp_path.iterdir()] == ['precious.yaml']
    runner.stop()
