# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A law as the kernels run it: a stack machine whose program lies among an effect's parameters.

So one compiled function serves every formula, in inverse dynamics, simulation and on the bench,
and nothing is compiled when a model file is read. The layout of an effect's parameters:

    0 … 11    the law's own parameters
    12        the number of instructions, from 13 on instructions and their arguments in turn
    85 …      four coordinates: code, lowest and highest value seen
    97 …      speed of a clear direction, longest delay, what the law acts as

A coordinate is held at the edge of the range in which it was seen: beyond it nobody knows.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from engb_core.effects.base import (
    DIRECTION,
    POSITION,
    SAMPLE_SIZE,
    TIME,
    TIME_STEP,
    VELOCITY,
)
from engb_core.errors import InputError
from engb_core.laws.grammar import Call, COORDINATES, Expression, Name, Number, parameters_of
from engb_core.physics.compiled import compiled, Numbers, PARAMETER_SIZE

__all__ = ['ACTS_AS', 'AXES', 'LONGEST', 'MODE', 'MOST_DEPTH', 'MOST_INSTRUCTIONS',
           'MOST_PARAMETERS', 'TURN', 'bounded_exp', 'followed', 'power', 'program_of',
           'quotient', 'remembered', 'value_of']

# What a law may act as, in the order of its code.
ACTS_AS = ('torque', 'friction_gain', 'load_gain', 'effort_gain', 'inertia', 'position_shift',
           'delay', 'position_delay', 'load_shift')
MOST_PARAMETERS = 12
_COUNT, _PROGRAM, AXES, TURN, LONGEST, MODE = 12, 13, 85, 97, 98, 99
MOST_INSTRUCTIONS = (AXES - _PROGRAM) // 2
_MOST_AXES = (TURN - AXES) // 3
_STACK = 56          # where the stack begins in an effect's state; memory lies below
MOST_DEPTH = 16
_DELAY_RING = 48     # a delay's past efforts take what memory there is

# Coordinates that are followed, and the direction of stages that come before friction's own.
_MOTOR_ANGLE, _SINCE, _REST, _DISTANCE, _TURNED, _SINCE_TIME = 100, 101, 102, 103, 104, 105
_FOLLOWED = {'motor_angle': _MOTOR_ANGLE, 'since_reversal': _SINCE, 'time_at_rest': _REST,
             'distance': _DISTANCE, 'time_since_reversal': _SINCE_TIME}
(_NUMBER, _PARAMETER, _AXIS, _ADD, _SUBTRACT, _MULTIPLY, _DIVIDE, _POWER, _NEGATIVE, _ABS, _SIGN,
 _SQRT, _EXP, _SIN, _COS, _TANH, _POSITIVE, _MAX, _MIN, _STEP, _BELL, _PEAK, _LAG, _HEAT,
 _TRAVEL_LAG, _STOP, _DRAG, _RESTED, _HIGHEST, _RATE) = range(30)
_CODES = {'+': _ADD, '-': _SUBTRACT, '*': _MULTIPLY, '/': _DIVIDE, '**': _POWER, 'neg': _NEGATIVE,
          'abs': _ABS, 'sign': _SIGN, 'sqrt': _SQRT, 'exp': _EXP, 'sin': _SIN, 'cos': _COS,
          'tanh': _TANH, 'positive': _POSITIVE, 'max': _MAX, 'min': _MIN, 'step': _STEP,
          'bell': _BELL, 'peak': _PEAK, 'lag': _LAG, 'heat': _HEAT, 'travel_lag': _TRAVEL_LAG,
          'stop': _STOP, 'drag': _DRAG, 'rested': _RESTED, 'highest': _HIGHEST, 'rate': _RATE}
_REMEMBERS = {_LAG: 1, _HEAT: 1, _TRAVEL_LAG: 1, _STOP: 2, _DRAG: 2, _RESTED: 1,
              _HIGHEST: 1, _RATE: 1}
_TINY = 1e-12


def program_of(expression: Expression, acts_as: str,
               within: dict[str, tuple[float, float]]) -> NDArray[np.float64]:
    """Return an effect's parameters (PARAMETER_SIZE,) for a law, its own still zero.

    Args:
        expression: the formula; its parameters come in order of appearance.
        acts_as: one of `ACTS_AS`.
        within: range of each coordinate in which the law was seen.

    Raises:
        InputError: an unknown place to act, a formula too long, a range that is none.
    """
    if acts_as not in ACTS_AS:
        raise InputError(f'law: acts_as is {acts_as!r}; it must be one of {", ".join(ACTS_AS)}')
    names = parameters_of(expression)
    if len(names) > MOST_PARAMETERS:
        raise InputError(f'law: {len(names)} parameters; at most {MOST_PARAMETERS} can be had')
    for name, (low, high) in within.items():
        if name not in COORDINATES:
            raise InputError(f'law: within.{name} is no coordinate; there are '
                             f'{", ".join(COORDINATES)}')
        if not low < high:
            raise InputError(f'law: within.{name} is [{low}, {high}]; the first must be less')
    made = _Program(names, acts_as, within)
    made.add(expression)
    return made.finished()


class _Program:
    def __init__(self, names: tuple[str, ...], acts_as: str,
                 within: dict[str, tuple[float, float]]) -> None:
        self._names, self._acts_as, self._within = names, acts_as, within
        self._code: list[tuple[float, float]] = []
        self._axes: dict[str, int] = {}
        self._slots = 10         # the first ten follow reversals, rest and distance
        self._depth = self._deepest = 0

    def add(self, expression: Expression) -> None:
        if isinstance(expression, Number):
            self._put(_NUMBER, expression.value, 1)
        elif isinstance(expression, Name) and expression.name in COORDINATES:
            self._put(_AXIS, self._axis(expression.name), 1)
        elif isinstance(expression, Name):
            self._put(_PARAMETER, self._names.index(expression.name), 1)
        else:
            self._call(expression)

    def _call(self, expression: Call) -> None:
        for entry in expression.arguments:
            self.add(entry)
        code, slot = _CODES[expression.function], 0
        if code in _REMEMBERS:
            slot, self._slots = self._slots, self._slots + _REMEMBERS[code]
        self._put(code, slot, 1 - len(expression.arguments))

    def _put(self, code: int, argument: float, change: int) -> None:
        self._code.append((code, argument))
        self._depth += change
        self._deepest = max(self._deepest, self._depth)

    def _axis(self, name: str) -> int:
        if name not in self._axes:
            self._axes[name] = len(self._axes)
        return self._axes[name]

    def finished(self) -> NDArray[np.float64]:
        if (len(self._code) > MOST_INSTRUCTIONS or len(self._axes) > _MOST_AXES
                or self._slots > _DELAY_RING or self._deepest > MOST_DEPTH):
            raise InputError(f'law: the formula is too long; at most {MOST_INSTRUCTIONS} '
                             f'operations and {_MOST_AXES} coordinates can be had')
        made = np.zeros(PARAMETER_SIZE)
        made[_COUNT] = len(self._code)
        made[_PROGRAM:_PROGRAM + 2 * len(self._code)] = np.ravel(self._code)
        for name, place in self._axes.items():
            code = _FOLLOWED.get(name, COORDINATES[name].place)
            if name == 'direction' and self._acts_as not in ('torque', 'friction_gain'):
                code = _TURNED
            low, high = self._within.get(name, (-1e30, 1e30))
            made[AXES + 3 * place:AXES + 3 * place + 3] = code, low, high
        # Where there is no friction's direction yet, that of a speed which is clearly one.
        speeds = self._within.get('velocity', (-1.0, 1.0))
        made[TURN] = 5e-3 * max(abs(speeds[0]), abs(speeds[1]), 1e-9)
        made[MODE] = ACTS_AS.index(self._acts_as)
        return made


@compiled
def _step_since(state: Numbers, slot: int, sample: Numbers) -> float:
    """Return the time that a sample adds [s]: a formula may look at it more than once."""
    if sample[TIME] <= state[slot]:
        return 0.0
    state[slot] = sample[TIME]
    return sample[TIME_STEP]


@compiled
def followed(code: float, state: Numbers, sample: Numbers, turn: float) -> float:
    """Return a coordinate that is followed from sample to sample."""
    if code == 104.0:
        return min(1.0, max(-1.0, sample[VELOCITY] / turn))
    if code == 100.0:
        return sample[POSITION] - 2.0 * math.pi * math.floor(sample[POSITION] / (2.0 * math.pi))
    speed = abs(sample[VELOCITY])
    if sample[TIME] <= 0.0:
        state[0] = 0.0
        state[1] = sample[POSITION]
        for place in range(2, 10):
            state[place] = 0.0
    if code == 101.0:
        # state[0] is the direction of the last motion, state[1] where it began.
        if speed > turn and sample[VELOCITY] * state[0] <= 0.0:
            state[0] = 1.0 if sample[VELOCITY] > 0.0 else -1.0
            state[1] = sample[POSITION]
        return abs(sample[POSITION] - state[1])
    if code == 102.0:
        # It is told while the shaft moves again: how long it stood before.
        if speed < turn:
            if state[6] > 0.5:
                state[2] = 0.0
                state[6] = 0.0
            state[2] += _step_since(state, 7, sample)
        else:
            state[6] = 1.0
        return state[2]
    if code == 105.0:
        # state[4] is the direction of the last motion, state[5] how long ago it turned.
        if speed > turn and sample[VELOCITY] * state[4] <= 0.0:
            state[4] = 1.0 if sample[VELOCITY] > 0.0 else -1.0
            state[5] = 0.0
        state[5] += _step_since(state, 8, sample)
        return state[5]
    state[3] += speed * _step_since(state, 9, sample)
    return state[3]


@compiled
def bounded_exp(value: float) -> float:
    """Return the exponential of a value within ±60."""
    return math.exp(min(max(value, -60.0), 60.0))


@compiled
def quotient(left: float, right: float) -> float:
    """Return left / right, of a divisor that is kept away from nothing."""
    safe = right if abs(right) > _TINY else (_TINY if right >= 0.0 else -_TINY)
    return left / safe


@compiled
def power(left: float, right: float) -> float:
    """Return |left|**right, negative where `left` is and `right` is no even number."""
    size = bounded_exp(right * math.log(max(abs(left), _TINY)))
    odd = left < 0.0 and right - 2.0 * math.floor(0.5 * right) != 0.0
    return -size if odd else size


@compiled
def remembered(code: int, first: float, second: float, state: Numbers, slot: int, sample: Numbers,
                turn: float) -> float:
    """Return a function with memory; its state lies at `slot`."""
    begins = sample[TIME] <= 0.0
    second = max(abs(second), 1e-9)
    if code == 22 or code == 23:        # lag, heat
        if begins:
            state[slot] = first if code == 22 else 0.0
        state[slot] += (1.0 - math.exp(-sample[TIME_STEP] / second)) * (first - state[slot])
        return state[slot]
    if code == 24:                      # travel_lag
        if begins:
            state[slot] = first
        way = abs(sample[VELOCITY]) * sample[TIME_STEP]
        state[slot] += (1.0 - math.exp(-min(way / second, 60.0))) * (first - state[slot])
        return state[slot]
    if code == 25 or code == 26:        # stop, drag
        if begins:
            state[slot] = 0.0
            state[slot + 1] = first
        change = (first - state[slot + 1]) / second
        state[slot + 1] = first
        if code == 25:
            state[slot] = min(1.0, max(-1.0, state[slot] + change))
        elif change > 0.0:
            state[slot] = 1.0 - (1.0 - state[slot]) * math.exp(-min(change, 60.0))
        else:
            state[slot] = (1.0 + state[slot]) * math.exp(-min(-change, 60.0)) - 1.0
        return state[slot]
    if code == 28:                      # highest
        faded = state[slot] * math.exp(-sample[TIME_STEP] / second)
        state[slot] = first if begins else max(first, faded)
        return state[slot]
    # rested: as a logarithm of the time at rest; slip renews the contact.
    if begins:
        state[slot] = 0.0
    speed = abs(sample[VELOCITY])
    if speed < turn:
        state[slot] = math.log(math.exp(state[slot])
                               + sample[TIME_STEP] / max(abs(first), 1e-9))
    else:
        state[slot] *= math.exp(-min(speed * sample[TIME_STEP] / second, 60.0))
    return state[slot]


@compiled
def value_of(parameters: Numbers, state: Numbers, sample: Numbers, position: float) -> float:
    """Return the law's value for a sample, as if the shaft stood at `position`."""
    top = 55
    for row in range(int(parameters[12])):
        code = int(parameters[13 + 2 * row])
        argument = parameters[14 + 2 * row]
        if code == 0:
            top += 1
            state[top] = argument
        elif code == 1:
            top += 1
            state[top] = parameters[int(argument)]
        elif code == 2:
            axis = 85 + 3 * int(argument)
            which = parameters[axis]
            if which == POSITION:
                value = position
            elif which >= SAMPLE_SIZE:
                value = followed(which, state, sample, parameters[97])
            else:
                value = sample[int(which)]
            top += 1
            state[top] = min(max(value, parameters[axis + 1]), parameters[axis + 2])
        elif code <= 7 or (17 <= code <= 20):
            right = state[top]
            top -= 1
            left = state[top]
            if code == 3:
                state[top] = left + right
            elif code == 4:
                state[top] = left - right
            elif code == 5:
                state[top] = left * right
            elif code == 6:
                state[top] = quotient(left, right)
            elif code == 7:
                state[top] = power(left, right)
            elif code == 17:
                state[top] = max(left, right)
            elif code == 18:
                state[top] = min(left, right)
            elif code == 19:
                state[top] = 1.0 / (1.0 + bounded_exp(-left / max(abs(right), 1e-9)))
            else:
                state[top] = bounded_exp(-0.5 * (left / max(abs(right), 1e-9)) ** 2)
        elif code == 29:
            slot = int(argument)
            value = state[top]
            begun = sample[TIME] > 0.0 and sample[TIME_STEP] > 0.0
            state[top] = (value - state[slot]) / sample[TIME_STEP] if begun else 0.0
            state[slot] = value
        elif code >= 22:
            right = state[top]
            top -= 1
            state[top] = remembered(code, state[top], right, state, int(argument), sample,
                                     parameters[97])
        else:
            value = state[top]
            if code == 8:
                value = -value
            elif code == 9:
                value = abs(value)
            elif code == 10:
                value = 1.0 if value > 0.0 else (-1.0 if value < 0.0 else 0.0)
            elif code == 11:
                value = math.sqrt(value) if value >= 0.0 else -math.sqrt(-value)
            elif code == 12:
                value = bounded_exp(value)
            elif code == 13:
                value = math.sin(value)
            elif code == 14:
                value = math.cos(value)
            elif code == 15:
                value = math.tanh(value)
            elif code == 16:
                value = max(value, 0.0)
            elif code == 21:
                value = 2.0 * value / (1.0 + value * value)
            state[top] = value
    return state[top]


assert _HIGHEST == 28 and _RATE == 29 and _STACK == 56 and DIRECTION < SAMPLE_SIZE
