# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The package's topics and services: the only place where their names are written.

Importing this needs no ROS installation (the offline commands use it too); what turns messages
into numbers is in `engb_ros.nodes.messages`. Names are relative, so a namespace makes four
wheels out of one.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ['ACCEPT_MODEL', 'CLAMP_FORCE', 'CLAMP_FORCE_COMMAND', 'CLEAR', 'CLEAR_FAULTS', 'CLOCK',
           'CLAMP_FORCE_COMMAND_STAMPED', 'CLOCK_TYPE', 'CONTROLLER_ACTIVATION',
           'CONTROLLER_CAUSES', 'CONTROLLER_STATE', 'CONTROL_REPORT', 'DEFAULT_NAMESPACE',
           'DIAGNOSTICS', 'DIAGNOSTIC_ARRAY', 'DISC_SPEED', 'DISTURBANCE', 'DRIVE_STATE',
           'EFFORT_COMMAND', 'FLOAT64', 'FRICTION_TORQUE', 'IDENTIFY', 'JOINT_COMMAND',
           'JOINT_STATE', 'JOINT_STATES', 'LOAD_CELL', 'LOAD_TORQUE', 'PAD_TEMPERATURE',
           'POSITION_COMMAND', 'POSITION_COMMAND_STAMPED', 'RECORDED', 'REFERENCE', 'SERVICES',
           'START_REFERENCE', 'STRING', 'Service', 'TOPICS', 'TRIGGER', 'Topic', 'UINT32',
           'UINT64', 'WRITE_MODEL']

JOINT_STATE = 'sensor_msgs/msg/JointState'
FLOAT64 = 'std_msgs/msg/Float64'
STRING = 'std_msgs/msg/String'
UINT32 = 'std_msgs/msg/UInt32'
UINT64 = 'std_msgs/msg/UInt64'
DIAGNOSTIC_ARRAY = 'diagnostic_msgs/msg/DiagnosticArray'
CLOCK_TYPE = 'rosgraph_msgs/msg/Clock'
TRIGGER = 'std_srvs/srv/Trigger'

DEFAULT_NAMESPACE = '/engb'


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


@dataclass(frozen=True)
class Service:
    """One service: its name relative to the node ('~/…'), its type and what it does."""

    name: str
    type: str
    meaning: str


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
CONTROLLER_STATE = Topic('controller_state', STRING, '', 'ready, enabled, degraded or fault',
                         'status')
CONTROLLER_CAUSES = Topic('controller_causes', UINT32, '', 'one bit per cause (docs/integrate.md)',
                          'status')
CONTROLLER_ACTIVATION = Topic('controller_activation', UINT64, 'ns', 'when a controller became '
                              'active, said again and again while it is healthy: of two, '
                              'the later one yields', 'status')
DRIVE_STATE = Topic('drive_state', STRING, '', 'off, obeys, refuses (asked for torque and not in '
                    'its mode, or deaf to it), holds_on (asked to let go and doesn\'t) or lost '
                    '(no valid link); refuses and holds_on are said each 10 ms: they count only '
                    'while they are kept up', 'status')
DIAGNOSTICS = Topic('/diagnostics', DIAGNOSTIC_ARRAY, '', 'state, causes, input/command/output '
                    'triples, the force\'s uncertainty')
CLOCK = Topic('/clock', CLOCK_TYPE, 's', 'simulated time')

TOPICS: tuple[Topic, ...] = (
    JOINT_STATES, EFFORT_COMMAND, REFERENCE, POSITION_COMMAND, CLAMP_FORCE_COMMAND, DISTURBANCE,
    CLAMP_FORCE, LOAD_CELL, DISC_SPEED, PAD_TEMPERATURE, LOAD_TORQUE, FRICTION_TORQUE,
    CONTROL_REPORT, CONTROLLER_STATE, CONTROLLER_CAUSES, CONTROLLER_ACTIVATION, DRIVE_STATE,
    POSITION_COMMAND_STAMPED, CLAMP_FORCE_COMMAND_STAMPED, JOINT_COMMAND)

START_REFERENCE = Service('~/start_reference', TRIGGER,
                          'controller: begin the trajectory that parameter `reference` names')
CLEAR_FAULTS = Service('~/clear_faults', TRIGGER, 'controller: clear latched faults whose '
                       'condition is gone; it then holds the position and waits for commands')
ACCEPT_MODEL = Service('~/accept_model', TRIGGER, 'controller: take the model file of parameter '
                       '`candidate_model` into use, if it lies within bounds')
IDENTIFY = Service('~/identify', TRIGGER, 'identifier: identify from the samples collected so far')
WRITE_MODEL = Service('~/write_model', TRIGGER, 'identifier: write the identified model; the '
                      'answer\'s message is its path, or the YAML itself where no path is set')
CLEAR = Service('~/clear', TRIGGER, 'identifier: forget the samples collected so far')
RECORDED = Service('~/recorded', TRIGGER, 'recorder: how many messages of which topics are in the '
                   'bag; false while there are none')

SERVICES: tuple[Service, ...] = (START_REFERENCE, CLEAR_FAULTS, ACCEPT_MODEL, IDENTIFY,
                                 WRITE_MODEL, CLEAR, RECORDED)
