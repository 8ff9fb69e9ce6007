# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Node `excitation` beside joint states that are poor: it lets go of the motor, and says why."""

import math
import time

import pytest
from sensor_msgs.msg import JointState

from engb_ros.interface import EFFORT_COMMAND, JOINT_STATES


class Drive:
    """Joint states as a test wants them, and what the excitation answers."""

    def __init__(self, runner, probe, **parameters):
        self.efforts = probe.listen(EFFORT_COMMAND)
        self.process = runner.start('excitation', parameters=parameters)
        self.probe, self.begin = probe, time.monotonic_ns()
        publisher = probe.advertise(JOINT_STATES)
        runner.wait_until(publisher.get_subscription_count, 'the excitation', pause=probe.spin)

    def send(self, seconds, until=lambda: False, stamps_stand=False, name='motor', speed=None,
             velocity=None):
        """Publish for so long, or until it has come about; return whether it has."""
        end, stand = time.monotonic() + seconds, time.monotonic_ns() - self.begin
        while time.monotonic() < end and not until():
            now = time.monotonic_ns() - self.begin
            stamp = stand if stamps_stand else now
            message = JointState(name=[name], effort=[0.0],
                                 position=[1e-9 * now * (speed or 0.0)],
                                 velocity=[] if velocity is None else [velocity])
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
            self.probe.publish(JOINT_STATES, message)
            self.probe.spin(0.004)
        return until()

    def works(self):
        return any(message.data for message in self.efforts[-20:])

    def lets_go(self):
        return len(self.efforts) >= 50 and not self.works()


@pytest.mark.parametrize(('poor', 'told'), [
    ({'stamps_stand': True}, 'have not advanced'),
    ({'speed': 900.0}, 'rad/s is too fast'),
    ({'velocity': 900.0}, '900 rad/s is too fast'),
    ({'velocity': math.nan}, 'no number')])
def test_it_lets_go_where_nobody_can_tell_how_fast_the_motor_turns(runner, probe, poor, told):
    drive = Drive(runner, probe, hold=100.0, duration=100.0)
    assert drive.send(30.0, drive.works, velocity=0.0)
    drive.efforts.clear()
    assert drive.send(30.0, drive.lets_go, **poor)
    lines = [line for line in drive.process.output.splitlines() if 'the motor is let go' in line]
    assert len(lines) == 1 and told in lines[0]
    runner.stop()


def test_it_answers_its_own_joint_alone(runner, probe):
    drive = Drive(runner, probe, joint='rear_left')
    output = drive.process.output_path
    assert drive.send(30.0, lambda: 'hold motor' in output.read_text(), velocity=0.0)
    assert not drive.efforts
    assert drive.send(30.0, drive.works, name='rear_left', velocity=0.0)
    assert output.read_text().count('set parameter joint') == 1
    runner.stop()
