# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A law as one line for reading: T = 0.031(2) N·m · |load| · sin(1.249(1) θ + 3.84(5))."""

from __future__ import annotations

from collections.abc import Mapping
import math

from engb_core.diagnose.diagnosis import ParameterEstimate
from engb_core.laws.grammar import Call, Expression, Name, Number

__all__ = ['LONGEST_LINE', 'line_of', 'with_error']

# What fits beside a picture, and into one look.
LONGEST_LINE = 60
_PLACES = {'torque': 'T', 'friction_gain': 'ΔT_C/T_C', 'load_gain': 'ΔT_L/T_L',
           'effort_gain': 'ΔT_M/T_M', 'inertia': 'ΔJ', 'position_shift': 'Δθ',
           'delay': 'delay', 'position_delay': 'delay', 'load_shift': 'Δθ_L'}
# As textbooks write them; where there is no common sign, the word stays.
_COORDINATES = {'position': 'θ', 'motor_angle': 'θ', 'velocity': 'ω', 'direction': 'sgn ω',
                'acceleration': 'ω̇', 'time': 't'}


def line_of(acts_as: str, pattern: Expression, parameters: Mapping[str, ParameterEstimate],
            ) -> str:
    """Return a law with its numbers, their standard errors and the unit of its size.

    Where the line would be longer than `LONGEST_LINE`, first the errors of the shapes' numbers
    are left out, then their last digits.

    Args:
        acts_as: where it acts.
        pattern: with the names of its parameters, the amplitude first.
        parameters: their estimates; shapes' numbers are in SI units.
    """
    size = next(iter(parameters))
    found = ''
    for errors, digits in ((True, 4), (False, 4), (False, 3), (False, 2)):
        names = {name: with_error(entry) if name == size else
                 with_error(entry, unit=False) if errors else f'{entry.value:.{digits}g}'
                 for name, entry in parameters.items()}
        found = f'{_PLACES[acts_as]} = {_read(pattern, names)}'
        if len(found) <= LONGEST_LINE:
            break
    return found


def with_error(entry: ParameterEstimate, unit: bool = True) -> str:
    """Return a number with its standard error in the last digit, and its unit."""
    after = f' {entry.unit}' if unit and entry.unit not in ('-', '') else ''
    if not entry.std or not math.isfinite(entry.std) or entry.std >= abs(entry.value):
        return f'{entry.value:.3g}{after}'
    place = math.floor(math.log10(entry.std))
    error = round(entry.std / 10.0 ** place)
    if error == 10:
        place, error = place + 1, 1
    if place >= 0:
        return f'{round(entry.value, -place):.0f}({error * 10 ** place}){after}'
    if abs(entry.value) >= 1e-3:
        return f'{entry.value:.{-place}f}({error}){after}'
    power = math.floor(math.log10(abs(entry.value)))
    return f'{entry.value / 10.0 ** power:.{max(power - place, 0)}f}({error})e{power}{after}'


def _read(expression: Expression, names: Mapping[str, str]) -> str:
    """Return an expression for reading, not for parsing: · for products, |x| for abs."""
    if isinstance(expression, Number):
        return f'{expression.value:g}'
    if isinstance(expression, Name):
        return names.get(expression.name, _COORDINATES.get(expression.name, expression.name))
    given = [_read(entry, names) for entry in expression.arguments]
    operator = expression.function
    if operator == '*':
        # A number stands before what it multiplies, a factor beside a factor.
        inner = isinstance(expression.arguments[0], (Name, Number)) \
            and given[0][:1].isdigit() and given[1] in _COORDINATES.values()
        given = [_closed(text, entry) for text, entry in
                 zip(given, expression.arguments, strict=True)]
        return f'{given[0]} {given[1]}' if inner and ' ' not in given[0] else ' · '.join(given)
    if operator in ('+', '-'):
        sign = operator.replace('-', '−')
        # A negative number is taken away: θ − −3.8 is nobody's way to write.
        if given[1].startswith('-'):
            sign, given[1] = {'+': '−', '−': '+'}[sign], given[1][1:]
        return f'{given[0]} {sign} {given[1]}'
    if operator == 'neg':
        return f'−{_closed(given[0], expression.arguments[0])}'
    if operator == '/':
        return '/'.join(_closed(text, entry) for text, entry in
                        zip(given, expression.arguments, strict=True))
    if operator == '**':
        return f'{_closed(given[0], expression.arguments[0])}^{given[1]}'
    return f'|{given[0]}|' if operator == 'abs' else f'{operator}({", ".join(given)})'


def _closed(text: str, expression: Expression) -> str:
    """Return the text of a factor, in brackets where it is a sum."""
    sums = isinstance(expression, Call) and expression.function in ('+', '-')
    return f'({text})' if sums else text
