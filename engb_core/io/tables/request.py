# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a user says about a table, and what has to be asked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
import shlex

from engb_core.errors import InputError
from engb_core.io.tables.roles import QUANTITIES
from engb_core.io.tables.table import Table
from engb_core.io.tables.units import named

__all__ = ['Asker', 'Question', 'Request', 'positive', 'settled']


@dataclass(frozen=True)
class Question:
    """Something that a table does not tell.

    Attributes:
        subject: what it is about, for the message, such as 'the unit of position'.
        option: what answers it on the command line, with a usual answer filled in.
        words: the option's words before the answer itself: ('--unit', 'position=').
        choices: usual answers.
        default: what an empty answer stands for; '' where it must be answered.
        refused: why the answer before this one could not be taken; '' where there was none.
    """

    subject: str
    option: str
    words: tuple[str, str]
    choices: tuple[str, ...] = ()
    default: str = ''
    refused: str = ''


Asker = Callable[[Question], str]


@dataclass(frozen=True)
class Request:
    """Options of the commands that read tables.

    Attributes:
        columns: role → column, as the user names it.
        units: role → unit, as the user writes it.
        scale, offset: role → number that makes SI units of it.
        rate: samples per second, where there is no time [Hz].
        torque_constant: [N·m/A], where effort is a current; None: ask.
        effort_optional: whether a table without effort will do, where it has a reference.
        plain_is_si: whether a column that the user named, whose unit nobody told, is in SI units.
        command: the command so far, to which an answer is added.
        ask: how a question reaches the user; None: it does not.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    scale: Mapping[str, float] = field(default_factory=dict)
    offset: Mapping[str, float] = field(default_factory=dict)
    rate: float | None = None
    torque_constant: float | None = None
    effort_optional: bool = False
    plain_is_si: bool = False
    command: tuple[str, ...] = ('engb', 'import')
    ask: Asker | None = None

    def told(self, option: str, name: str, value: str) -> Request:
        """Return the request with an answer."""
        if option == '--column':
            return replace(self, columns={**self.columns, name: value})
        if option == '--unit':
            return replace(self, units={**self.units, name: value})
        number = positive(value, option)
        if option == '--rate':
            return replace(self, rate=number)
        if option == '--torque-constant':
            return replace(self, torque_constant=number)
        raise ValueError(f'no question is answered by {option}')


def positive(text: str, option: str) -> float:
    """Return a number above 0.

    Raises:
        InputError: it is none.
    """
    try:
        value = float(text.replace(',', '.'))
    except ValueError:
        value = 0.0
    if not 0.0 < value < float('inf'):
        raise InputError(f'{option} {text}: must be a number above 0')
    return value


def settled(request: Request, questions: list[Question], table: Table) -> Request:
    """Return the request with all questions about a table answered.

    An answer that can't be taken is asked for again, unless it is given again: that is no person.

    Raises:
        InputError: there is nobody to ask; the message has the command that answers them.
    """
    path = table.path
    if not questions:
        return request
    if request.ask is None:
        subjects = ' and '.join(question.subject for question in questions)
        options = _joined([question.option for question in questions])
        others = '; '.join(f'{question.words[1].strip("=") or question.words[0]} may be '
                           + ', '.join(question.choices)
                           for question in questions if len(question.choices) > 1)
        raise InputError(
            f'{path}: does not tell {subjects}. Say it, such as: '
            f'{shlex.join(request.command)} {options}' + (f'  ({others})' if others else ''))
    ask = request.ask
    for question in questions:
        before = None
        while True:
            answer = ask(question).strip() or question.default
            if not answer:
                raise InputError(f'{path}: {question.subject} is needed; give {question.option}')
            option, role = question.words[0], question.words[1].strip('=')
            try:
                _refuse_answer(table, option, role, answer)
                request = request.told(option, role, answer)
                break
            except InputError as error:
                if answer == before:
                    raise
                before, question = answer, replace(question, refused=str(error))
    return request


def _refuse_answer(table: Table, option: str, role: str, answer: str) -> None:
    """Raise InputError where a table has no such column, or a role no such unit."""
    if option == '--column':
        table.find(answer)
    elif option == '--unit':
        unit = named(answer, f'--unit {role}')
        if unit.quantity == 'counts':
            raise InputError(f'--unit {role}={answer}: say how many make one turn, such as '
                             '4096/rev')
        if unit.quantity not in QUANTITIES[role]:
            raise InputError(f'--unit {role}={answer}: {role} cannot be a {unit.quantity}')


def _joined(options: list[str]) -> str:
    """Join options, --unit once for all of its answers: `--unit position=deg effort=A`."""
    units = [option.removeprefix('--unit ') for option in options if option.startswith('--unit ')]
    others = [option for option in options if not option.startswith('--unit ')]
    return ' '.join([*others, *([f'--unit {" ".join(units)}'] if units else [])])
