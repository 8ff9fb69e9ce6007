# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The topics of ros2_control's joint_state_topic_hardware_interface, spoken to our nodes.

The C++ package is not installable here. The client below does what its `read` and `write` do: a
SensorDataQoS subscription, a QoS(1) publisher, one effort per joint in the order of the joints,
NaN before a controller is active, and nothing while |state - command| is not above the threshold.
"""

import math
from pathlib import Path
import re
import time
import xml.etree.ElementTree as ElementTree

from rclpy.qos import qos_profile_sensor_data, QoSProfile
from sensor_msgs.msg import JointState
import yaml

from engb_ros.files import config_file
from engb_ros.interface import DEFAULT_NAMESPACE, JOINT_COMMAND, JOINT_STATES

URDF = config_file('ros2_control.urdf.xacro')


def urdf():
    """Return the xacro file with its arguments' defaults put in."""
    text = URDF.read_text(encoding='utf-8')
    for name, default in re.findall(r'<xacro:arg name="(\w+)" default="([^"]*)"/>', text):
        text = text.replace(f'$(arg {name})', default)
    return ElementTree.fromstring(text)


def hardware():
    """Return the hardware parameters of the URDF."""
    return {entry.get('name'): entry.text
            for entry in urdf().find('ros2_control/hardware').findall('param')}


class TopicHardware:
    """What JointStateTopicSystem does to its two topics."""

    def __init__(self, probe, joint, parameters):
        self._joint, self._threshold = joint, float(
            parameters.get('trigger_joint_command_threshold', 1e-5))
        self.state = dict.fromkeys(('position', 'velocity', 'effort'), math.nan)
        self.command = math.nan
        self.sent = 0
        self._publisher = probe.node.create_publisher(
            JointState, parameters['joint_commands_topic'], QoSProfile(depth=1))
        probe.node.create_subscription(
            JointState, parameters['joint_states_topic'], self._read, qos_profile_sensor_data)

    def _read(self, message):
        for index, name in enumerate(message.name):
            if name == self._joint:
                for field in self.state:
                    values = getattr(message, field)
                    if values and math.isfinite(values[index]):
                        self.state[field] = values[index]

    def write(self):
        """Send the command, unless it hardly differs from the state."""
        if abs(self.state['effort'] - self.command) <= self._threshold:
            return
        self.sent += 1
        self._publisher.publish(JointState(name=[self._joint], effort=[self.command]))


def run_hardware(runner, probe, parameters):
    """Start the plant; return a hardware that hears it and a way to let it run."""
    runner.start('plant', parameters={'rate': 250.0, 'effort_noise': 0.0, 'effort_resolution': 0.0,
                                      'command_timeout': 0.5, 'effort_source': 'joint_command'})
    made = TopicHardware(probe, 'motor', parameters)
    runner.wait_until(lambda: probe.subscribers(JOINT_COMMAND) and made.state['effort'] == 0.0,
                      'the plant', pause=probe.spin)

    def cycle():
        probe.spin(0.004)
        made.write()
    return made, cycle


def test_an_own_controller_drives_the_plant(runner, probe):
    made, cycle = run_hardware(runner, probe, hardware())
    runner.wait_until(lambda: made.sent > 20, 'cycles without an active controller', pause=cycle)
    assert made.state['effort'] == 0.0   # NaN is no command
    gains = yaml.safe_load(config_file('ros2_control_controllers.yaml').read_text(
        encoding='utf-8'))['joint_trajectory_controller']['ros__parameters']['gains']['motor']

    limit = float(urdf().find('joint/limit').get('effort'))

    def controlled():
        error = 5.0 - made.state['position']
        made.command = min(max(gains['p'] * error - gains['d'] * made.state['velocity'],
                               -limit), limit)
        cycle()

    runner.wait_until(lambda: abs(made.state['position'] - 5.0) < 0.5, '5 rad', pause=controlled)
    runner.stop()


def test_the_default_threshold_would_make_the_drive_let_go(runner, probe):
    made, cycle = run_hardware(runner, probe, hardware())
    states = probe.listen(JOINT_STATES)
    made.command = 0.05
    runner.wait_until(lambda: made.state['effort'] == 0.05, 'the torque', pause=cycle)
    begin, end = len(states), time.monotonic() + 1.2
    while time.monotonic() < end:
        cycle()
    sent = made.sent
    assert sent > 20
    made._threshold = 1e-5   # the interface's default
    runner.wait_until(lambda: any(message.effort[0] == 0.0 for message in states[begin:]),
                      'the drive to let go', pause=cycle)
    runner.stop()


def test_the_files_name_what_the_nodes_have():
    parameters = hardware()
    assert parameters['joint_commands_topic'] == f'{DEFAULT_NAMESPACE}/{JOINT_COMMAND.name}'
    assert parameters['joint_states_topic'] == f'{DEFAULT_NAMESPACE}/{JOINT_STATES.name}'
    assert float(parameters['trigger_joint_command_threshold']) < 0.0
    joint = urdf().find('ros2_control/joint')
    assert [entry.get('name') for entry in joint.findall('command_interface')] == ['effort']
    controllers = yaml.safe_load(config_file('ros2_control_controllers.yaml').read_text(
        encoding='utf-8'))
    listed = controllers['controller_manager']['ros__parameters']
    for name in ('joint_trajectory_controller', 'effort_controller'):
        assert name in listed
        assert controllers[name]['ros__parameters']['joints'] == [joint.get('name')]
    launch = Path(URDF.parent.parent / 'launch' / 'ros2_control.launch.xml').read_text(
        encoding='utf-8')
    assert 'value="joint_command"' in launch
