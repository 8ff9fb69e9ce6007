# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How the middleware carries a control loop's messages: without shared memory.

Over shared memory a publisher of Fast DDS 2.14 (Jazzy's) waits in `publish()` for the port of each
listener it has just discovered, a third of a second where that one is still starting, and up to a
second for one that was killed (`healthy_check_timeout_ms` in its SharedMemGlobal). A drive lets go
after a tenth: whoever joined the graph, with `ros2 topic echo`, could release the brake. Over UDP
nobody waits for anybody.
"""

from __future__ import annotations

from collections.abc import MutableMapping

from engb_ros.files import config_file

__all__ = ['share_no_memory', 'stay_on_this_computer', 'word_about']

_RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
_TRANSPORTS = 'FASTDDS_BUILTIN_TRANSPORTS'
_PROFILES = 'FASTRTPS_DEFAULT_PROFILES_FILE'


def share_no_memory(environment: MutableMapping[str, str]) -> None:
    """Have Fast DDS use UDP alone, unless the environment says what to use."""
    environment.setdefault(_TRANSPORTS, 'UDPv4')


def stay_on_this_computer(environment: MutableMapping[str, str]) -> None:
    """Have nodes discover each other on this computer only.

    What ROS itself has for this (LOCALHOST) makes rmw_fastrtps use shared memory, whatever else is
    asked for: Fast DDS gets a profile instead, unless it has one already.
    """
    if not _is_fastdds(environment):
        environment[_RANGE] = 'LOCALHOST'
    elif _PROFILES not in environment:
        environment[_PROFILES] = str(config_file('this_computer.xml'))
        environment[_RANGE] = 'SUBNET'


def word_about(environment: MutableMapping[str, str]) -> str:
    """Return what is to be told where memory is shared all the same; empty: nothing."""
    if not _is_fastdds(environment):
        return ''
    if environment.get(_RANGE) == 'LOCALHOST':
        return (f'{_RANGE}=LOCALHOST makes Fast DDS share memory: whoever joins the graph, or is '
                f'killed, can stop this loop for a second; leave it out, or set {_PROFILES} to '
                f'{config_file("this_computer.xml")}')
    if environment.get(_TRANSPORTS, 'DEFAULT') in ('DEFAULT', 'SHM', 'LARGE_DATA'):
        return (f'{_TRANSPORTS} makes Fast DDS share memory: whoever joins the graph, or is '
                'killed, can stop this loop for a second; UDPv4 does not')
    return ''


def _is_fastdds(environment: MutableMapping[str, str]) -> bool:
    return environment.get('RMW_IMPLEMENTATION', 'rmw_fastrtps_cpp').startswith('rmw_fastrtps')
