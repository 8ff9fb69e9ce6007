# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a node answers on its command line without starting: `--help`, and options that are none.

ROS leaves to a node what does not stand behind `--ros-args`. A node of this package has no options
of its own, so a parameter given without `--ros-args` would set nothing, and the node would work
with its defaults.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import inspect
import sys
import textwrap
from typing import Any, NamedTuple

from engb_ros import interface
from engb_ros.interface import Service, SERVICES, Topic
from engb_ros.nodes.parameters import ParameterSpec, shown_default, shown_range

__all__ = ['answer_without_ros', 'ENDPOINTS', 'Endpoints', 'help_text']

_WIDTH = 99


class Endpoints(NamedTuple):
    """Topics of a node: those that it publishes, and those that it hears."""

    publishes: tuple[Topic, ...] = ()
    hears: tuple[Topic, ...] = ()


_OF_A_DRIVE = (interface.JOINT_STATES, interface.DISC_SPEED, interface.PAD_TEMPERATURE)
_TORQUE = (interface.EFFORT_COMMAND, interface.JOINT_COMMAND)

# By name of the node; some of them with certain parameters only, which say so themselves.
ENDPOINTS: dict[str, Endpoints] = {
    'plant': Endpoints((*_OF_A_DRIVE, interface.LOAD_CELL, interface.CLOCK), _TORQUE),
    'can_bridge': Endpoints((*_OF_A_DRIVE, interface.DRIVE_STATE, interface.DIAGNOSTICS),
                            _TORQUE),
    'drive_emulator': Endpoints(),
    'controller': Endpoints(
        (interface.EFFORT_COMMAND, interface.REFERENCE, interface.CONTROL_REPORT,
         interface.CLAMP_FORCE, interface.CONTROLLER_STATE, interface.CONTROLLER_CAUSES,
         interface.CONTROLLER_ACTIVATION, interface.DIAGNOSTICS),
        (interface.JOINT_STATES, interface.POSITION_COMMAND, interface.POSITION_COMMAND_STAMPED,
         interface.CLAMP_FORCE_COMMAND, interface.CLAMP_FORCE_COMMAND_STAMPED,
         interface.DISTURBANCE, interface.DISC_SPEED, interface.DRIVE_STATE,
         interface.CONTROLLER_ACTIVATION, interface.CONTROLLER_STATE,
         interface.EFFORT_COMMAND)),
    'disturbance_observer': Endpoints((interface.DISTURBANCE,), (interface.JOINT_STATES,)),
    'identifier': Endpoints((interface.LOAD_TORQUE, interface.FRICTION_TORQUE),
                            (interface.JOINT_STATES,)),
    'recorder': Endpoints((), (*interface.TOPICS, interface.DIAGNOSTICS, interface.CLOCK)),
    'monitor': Endpoints((interface.DIAGNOSTICS,), (interface.JOINT_STATES,)),
    'excitation': Endpoints((interface.EFFORT_COMMAND,), (interface.JOINT_STATES,)),
}


def answer_without_ros(node: Callable[..., Any], args: Sequence[str] | None = None) -> int | None:
    """Print the help that is asked for, or what is wrong with the options, and return the exit
    status; None where the node is to run.

    Args:
        node: a class of nodes.
        args: with the program's name, as sys.argv, which stands for None.
    """
    own = _without_ros_args(list(sys.argv if args is None else args)[1:])
    if not own:
        return None
    if '--help' in own or '-h' in own:
        print(help_text(node))
        return 0
    name = getattr(node, 'node_name', 'node')
    print(f'{name}: {" ".join(own)}: no option of this node, nothing would be set; write '
          '--ros-args -p name:=value (--help lists the parameters)', file=sys.stderr, flush=True)
    return 2


def _without_ros_args(args: Sequence[str]) -> list[str]:
    """Return what does not stand between --ros-args and its end, `--`. rcl's own function takes
    `name:=value` that stands elsewhere for a remapping, as ROS 1 did."""
    own, of_ros = [], False
    for word in args:
        if word == '--ros-args':
            of_ros = True
        elif of_ros:
            of_ros = word != '--'
        else:
            own.append(word)
    return own


def help_text(node: Any) -> str:
    """Return what a node does, its parameters with their defaults, its topics and services.

    Args:
        node: a class of nodes.
    """
    from engb_ros.nodes.base import AUTOSTART
    name = node.node_name
    module = inspect.getdoc(inspect.getmodule(node)) or ''
    parts = [f'usage: ros2 run engb_ros {name} [--help] [--ros-args [-p NAME:=VALUE …] '
             '[--params-file FILE] [-r __ns:=NAMESPACE] …]', module, inspect.getdoc(node) or '',
             'parameters (-p NAME:=VALUE behind --ros-args):\n'
             + _parameters((AUTOSTART, *node.parameters))]
    endpoints = ENDPOINTS.get(name, Endpoints())
    own = [service for service in SERVICES if service.meaning.startswith(f'{name}: ')]
    for title, entries in (('publishes', endpoints.publishes), ('hears', endpoints.hears),
                           ('services', own)):
        if entries:
            parts.append(f'{title} (relative to the namespace):\n' + _listed(entries))
    return '\n\n'.join(part.strip() for part in parts if part)


def _parameters(specs: Iterable[ParameterSpec]) -> str:
    lines = []
    for spec in specs:
        unit = f' {spec.unit}' if spec.unit and spec.unit != '-' else ''
        limits = shown_range(spec)
        more = [*([limits + (unit if not spec.choices else '')] if limits else []),
                *(['live'] if spec.live else [])]
        lines.append(f'  {spec.name} := {shown_default(spec.default)}{unit}'
                     + (f'   ({"; ".join(more)})' if more else ''))
        lines += _wrapped(spec.description)
    return '\n'.join(lines)


def _listed(entries: Iterable[Topic | Service]) -> str:
    lines = []
    for entry in entries:
        unit = f' [{entry.unit}]' if isinstance(entry, Topic) and entry.unit else ''
        lines += [f'  {entry.name}  {entry.type}', *_wrapped(entry.meaning + unit)]
    return '\n'.join(lines)


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, _WIDTH, initial_indent=' ' * 6, subsequent_indent=' ' * 6,
                         break_long_words=False, break_on_hyphens=False)
