# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The grammar of laws: one line of arithmetic over the brake's coordinates, read without `eval`.

    a * abs(load) * sin(k * position + c)

Names are coordinates (`COORDINATES`), functions (`FUNCTIONS`) or parameters; the operators are
+ − * / and **. Nothing else is read: no attribute, no index, no string, no call of anything that
does not stand in the table.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
import math
import threading

from engb_core.effects.base import (
    ACCELERATION,
    DIRECTION,
    DISC_ANGLE,
    DISC_SPEED,
    EFFORT,
    LOAD,
    PAD_TEMPERATURE,
    POSITION,
    TIME,
    VELOCITY,
)
from engb_core.errors import InputError

__all__ = ['Call', 'COORDINATES', 'Coordinate', 'Expression', 'FUNCTIONS', 'Function', 'Name',
           'Number', 'coordinates_of', 'has_memory', 'is_followed', 'parameters_of', 'parse',
           'printed', 'walk', 'with_names', 'with_values']


@dataclass(frozen=True)
class Coordinate:
    """A quantity that a law may depend on.

    `place` is its place in a sample (−1: it is followed from sample to sample); `unit` is that of
    a revolute joint; `memory` tells that it depends on what went before.
    """

    place: int
    unit: str
    memory: bool = False


COORDINATES: Mapping[str, Coordinate] = {
    'position': Coordinate(POSITION, 'rad'),
    'motor_angle': Coordinate(-1, 'rad'),
    'velocity': Coordinate(VELOCITY, 'rad/s'),
    'direction': Coordinate(DIRECTION, '-'),
    'acceleration': Coordinate(ACCELERATION, 'rad/s²'),
    'load': Coordinate(LOAD, 'N·m'),
    'effort': Coordinate(EFFORT, 'N·m'),
    'time': Coordinate(TIME, 's'),
    'disc_speed': Coordinate(DISC_SPEED, 'rad/s'),
    'disc_angle': Coordinate(DISC_ANGLE, 'rad'),
    'pad_temperature': Coordinate(PAD_TEMPERATURE, '°C'),
    'since_reversal': Coordinate(-1, 'rad', memory=True),
    'time_since_reversal': Coordinate(-1, 's', memory=True),
    'time_at_rest': Coordinate(-1, 's', memory=True),
    'distance': Coordinate(-1, 'rad', memory=True),
}


@dataclass(frozen=True)
class Function:
    """A function of the grammar: how many arguments, what it is, whether it has memory; a rate
    has none, but is followed from sample to sample."""

    arguments: int
    meaning: str
    memory: bool = False
    followed: bool = False


FUNCTIONS: Mapping[str, Function] = {
    'abs': Function(1, '|x|'),
    'sign': Function(1, '−1, 0 or 1'),
    'sqrt': Function(1, 'root of |x|, with the sign of x'),
    'exp': Function(1, 'exponential'),
    'sin': Function(1, 'sine'),
    'cos': Function(1, 'cosine'),
    'tanh': Function(1, 'levels off at −1 and 1'),
    'positive': Function(1, 'x where it is positive, else 0'),
    'max': Function(2, 'the larger one'),
    'min': Function(2, 'the smaller one'),
    'rate': Function(1, 'how fast x changes, per second', followed=True),
    'step': Function(2, 'step(x, w): from 0 to 1 where x passes 0, within about ±2 w'),
    'bell': Function(2, 'bell(x, w): exp(−½ (x/w)²)'),
    'peak': Function(1, '2 x / (1 + x²): rises to 1 at x = 1 and falls again, odd'),
    'lag': Function(2, 'lag(x, τ): z\' = (x − z)/τ in time, from x at the start', True),
    'heat': Function(2, 'heat(x, τ): z\' = (x − z)/τ in time, from 0 at the start', True),
    'travel_lag': Function(2, 'travel_lag(x, d): dz/ds = (x − z)/d over the way travelled', True),
    'stop': Function(2, 'stop(x, w): spring that slips, −1…1, over ±w of x', True),
    'drag': Function(2, 'drag(x, d): dz = (1 − z sgn dx) dx/d: bristles, −1…1', True),
    'rested': Function(2, 'rested(t, d): log(1 + rest/t), renewed within a way of d', True),
    'highest': Function(2, 'highest(x, τ): the largest x so far, fading with τ', True),
}


@dataclass(frozen=True)
class Number:
    """A number."""

    value: float


@dataclass(frozen=True)
class Name:
    """A coordinate or a parameter."""

    name: str


@dataclass(frozen=True)
class Call:
    """A function or an operator ('+', '-', '*', '/', '**', 'neg') and its arguments."""

    function: str
    arguments: tuple[Expression, ...]


Expression = Number | Name | Call

_OPERATORS = {ast.Add: '+', ast.Sub: '-', ast.Mult: '*', ast.Div: '/', ast.Pow: '**'}
# How tightly an operator binds, for brackets.
_BINDS = {'+': 1, '-': 1, '*': 2, '/': 2, 'neg': 3, '**': 4}
# A line that a person can read, and a nesting that no stack overflows at.
LONGEST = 400
# CPython counts the depth of a syntax tree once for all threads (python/cpython#106905): a thread
# that goes on while another's tree is being made, since a finalizer ran there, ends in a
# SystemError. The lock is reentrant, since that finalizer may itself read a formula.
_PARSING = threading.RLock()


def parse(text: str) -> Expression:
    """Return the expression of one line.

    Raises:
        InputError: not of the grammar; the message says what is wrong.
    """
    if not isinstance(text, str) or not text.strip():
        raise InputError('formula is empty; write one such as "a * abs(load)"')
    if len(text) > LONGEST:
        raise InputError(f'formula has {len(text)} characters; at most {LONGEST} are read')
    try:
        with _PARSING:
            tree = ast.parse(text.strip(), mode='eval')
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InputError(f'formula {text!r} is no arithmetic; write one such as '
                         '"a * abs(load) * sin(k * position + c)"') from None
    return _read(tree.body, text)


def _read(node: ast.AST, text: str) -> Expression:
    # True and False are integers to Python, but no numbers of a formula.
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) \
            and not isinstance(node.value, bool) and math.isfinite(node.value):
        return Number(float(node.value))
    if isinstance(node, ast.Name):
        return Name(node.id)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
        inner = _read(node.operand, text)
        return inner if isinstance(node.op, ast.UAdd) else Call('neg', (inner,))
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        return Call(_OPERATORS[type(node.op)], (_read(node.left, text), _read(node.right, text)))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        name = node.func.id
        if name not in FUNCTIONS:
            raise InputError(f'formula {text!r}: no function {name!r}; there are '
                             f'{", ".join(FUNCTIONS)}')
        if len(node.args) != FUNCTIONS[name].arguments:
            raise InputError(f'formula {text!r}: {name} takes {FUNCTIONS[name].arguments} '
                             f'arguments, not {len(node.args)}')
        return Call(name, tuple(_read(entry, text) for entry in node.args))
    raise InputError(f'formula {text!r}: only numbers, names, + - * / ** and the functions '
                     f'{", ".join(FUNCTIONS)} are read')


def printed(expression: Expression, digits: int = 6) -> str:
    """Return the expression as one line that `parse` reads."""
    return _print(expression, digits)[0]


def _print(expression: Expression, digits: int) -> tuple[str, int]:
    if isinstance(expression, Number):
        return f'{expression.value:.{digits}g}', 5 if expression.value >= 0 else 3
    if isinstance(expression, Name):
        return expression.name, 5
    function, given = expression.function, expression.arguments
    if function == 'neg':
        inner, binds = _print(given[0], digits)
        return (f'-{inner}' if binds >= 2 else f'-({inner})'), 3
    if function not in _BINDS:
        return f'{function}({", ".join(_print(entry, digits)[0] for entry in given)})', 5
    (left, left_binds), (right, right_binds) = (_print(entry, digits) for entry in given)
    own = _BINDS[function]
    if function == '+' and right.startswith('-') and right_binds >= own:
        function, right = '-', right[1:]
    if left_binds < own or (function == '**' and left_binds <= own):
        left = f'({left})'
    if right_binds < own or (right_binds == own and function in ('-', '/')):
        right = f'({right})'
    return f'{left} {function} {right}' if function != '**' else f'{left}**{right}', own


def walk(expression: Expression) -> Iterator[Expression]:
    """Yield the expression and all that is in it."""
    yield expression
    if isinstance(expression, Call):
        for entry in expression.arguments:
            yield from walk(entry)


def coordinates_of(expression: Expression) -> tuple[str, ...]:
    """Return the coordinates in it, in order of appearance."""
    return tuple(dict.fromkeys(entry.name for entry in walk(expression)
                               if isinstance(entry, Name) and entry.name in COORDINATES))


def parameters_of(expression: Expression) -> tuple[str, ...]:
    """Return the names in it that are no coordinates, in order of appearance."""
    return tuple(dict.fromkeys(entry.name for entry in walk(expression)
                               if isinstance(entry, Name) and entry.name not in COORDINATES))


def has_memory(expression: Expression) -> bool:
    """Whether it depends on what went before."""
    return any((isinstance(entry, Call) and entry.function in FUNCTIONS
                and FUNCTIONS[entry.function].memory)
               or (isinstance(entry, Name) and entry.name in COORDINATES
                   and COORDINATES[entry.name].memory) for entry in walk(expression))


def is_followed(expression: Expression) -> bool:
    """Whether something in it is carried from sample to sample: memory, or a rate of change."""
    return has_memory(expression) or any(
        isinstance(entry, Call) and entry.function in FUNCTIONS
        and FUNCTIONS[entry.function].followed for entry in walk(expression))


def with_values(expression: Expression, values: Mapping[str, float]) -> Expression:
    """Return the expression with numbers in place of these parameters."""
    if isinstance(expression, Name) and expression.name in values:
        value = float(values[expression.name])
        return Number(value) if value >= 0.0 else Call('neg', (Number(-value),))
    if isinstance(expression, Call):
        return Call(expression.function,
                    tuple(with_values(entry, values) for entry in expression.arguments))
    return expression


def with_names(expression: Expression, names: Mapping[str, str]) -> Expression:
    """Return the expression with other names for its parameters."""
    if isinstance(expression, Name):
        return Name(names.get(expression.name, expression.name))
    if isinstance(expression, Call):
        return Call(expression.function,
                    tuple(with_names(entry, names) for entry in expression.arguments))
    return expression
