# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The package's topics and services: the only place where the services' names are written.

What a recording holds of the topics is named in `engb_core.io.recorded_topics`, which the
offline commands use; what turns messages into numbers is in `engb_ros.nodes.messages`. Importing
this needs no ROS installation. Names are relative, so a namespace makes four wheels out of one.
"""

from __future__ import annotations

from dataclasses import dataclass

from engb_core.io.recorded_topics import (
    CLAMP_FORCE,
    CLAMP_FORCE_COMMAND,
    CLAMP_FORCE_COMMAND_STAMPED,
    CONTROL_REPORT,
    DISC_SPEED,
    DISTURBANCE,
    EFFORT_COMMAND,
    FLOAT64,
    FRICTION_TORQUE,
    JOINT_COMMAND,
    JOINT_STATE,
    JOINT_STATES,
    LOAD_CELL,
    LOAD_TORQUE,
    PAD_TEMPERATURE,
    POSITION_COMMAND,
    POSITION_COMMAND_STAMPED,
    RECORDED_TOPICS,
    REFERENCE,
    Topic,
)

__all__ = ['ACCEPT_MODEL', 'CLAMP_FORCE', 'CLAMP_FORCE_COMMAND', 'CLEAR', 'CLEAR_FAULTS', 'CLOCK',
           'CLAMP_FORCE_COMMAND_STAMPED', 'CLOCK_TYPE', 'CONTROLLER_ACTIVATION',
           'CONTROLLER_CAUSES', 'CONTROLLER_STATE', 'CONTROL_REPORT', 'DEFAULT_NAMESPACE',
           'DIAGNOSTICS', 'DIAGNOSTIC_ARRAY', 'DISC_SPEED', 'DISTURBANCE', 'DRIVE_STATE',
           'EFFORT_COMMAND', 'FLOAT64', 'FRICTION_TORQUE', 'IDENTIFY', 'JOINT_COMMAND',
           'JOINT_STATE', 'JOINT_STATES', 'LOAD_CELL', 'LOAD_TORQUE', 'PAD_TEMPERATURE',
           'POSITION_COMMAND', 'POSITION_COMMAND_STAMPED', 'RECORDED', 'REFERENCE', 'SERVICES',
           'START_REFERENCE', 'STRING', 'Service', 'TOPICS', 'TRIGGER', 'Topic', 'UINT32',
           'UINT64', 'WRITE_MODEL']

STRING = 'std_msgs/msg/String'
UINT32 = 'std_msgs/msg/UInt32'
UINT64 = 'std_msgs/msg/UInt64'
DIAGNOSTIC_ARRAY = 'diagnostic_msgs/msg/DiagnosticArray'
CLOCK_TYPE = 'rosgraph_msgs/msg/Clock'
TRIGGER = 'std_srvs/srv/Trigger'

DEFAULT_NAMESPACE = '/engb'


@dataclass(frozen=True)
class Service:
    """One service: its name relative to the node ('~/…'), its type and what it does."""

    name: str
    type: str
    meaning: str


CONTROLLER_STATE = Topic('controller_state', STRING, '',
                         'ready, enabled, degraded, fault or inactive', 'status')
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

TOPICS: tuple[Topic, ...] = (*RECORDED_TOPICS, CONTROLLER_STATE, CONTROLLER_CAUSES,
                             CONTROLLER_ACTIVATION, DRIVE_STATE)

START_REFERENCE = Service('~/start_reference', TRIGGER,
                          'controller: begin the trajectory that parameter `reference` names')
CLEAR_FAULTS = Service('~/clear_faults', TRIGGER, 'controller: clear latched faults whose '
                       'condition is gone; it then holds the position and waits for commands, or '
                       'for ~/start_reference where `reference` is a trajectory')
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
