# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Torque that is off by a step where the effort changes its sign; no cause is claimed."""

import math

from engb_core.effects.base import Effect, EFFORT, Parameter
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _actuation(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    largest = parameters[2]
    step = parameters[0] * math.tanh(sample[EFFORT] / (parameters[1] * largest))
    return sample[EFFORT] + largest * step


EFFECT = Effect(
    id='unexplained_crossover',
    title='Unexplained step of torque where effort changes its sign',
    parameters=(
        Parameter('step', '-', -0.5, 0.5, none=0.0, starts=(0.05,)),
        Parameter('width', '-', 0.001, 0.3, starts=(0.01, 0.05), logarithmic=True),
    ),
    stages={'actuation': _actuation},
    equation='T_M = effort + step · e_max · tanh(effort / (width · e_max))',
    reference='none: what is left; such are the dead time of a bridge, and a current sensor that '
              'reads nothing around zero',
    statement=lambda p: (
        f"Torque is {p['step'] * 100:+.1f} % of the largest effort beside what is measured, with "
        'the sign of the effort: around none the two do not go together; no effect of the '
        'library does that.'),
    reveals='effort',
    constants=(('largest_effort', 'N·m'),),
    defaults={'largest_effort': 0.5},
    set_constants=lambda scene: {'largest_effort': scene.largest_effort},
    unnamed=True,
)
