# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A law as one line for reading: T = 0.031(2) N·m · |load| · sin(1.249(1) θ + 3.84(5)).

A line has at most `LONGEST_LINE` characters. Where all of it needs more, it is first written
shorter: shapes' numbers without errors and with the digits that their errors leave, then common
symbols for words. Where that is not enough, which a law of several long factors needs, the longest
factors stand as letters in the line and are told below it. Nothing is cut off.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import math
from typing import NamedTuple

from engb_core.diagnose.diagnosis import ParameterEstimate
from engb_core.laws.grammar import Call, Expression, Name, Number, walk

__all__ = ['Line', 'line_of', 'LONGEST_LINE', 'with_error']

# What fits beside a picture, and into one look.
LONGEST_LINE = 60
_PLACES = {'torque': 'T', 'friction_gain': 'ΔT_C/T_C', 'load_gain': 'ΔT_L/T_L',
           'effort_gain': 'ΔT_M/T_M', 'inertia': 'ΔJ', 'position_shift': 'Δθ',
           'delay': 'delay', 'position_delay': 'delay', 'load_shift': 'Δθ_L'}
# As textbooks write them; where there is no common sign, the word stays.
_COORDINATES = {'position': 'θ', 'motor_angle': 'θ', 'velocity': 'ω', 'direction': 'sgn ω',
                'acceleration': 'ω̇', 'time': 't'}
# The same where words are too long, and what has to be said of each symbol then.
_SYMBOLS = {'load': ('T_L', 'the load'), 'effort': ('T_M', 'the effort'),
            'disc_speed': ('ω_d', 'the disc speed'), 'disc_angle': ('θ_d', 'the disc angle'),
            'pad_temperature': ('ϑ', 'the pad temperature'),
            'since_reversal': ('s_r', 'the way since the last reversal'),
            'time_since_reversal': ('t_r', 'the time since the last reversal'),
            'time_at_rest': ('t_s', 'the time at rest'), 'distance': ('s', 'the way travelled')}
_POSITIVE = 'x₊', 'x where it is positive, else 0'
_POWERS = {'2': '²', '3': '³', '4': '⁴'}
_LETTERS = 'fghklmnpqruz'
# Significant digits of a shape's number whose error says that it has more.
_MOST_DIGITS = 4


class Line(NamedTuple):
    """A law's line, at most `LONGEST_LINE` characters of text, and what has to be said below it:
    factors that stand as letters in it, and symbols that are not common."""

    text: str
    below: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return both in one sentence's part."""
        return f'{self.text}, where {", ".join(self.below)}' if self.below else self.text


class _Style(NamedTuple):
    """How short: shapes' numbers with errors, with so many digits at most and no more than their
    errors leave, symbols for words."""

    errors: bool
    digits: int
    symbols: bool = False


_STYLES = (_Style(True, _MOST_DIGITS), _Style(False, _MOST_DIGITS),
           _Style(False, _MOST_DIGITS, True), _Style(False, 3, True))


def line_of(acts_as: str, pattern: Expression, parameters: Mapping[str, ParameterEstimate],
            ) -> Line:
    """Return a law with its numbers, their standard errors and the unit of its size.

    Args:
        acts_as: where it acts.
        pattern: with the names of its parameters, the amplitude first.
        parameters: their estimates; shapes' numbers are in SI units.
    """
    before = f'{_PLACES[acts_as]} = '
    size = next(iter(parameters))
    for style in _STYLES:
        names = _numbers(size, parameters, style)
        found = before + _read(pattern, names, style.symbols)
        if len(found) <= LONGEST_LINE:
            return Line(found, _legend(pattern) if style.symbols else ())
    return _in_parts(before, pattern, size, parameters)


def _numbers(size: str, parameters: Mapping[str, ParameterEstimate], style: _Style,
             ) -> dict[str, str]:
    return {name: with_error(entry) if name == size else
            with_error(entry, unit=False) if style.errors else _known_digits(entry, style.digits)
            for name, entry in parameters.items()}


def _in_parts(before: str, pattern: Expression, size: str,
              parameters: Mapping[str, ParameterEstimate]) -> Line:
    """Return the line with its longest factors as letters, told below with all their digits; where
    the unit alone is too long, that too."""
    plain = _numbers(size, parameters, _Style(False, _MOST_DIGITS))
    told = _numbers(size, parameters, _Style(True, _MOST_DIGITS))
    factors = list(_factors(pattern))
    texts = [_closed(_read(entry, plain, symbols=False), entry) for entry in factors]
    own = [place for place, entry in enumerate(factors) if Name(size) in walk(entry)]
    longest = sorted((place for place in range(len(factors)) if place not in own),
                     key=lambda place: -len(texts[place]))
    for count in range(1, len(longest) + 1):
        # In the order in which they stand in the line.
        letters = dict(zip(sorted(longest[:count]), _LETTERS, strict=False))
        found = before + ' · '.join(letters.get(place, text) for place, text in enumerate(texts))
        if len(found) <= LONGEST_LINE:
            break
    below = [f'{letter} = {_read(factors[place], told, symbols=False)}'
             for place, letter in letters.items()]
    if len(found) > LONGEST_LINE:
        found = found.replace(told[size], with_error(parameters[size], unit=False))
        below.append(f'the number before them in {parameters[size].unit}')
    return Line(found, tuple(below))


def _factors(expression: Expression) -> Iterator[Expression]:
    """Yield what a product multiplies."""
    if isinstance(expression, Call) and expression.function == '*':
        for entry in expression.arguments:
            yield from _factors(entry)
    elif isinstance(expression, Call) and expression.function == '/':
        # a · f/g is a times f/g.
        *before, last = _factors(expression.arguments[0])
        yield from before
        yield Call('/', (last, expression.arguments[1]))
    else:
        yield expression


def _legend(pattern: Expression) -> tuple[str, ...]:
    """Return what has to be said of the symbols in a short line."""
    parts = list(walk(pattern))
    said = [f'{symbol} is {words}' for name, (symbol, words) in _SYMBOLS.items()
            if Name(name) in parts]
    if any(isinstance(entry, Call) and entry.function == 'positive' for entry in parts):
        said.append(' is '.join(_POSITIVE))
    return tuple(said)


def _known_digits(entry: ParameterEstimate, most: int) -> str:
    """Return a number with the digits that its error leaves, at most so many."""
    if entry.value and entry.std and 0.0 < entry.std < abs(entry.value):
        known = math.floor(math.log10(abs(entry.value))) - math.floor(math.log10(entry.std)) + 1
        most = min(most, max(known, 1))
    text = f'{entry.value:.{most}g}'
    # 1e+02 is nobody's way to write a hundred.
    return f'{float(text):.0f}' if 'e+' in text and abs(entry.value) < 1e5 else \
        text.replace('e-0', 'e-').replace('e+0', 'e')


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


def _read(expression: Expression, names: Mapping[str, str], symbols: bool) -> str:
    """Return an expression for reading, not for parsing: · for products, |x| for abs."""
    if isinstance(expression, Number):
        return f'{expression.value:g}'
    if isinstance(expression, Name):
        return names.get(expression.name, _coordinate(expression.name, symbols))
    given = [_read(entry, names, symbols) for entry in expression.arguments]
    operator = expression.function
    if operator == '*':
        # A number stands before what it multiplies, a factor beside a factor.
        if expression.arguments[0] == Number(1.0):
            return given[1]
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
        above, below = expression.arguments
        product = isinstance(below, Call) and below.function in ('*', '/')
        return (f'{_closed(given[0], above)}/'
                f'{f"({given[1]})" if product else _closed(given[1], below)}')
    if operator == '**':
        closed = _closed(given[0], expression.arguments[0])
        return f'{closed}{_POWERS.get(given[1], "^" + given[1])}'
    if operator == 'positive' and symbols:
        return f'({given[0]})₊'
    return f'|{given[0]}|' if operator == 'abs' else f'{operator}({", ".join(given)})'


def _coordinate(name: str, symbols: bool) -> str:
    if symbols and name in _SYMBOLS:
        return _SYMBOLS[name][0]
    return _COORDINATES.get(name, name)


def _closed(text: str, expression: Expression) -> str:
    """Return the text of a factor, in brackets where it is a sum."""
    sums = isinstance(expression, Call) and expression.function in ('+', '-')
    return f'({text})' if sums else text
