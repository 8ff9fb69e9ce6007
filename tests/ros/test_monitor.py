# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The monitor on live nodes: quiet while the model holds, a warning with the place where not, and
stale while there is nothing to judge; who else listens says when its joint is not there.
"""

import math
import time

import pytest
from sensor_msgs.msg import JointState

from engb_ros.files import TRUE_BRAKE
from engb_ros.interface import DIAGNOSTICS, DISTURBANCE, JOINT_STATES
from engb_ros.processes.runner import node_command

STROKES = {'model': str(TRUE_BRAKE), 'reference': 'strokes', 'repeat': True,
           'stroke_amplitudes': [30.0], 'slow_range': [0.0, 0.0], 'state_timeout': 0.0,
           'effort_rate': 1e6, 'largest_speed': 1e5}


@pytest.mark.parametrize(('effects', 'level'), [
    ('', 0), ('load_stiffness_error: {scale: 1.4}', 1)])
def test_it_warns_when_model_and_brake_part(runner, probe, effects, level):
    diagnostics = probe.listen(DIAGNOSTICS)
    runner.start('monitor', parameters={'model': str(TRUE_BRAKE), 'period': 0.2})
    runner.start('controller', parameters=STROKES)
    runner.start('plant', parameters={'lockstep': True, 'speed': 2.0, 'effects': effects})

    def words():
        return [message.status[0] for message in diagnostics
                if message.status[0].name.endswith('monitor')]

    def looked():
        """Whether it has seen whole strokes, or warned."""
        last = words()[-1:]
        return last and (last[0].level == bytes([1]) or len(
            [value for value in last[0].values if value.key.startswith('rms')]) >= 4
            and len(words()) > 40)

    runner.wait_until(looked, 'the monitor', timeout=90.0, pause=probe.spin)
    last = words()[-1]
    assert last.level == bytes([level]), last.values
    if level:
        assert 'part' in last.message
        assert 'under load' in last.message
    runner.stop()


def sender(probe, name='motor', stamps_stand=False, **values):
    """Return what publishes a joint state and waits a little."""
    def send():
        message = JointState(name=[name], position=[values.get('position', 20.0)],
                             velocity=[values.get('velocity', 20.0)],
                             effort=[values.get('effort', 0.0)])
        message.header.stamp.sec, message.header.stamp.nanosec = (
            (0, 7) if stamps_stand else divmod(time.monotonic_ns(), 10**9))
        probe.publish(JOINT_STATES, message)
        probe.spin(0.01)
    return send


def test_it_is_stale_while_there_is_nothing_to_judge(runner, probe):
    heard = probe.listen(DIAGNOSTICS)
    process = runner.start('monitor', parameters={'model': str(TRUE_BRAKE), 'period': 0.1})

    def says(level, words):
        status = heard[-1].status[0] if heard else None
        return status and status.level == bytes([level]) and words in status.message

    for level, words, send in (
            (3, 'no joint_states come', probe.spin),
            (3, 'hold wheel', sender(probe, name='wheel')),
            (3, 'no finite position', sender(probe, position=math.nan)),
            (3, 'no finite effort', sender(probe, effort=math.nan)),
            (3, 'do not advance', sender(probe, stamps_stand=True)),
            (0, 'has hardly moved', sender(probe, position=0.0, velocity=0.0)),
            (1, 'model and measurement part', sender(probe)),
            # The judgement is not repeated as if it were of now.
            (3, 'no joint_states come', probe.spin)):
        runner.wait_until(lambda level=level, words=words: says(level, words), words, pause=send)
        if level == 3:
            assert not [value for value in heard[-1].status[0].values if 'rms' in value.key]
    lines = process.output.splitlines()
    assert len([line for line in lines if 'no joint_states come' in line]) == 2
    assert len(lines) < 10   # each change once, not each message
    runner.stop()


def test_who_misses_its_joint_says_so_once(runner, probe):
    names = ('disturbance_observer', 'identifier')
    for name in names:
        runner.start(name)
    estimates = probe.listen(DISTURBANCE)
    publisher = probe.advertise(JOINT_STATES)
    runner.wait_until(lambda: publisher.get_subscription_count() == len(names), 'both',
                      pause=probe.spin)
    outputs = [runner.processes[name].output_path for name in names]
    send = sender(probe, name='wheel')
    runner.wait_until(lambda: all('joint_states hold wheel' in path.read_text()
                                  for path in outputs), 'the words', pause=send)
    for _ in range(100):
        send()
    assert not estimates
    assert [path.read_text().count('joint_states hold') for path in outputs] == [1, 1]
    runner.stop()


def test_the_observer_answers_no_sample_of_no_use(runner, probe):
    runner.start('disturbance_observer')
    estimates = probe.listen(DISTURBANCE)
    runner.wait_until(lambda: estimates, 'an estimate', pause=sender(probe))
    for poor in ({'position': math.nan, 'velocity': math.nan}, {'effort': math.nan},
                 {'stamps_stand': True}):
        send = sender(probe, **poor)

        def silent(send=send):   # once the last sample of use has been answered
            estimates.clear()
            for _ in range(30):
                send()
            return not estimates

        runner.wait_until(silent, f'no estimate of {poor}', pause=send)
    runner.wait_until(lambda: estimates, 'an estimate', pause=sender(probe))
    runner.stop()


def test_a_monitor_without_a_model_names_the_parameter(runner):
    process = runner.start_command('monitor', node_command('monitor'))
    assert process.wait(60.0) == 2
    assert process.output.count('\n') == 1
    assert 'parameter model is empty; set it to' in process.output
