# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the commands that read tables share: their options, questions, and what was taken."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import math
import sys
from typing import Any, TYPE_CHECKING

from engb_core.errors import InputError
from engb_core.io.tables.request import Question, Request
from engb_core.text.printable import printable

if TYPE_CHECKING:
    from engb_core.model import Model

__all__ = ['TABLES', 'add_table_options', 'pairs_of', 'refuse_idle', 'request_of']

TABLES = '.csv, .json, .npz, .mat, .h5, .mf4, .tdms, .parquet, .arrow or .bag'


def add_table_options(parser: argparse.ArgumentParser, several: bool = True) -> None:
    """Add what a user may say of a table; with `several`, an option takes several NAME=VALUE."""
    group = parser.add_argument_group('tables', f'of what is no recording but a table ({TABLES})')
    many: dict[str, Any] = {'nargs': '+', 'action': 'extend'} if several else {'action': 'append'}
    again = '' if several else ' (repeat)'
    group.add_argument('--column', default=[], metavar='NAME=COLUMN', help='which column is '
                       'what: time, position, effort, velocity, reference, …; by its title or '
                       'its number from 0' + again, **many)
    group.add_argument('--unit', default=[], metavar='NAME=UNIT', nargs='+', action='extend',
                       help='units that the titles do not tell: position=deg effort=A time=ms; '
                       '4096/rev for counts of an encoder')
    group.add_argument('--scale', default=[], metavar='NAME=FACTOR', help='multiply a column to '
                       'get SI units' + again, **many)
    group.add_argument('--offset', default=[], metavar='NAME=VALUE', help='add to a column, after '
                       'scaling, in SI units' + again, **many)
    group.add_argument('--rate', metavar='HZ', help='samples per second, where there is no time')
    group.add_argument('--torque-constant', metavar='N·m/A', help='of the motor, where effort is '
                       'a current; 1 where nobody knows: then torques are told in ampere')


def request_of(arguments: argparse.Namespace, model: Model | None = None,
               plain_is_si: bool = False) -> Request:
    """Return what the options say; a model file tells the torque constant.

    Raises:
        InputError: an option is not understood.
    """
    from engb_core.io.tables.request import positive
    numbers = {}
    for option in ('rate', 'torque_constant'):
        given = getattr(arguments, option)
        if given is not None:
            numbers[option] = positive(given, '--' + option.replace('_', '-'))
    if model is not None:
        numbers.setdefault('torque_constant', model.motor.torque_constant)
    return Request(
        columns=pairs_of(arguments.column, '--column', 'angle'),
        units=pairs_of(arguments.unit, '--unit', 'deg'),
        scale=_numbers(arguments.scale, '--scale'), offset=_numbers(arguments.offset, '--offset'),
        effort_optional=model is not None, plain_is_si=plain_is_si, command=arguments.command_line,
        ask=_ask if sys.stdin.isatty() and sys.stderr.isatty() else None, **numbers)


def refuse_idle(arguments: argparse.Namespace, paths: Sequence[str],
                constant_kept: bool = True) -> None:
    """Raise InputError where an option was given that none of these inputs is concerned by:
    whoever gave it believes that it acts.

    Args:
        arguments: of the command.
        paths: all that it reads.
        constant_kept: whether a torque constant goes into the model that is made.
    """
    from engb_core.io.tables.open import is_table
    tables = [is_table(path) for path in paths]
    given = [option for option in ('column', 'unit', 'scale', 'offset', 'rate',
                                   *(() if constant_kept else ('torque_constant',)))
             if getattr(arguments, option)]
    if given and not any(tables):
        raise InputError(f'--{given[0].replace("_", "-")}: has no effect, since no input is a '
                         'table; leave it out')
    if arguments.namespace is not None and all(tables):
        raise InputError(f'--namespace {arguments.namespace}: has no effect on a table; leave it '
                         'out')


def pairs_of(entries: Sequence[str], option: str, example: str) -> dict[str, str]:
    """Return NAME=VALUE options as a mapping.

    Raises:
        InputError: one is not of that form, or a name is given twice.
    """
    found: dict[str, str] = {}
    for entry in entries:
        name, equals, value = entry.partition('=')
        name, value = name.strip(), value.strip()
        if not (equals and name and value):
            raise InputError(f'{option} {entry}: write NAME=VALUE, such as position={example}')
        if name in found:
            raise InputError(f'{option} {name}=…: given twice')
        found[name] = value
    return found


def _numbers(entries: Sequence[str], option: str) -> dict[str, float]:
    found = {}
    for name, text in pairs_of(entries, option, '0.0174533').items():
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InputError(f'{option} {name}={text}: must be a finite number')
        found[name] = value
    return found


def _ask(question: Question) -> str:
    choices = f' ({", ".join(question.choices[:8])})' if question.choices else ''
    default = f' [{question.default}]' if question.default else ''
    # What is being done stands in the line.
    print('\r\033[K' + (f'{printable(question.refused)}\n' if question.refused else '')
          + printable(f'{_spoken(question.subject)}?{choices}{default}: '), end='',
          file=sys.stderr, flush=True)
    return sys.stdin.readline()


def _spoken(subject: str) -> str:
    """Return what a question is about as a question."""
    return (subject[0].upper() + subject[1:] if subject.startswith(('which ', 'how many '))
            else f'What is {subject}')
