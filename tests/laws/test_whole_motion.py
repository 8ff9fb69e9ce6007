# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A law over a whole motion is the same law sample by sample."""

from __future__ import annotations

import numpy as np
import pytest

from engb_core.effects.base import (
    ACCELERATION,
    DIRECTION,
    LOAD,
    POSITION,
    SAMPLE_SIZE,
    STATE_SIZE,
    TIME,
    TIME_STEP,
    VELOCITY,
)
from engb_core.effects.law import law_value
from engb_core.laws.grammar import COORDINATES, FUNCTIONS, parameters_of, parse
from engb_core.laws.machine import program_of
from engb_core.laws.whole_motion import values_of

# Every function of the grammar, every coordinate, every operator; memory twice in one formula.
FORMULAS = [
    *(f'a * {name}(b * position - 3, 0.7)' if entry.arguments == 2 else
      f'a * {name}(b * (position - 3))' for name, entry in FUNCTIONS.items()),
    *(f'a * {name} + b' for name in COORDINATES),
    'a * -(position - 2)**2 / (velocity - b) + load**0.5',
    'a * (position - 8)**3 - 2**(b * direction)',
    'a * since_reversal * exp(-since_reversal / b)',
    'a * lag(velocity, b) * lag(velocity, b)',
    'a * time_at_rest + b * rested(0.1, 0.3) * time_at_rest',
]


def motion() -> np.ndarray:
    time = np.arange(1300) * 1e-3
    samples = np.zeros((time.size, SAMPLE_SIZE))
    samples[:, TIME], samples[:, TIME_STEP] = time, 1e-3
    samples[:, POSITION] = 8.0 * (1.0 - np.cos(np.minimum(time, 0.9) * 5.0))
    samples[:, VELOCITY] = np.gradient(samples[:, POSITION], 1e-3)
    samples[:, ACCELERATION] = np.gradient(samples[:, VELOCITY], 1e-3)
    samples[:, LOAD] = 0.01 * samples[:, POSITION] ** 2
    samples[:, DIRECTION] = np.tanh(samples[:, VELOCITY])
    return samples


@pytest.mark.parametrize('formula', FORMULAS)
def test_every_function_and_coordinate_is_the_same(formula):
    """Whether the stretches divide the motion or not."""
    expression = parse(formula)
    parameters = program_of(expression, 'torque', {'position': (0.5, 14.0)})
    parameters[:len(parameters_of(expression))] = (1.3, 0.4)[:len(parameters_of(expression))]
    for count in (1, 512, 1300):
        samples = motion()[:count]
        np.testing.assert_array_equal(
            values_of(parameters, np.zeros(STATE_SIZE), samples),
            law_value.sample_by_sample(parameters, np.zeros(STATE_SIZE), samples))
