# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A law over a whole motion: the stack machine's instructions one after another, each over many
samples.

It gives what machine.py gives sample by sample. What an instruction is has to be found out once
for a stretch of samples instead of once for each of them, which takes longer than most arithmetic.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from engb_core.effects.base import SAMPLE_SIZE, STATE_SIZE, TIME, TIME_STEP
from engb_core.laws.machine import (
    bounded_exp,
    followed,
    MOST_DEPTH,
    MOST_INSTRUCTIONS,
    power,
    quotient,
    remembered,
)
from engb_core.physics.compiled import kernel, row_of

__all__ = ['values_of']

Array = NDArray[np.float64]

# Samples of a stretch: so many values at every depth of the stack stay in a processor's cache.
_STRETCH = 256


def values_of(parameters: Array, state: Array, samples: Array) -> Array:
    """Return the law's values (n,).

    Args:
        parameters: (PARAMETER_SIZE,) the law's parameters and its program.
        state: (STATE_SIZE,) its memory, fresh; used up afterwards.
        samples: (n, SAMPLE_SIZE) of the whole motion.
    """
    values = np.empty(samples.shape[0])
    _values(parameters, state, samples, np.zeros((MOST_INSTRUCTIONS, STATE_SIZE)),
            np.empty((MOST_DEPTH + 1, _STRETCH)), values)
    return values


@kernel
def _values(parameters: Array, state: Array, samples: Array, own: Array, stack: Array,
            values: Array) -> None:
    """Write the law's values (n,); `own` (MOST_INSTRUCTIONS, STATE_SIZE) is the memory of each
    followed coordinate, `stack` (depth, stretch) what is computed with."""
    turn = parameters[97]
    for begin in range(0, samples.shape[0], stack.shape[1]):
        count = min(stack.shape[1], samples.shape[0] - begin)
        top = -1
        for row in range(int(parameters[12])):
            code = int(parameters[13 + 2 * row])
            argument = parameters[14 + 2 * row]
            if code == 0 or code == 1:
                top += 1
                value = argument if code == 0 else parameters[int(argument)]
                for place in range(count):
                    stack[top, place] = value
            elif code == 2:
                top += 1
                axis = 85 + 3 * int(argument)
                which, low, high = parameters[axis], parameters[axis + 1], parameters[axis + 2]
                if which >= SAMPLE_SIZE:
                    # No place in a sample: it is followed, one that stands twice in a formula
                    # twice.
                    memory = row_of(own, row)
                    for place in range(count):
                        value = followed(which, memory, row_of(samples, begin + place), turn)
                        stack[top, place] = min(max(value, low), high)
                else:
                    column = int(which)
                    for place in range(count):
                        stack[top, place] = min(max(samples[begin + place, column], low), high)
            elif code <= 7 or (17 <= code <= 20):
                top -= 1
                if code == 3:
                    for place in range(count):
                        stack[top, place] += stack[top + 1, place]
                elif code == 4:
                    for place in range(count):
                        stack[top, place] -= stack[top + 1, place]
                elif code == 5:
                    for place in range(count):
                        stack[top, place] *= stack[top + 1, place]
                elif code == 6:
                    for place in range(count):
                        stack[top, place] = quotient(stack[top, place], stack[top + 1, place])
                elif code == 7:
                    for place in range(count):
                        stack[top, place] = power(stack[top, place], stack[top + 1, place])
                elif code == 17:
                    for place in range(count):
                        stack[top, place] = max(stack[top, place], stack[top + 1, place])
                elif code == 18:
                    for place in range(count):
                        stack[top, place] = min(stack[top, place], stack[top + 1, place])
                elif code == 19:
                    for place in range(count):
                        width = max(abs(stack[top + 1, place]), 1e-9)
                        stack[top, place] = 1.0 / (1.0 + bounded_exp(-stack[top, place] / width))
                else:
                    for place in range(count):
                        width = max(abs(stack[top + 1, place]), 1e-9)
                        stack[top, place] = bounded_exp(-0.5 * (stack[top, place] / width) ** 2)
            elif code == 29:
                slot = int(argument)
                for place in range(count):
                    value = stack[top, place]
                    step = samples[begin + place, TIME_STEP]
                    begun = samples[begin + place, TIME] > 0.0 and step > 0.0
                    stack[top, place] = (value - state[slot]) / step if begun else 0.0
                    state[slot] = value
            elif code == 22 or code == 23:
                top -= 1
                slot = int(argument)
                before, width, share = -1.0, 0.0, 0.0
                for place in range(count):
                    value, step = stack[top, place], samples[begin + place, TIME_STEP]
                    second = max(abs(stack[top + 1, place]), 1e-9)
                    if samples[begin + place, TIME] <= 0.0:
                        state[slot] = value if code == 22 else 0.0
                    if step != before or second != width:
                        # Samples are mostly as far apart, and the time a number.
                        before, width = step, second
                        share = 1.0 - math.exp(-step / second)
                    state[slot] += share * (value - state[slot])
                    stack[top, place] = state[slot]
            elif code >= 24:
                top -= 1
                slot = int(argument)
                for place in range(count):
                    stack[top, place] = remembered(
                        code, stack[top, place], stack[top + 1, place], state, slot,
                        row_of(samples, begin + place), turn)
            elif code == 8:
                for place in range(count):
                    stack[top, place] = -stack[top, place]
            elif code == 9:
                for place in range(count):
                    stack[top, place] = abs(stack[top, place])
            elif code == 10:
                for place in range(count):
                    value = stack[top, place]
                    stack[top, place] = 1.0 if value > 0.0 else (-1.0 if value < 0.0 else 0.0)
            elif code == 11:
                for place in range(count):
                    value = stack[top, place]
                    stack[top, place] = math.sqrt(value) if value >= 0.0 else -math.sqrt(-value)
            elif code == 12:
                for place in range(count):
                    stack[top, place] = bounded_exp(stack[top, place])
            elif code == 13:
                for place in range(count):
                    stack[top, place] = math.sin(stack[top, place])
            elif code == 14:
                for place in range(count):
                    stack[top, place] = math.cos(stack[top, place])
            elif code == 15:
                for place in range(count):
                    stack[top, place] = math.tanh(stack[top, place])
            elif code == 16:
                for place in range(count):
                    stack[top, place] = max(stack[top, place], 0.0)
            elif code == 21:
                for place in range(count):
                    value = stack[top, place]
                    stack[top, place] = 2.0 * value / (1.0 + value * value)
        for place in range(count):
            values[begin + place] = stack[0, place]
