# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The topics that a recording may hold (docs/contract.md, section 1), and their message types.

The only place where their names are written; what else the nodes say stands in
`engb_ros.interface`. Names are relative, so a namespace makes four wheels out of one.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ['CLAMP_FORCE', 'CLAMP_FORCE_COMMAND', 'CLAMP_FORCE_COMMAND_STAMPED', 'CONTROL_REPORT',
           'DISC_SPEED', 'DISTURBANCE', 'EFFORT_COMMAND', 'FLOAT64', 'FRICTION_TORQUE',
           'JOINT_COMMAND', 'JOINT_STATE', 'JOINT_STATES', 'LOAD_CELL', 'LOAD_TORQUE',
           'PAD_TEMPERATURE', 'POSITION_COMMAND', 'POSITION_COMMAND_STAMPED', 'RECORDED_TOPICS',
           'REFERENCE', 'Topic']

JOINT_STATE = 'sensor_msgs/msg/JointState'
FLOAT64 = 'std_msgs/msg/Float64'


@dataclass(frozen=True)
class Topic:
    """One topic.

    Attributes:
        name: relative to the namespace.
        type: 'package/msg/Name'.
        unit: of the value ('' where the type holds several).
        meaning: one line.
        kind: 'state' (published reliable, depth 10 000, for those who need every sample; a control
            loop reads best effort, depth 1: it gets on with drivers that offer no more),
            'command' (published reliable, depth 1, read best effort, depth 1: only the newest
            counts), 'request' (the same, read with depth 50: whoever speaks last must not hide
            the others), or 'status' (reliable and transient local, depth 1, for those who join
            late).
    """

    name: str
    type: str
    unit: str
    meaning: str
    kind: str = 'state'


JOINT_STATES = Topic('joint_states', JOINT_STATE, '', 'motor angle [rad], velocity [rad/s] and '
                     'effort [N·m] = torque constant × measured current')
EFFORT_COMMAND = Topic('effort_command', FLOAT64, 'N·m', 'torque demanded of the drive',
                       'command')
JOINT_COMMAND = Topic('joint_command', JOINT_STATE, '', 'torque demanded of the drive as '
                      'effort [N·m], from ros2_control, where `effort_source` says so', 'command')
REFERENCE = Topic('reference', JOINT_STATE, '', 'what the controller tracks: position, velocity, '
                  'and as effort the feedforward torque')
POSITION_COMMAND = Topic('position_command', FLOAT64, 'rad', 'set-point from the stack', 'request')
CLAMP_FORCE_COMMAND = Topic('clamp_force_command', FLOAT64, 'N', 'set-point from the stack',
                            'request')
POSITION_COMMAND_STAMPED = Topic(
    'position_command_stamped', JOINT_STATE, '', 'set-point from the stack: `position` [rad] of '
    'the joint, `header.stamp`, the source as `header.frame_id`, and, if it has one, the position '
    'of an entry `counter`', 'request')
CLAMP_FORCE_COMMAND_STAMPED = Topic(
    'clamp_force_command_stamped', JOINT_STATE, '', 'the same for a clamp force: `effort` [N] of '
    'an entry `clamp`, and of the entry `counter`', 'request')
DISTURBANCE = Topic('disturbance', FLOAT64, 'N·m', 'the observer\'s estimate, equation (30)')
CLAMP_FORCE = Topic('clamp_force', FLOAT64, 'N', 'estimated or measured clamp force')
LOAD_CELL = Topic('load_cell', FLOAT64, 'N', 'clamp force as a bench\'s load cell reads it')
DISC_SPEED = Topic('disc_speed', FLOAT64, 'rad/s', 'brake disc, signed')
PAD_TEMPERATURE = Topic('pad_temperature', FLOAT64, '°C', 'brake pad')
LOAD_TORQUE = Topic('load_torque', FLOAT64, 'N·m', 'load torque after the identified model')
FRICTION_TORQUE = Topic('friction_torque', FLOAT64, 'N·m',
                        'friction torque after the identified model')
CONTROL_REPORT = Topic('control_report', JOINT_STATE, '', 'three entries, input, command and '
                       'output: angle and torque as asked for, after all limits, and measured')

RECORDED_TOPICS: tuple[Topic, ...] = (
    JOINT_STATES, EFFORT_COMMAND, REFERENCE, POSITION_COMMAND, CLAMP_FORCE_COMMAND, DISTURBANCE,
    CLAMP_FORCE, LOAD_CELL, DISC_SPEED, PAD_TEMPERATURE, LOAD_TORQUE, FRICTION_TORQUE,
    CONTROL_REPORT, POSITION_COMMAND_STAMPED, CLAMP_FORCE_COMMAND_STAMPED, JOINT_COMMAND)
