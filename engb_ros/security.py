# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Writes the SROS2 policy of one brake, from the interface: who may say what.

Reading is open to every enclave of the brake; what is restricted is speaking. Commands of the
stack are for the enclave `stack` alone, torque for the controller, angles for the drive, the
services of the nodes for `stack` and, with the parameters, for `service`.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
import sys
import xml.etree.ElementTree as ElementTree

from engb_ros import interface
from engb_ros.interface import DEFAULT_NAMESPACE, SERVICES, Topic, TOPICS

__all__ = ['ENCLAVES', 'main', 'may_publish', 'policy']

DRIVES = ('plant', 'can_bridge')
CONTROLLERS = ('controller', 'standby')
NODES = (*DRIVES, 'drive_emulator', *CONTROLLERS, 'disturbance_observer', 'identifier', 'recorder',
         'monitor', 'excitation')

# Who speaks for the vehicle, who services a brake, who starts and ends its nodes, and
# ros2_control's hardware interface.
STACK, SERVICE, MANAGER, ROS2_CONTROL = 'stack', 'service', 'lifecycle_manager', 'ros2_control'
ENCLAVES = (*NODES, STACK, SERVICE, MANAGER, ROS2_CONTROL)

_SPEAKERS: dict[str, tuple[str, ...]] = {
    interface.JOINT_STATES.name: DRIVES, interface.DISC_SPEED.name: DRIVES,
    interface.PAD_TEMPERATURE.name: DRIVES, interface.DRIVE_STATE.name: DRIVES,
    interface.EFFORT_COMMAND.name: (*CONTROLLERS, 'excitation'),
    interface.JOINT_COMMAND.name: (ROS2_CONTROL,),
    interface.DISTURBANCE.name: ('disturbance_observer',),
    interface.LOAD_TORQUE.name: ('identifier',), interface.FRICTION_TORQUE.name: ('identifier',),
    interface.DIAGNOSTICS.name: NODES, interface.CLOCK.name: ('plant',),
}

_LIFECYCLE = ('change_state', 'get_available_states', 'get_available_transitions', 'get_state',
              'get_transition_graph')
_PARAMETERS = ('describe_parameters', 'get_parameter_types', 'get_parameters', 'list_parameters',
               'set_parameters', 'set_parameters_atomically', 'get_type_description')


def may_publish(topic: Topic) -> tuple[str, ...]:
    """Return the enclaves that may publish a topic: a request is the stack's, and everything else
    the controllers', unless it is said otherwise."""
    return _SPEAKERS.get(topic.name, (STACK,) if topic.kind == 'request' else CONTROLLERS)


def policy(namespace: str = DEFAULT_NAMESPACE) -> ElementTree.Element:
    """Return the policy of one brake, after sros2's schema (version 0.2.0)."""
    root = ElementTree.Element('policy', version='0.2.0')
    enclaves = ElementTree.SubElement(root, 'enclaves')
    for name in ENCLAVES:
        enclave = ElementTree.SubElement(enclaves, 'enclave', path=f'{namespace}/{name}')
        profile = ElementTree.SubElement(
            ElementTree.SubElement(enclave, 'profiles'), 'profile', ns=namespace, node=name)
        every = (*TOPICS, interface.DIAGNOSTICS, interface.CLOCK)
        _rule(profile, 'topics', 'topic', 'subscribe',
              [topic.name for topic in every] + ['/parameter_events'])
        _rule(profile, 'topics', 'topic', 'publish',
              [topic.name for topic in every if name in may_publish(topic)]
              + ['/parameter_events', '/rosout', '~/transition_event'])
        own = [service.name for service in SERVICES if name in _nodes_of(service.meaning)]
        _rule(profile, 'services', 'service', 'reply',
              own + [f'~/{each}' for each in (*_LIFECYCLE, *_PARAMETERS)])
        asked = {STACK: (), SERVICE: (*_LIFECYCLE, *_PARAMETERS), MANAGER: _LIFECYCLE}
        if name in asked:
            of_nodes = [f'{node}/{each}' for node in NODES for each in asked[name]]
            if name != MANAGER:
                of_nodes += [service.name.replace('~', node) for service in SERVICES
                             for node in _nodes_of(service.meaning)]
            _rule(profile, 'services', 'service', 'request', of_nodes)
    ElementTree.indent(root)
    return root


def _nodes_of(meaning: str) -> tuple[str, ...]:
    """Return the nodes that serve: a service's meaning begins with their name."""
    node = meaning.partition(':')[0]
    return CONTROLLERS if node in CONTROLLERS else (node,)


def _rule(profile: ElementTree.Element, kind: str, entry: str, what: str,
          names: Sequence[str]) -> None:
    rule = ElementTree.SubElement(profile, kind, {what: 'ALLOW'})
    for name in names:
        ElementTree.SubElement(rule, entry).text = name


def main(args: Sequence[str] | None = None) -> int:
    """Write the policy of each namespace's brake."""
    parser = argparse.ArgumentParser(prog='python -m engb_ros.security', description=__doc__)
    parser.add_argument('--namespace', default=DEFAULT_NAMESPACE, help='of the brake')
    parser.add_argument('--out', required=True, help='policy file, made anew')
    options = parser.parse_args(args)
    path = Path(options.out)
    try:
        with path.open('x', encoding='utf-8') as out:
            out.write(ElementTree.tostring(policy(options.namespace), encoding='unicode') + '\n')
    except OSError as error:
        print(f'{path}: cannot be written ({error.strerror}); --out names a new file in a folder '
              'that exists', file=sys.stderr)
        return 2
    return 0


if __name__ == '__main__':
    sys.exit(main())
