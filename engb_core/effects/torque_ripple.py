# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Torque per ampere that is periodic in the shaft angle."""

from engb_core.effects.base import Effect, EFFORT, Parameter, POSITION
from engb_core.physics.compiled import effect_function, Numbers
from engb_core.physics.harmonics import toothed_wave


@effect_function
def _actuation(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    return sample[EFFORT] * (1.0 + toothed_wave(parameters, sample[POSITION]))


EFFECT = Effect(
    id='torque_ripple',
    title='Torque ripple',
    parameters=(
        Parameter('relative_amplitude', '-', 0.0, 0.9, none=0.0, starts=(0.02,)),
        Parameter('order', '1/rev', 0.05, 2000.0, logarithmic=True, kind='order'),
        Parameter('phase', 'rad', -20.0, 20.0, starts=(0.0,), kind='phase'),
        Parameter('second_sine', '-', -2.0, 2.0, starts=(0.0,)),
        Parameter('second_cosine', '-', -2.0, 2.0, starts=(0.0,)),
        Parameter('third_sine', '-', -1.0, 1.0, starts=(0.0,), default=0.0),
        Parameter('third_cosine', '-', -1.0, 1.0, starts=(0.0,), default=0.0),
    ),
    stages={'actuation': _actuation},
    of_motion=True,
    proportional=lambda p: True,
    equation='T_M = effort · (1 + a · sin(order · θ + phase))',
    reference='Mattavelli et al., IEEE Trans. Ind. Appl. 41 (2005) 1634',
    statement=lambda p: (
        f"The torque per ampere varies by ±{p['relative_amplitude'] * 100:.2g} %; that repeats "
        f"{p['order']:.4g} times per motor revolution (torque ripple)."),
    reveals='motor_angle',
    picture='one_turn orders',
    seen='As cogging, and proportional to the motor torque.',
    confused='cogging',
    measure='slow constant speed at two loads',
)
