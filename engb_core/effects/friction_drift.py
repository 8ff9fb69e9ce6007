# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Friction changes over the recording, for instance by warm-up."""

import math

from engb_core.effects.base import Effect, LEVEL, Parameter, TIME
from engb_core.physics.compiled import effect_function, Numbers

# Part of the recording within which friction that changes sooner has changed at once.
_AT_ONCE = 0.01


@effect_function
def _level(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    settling, shape = parameters[1], parameters[2]
    part = sample[TIME] / parameters[3]
    if state[0] == 0.0:
        # The progress at the end of the recording, the same in every sample.
        state[0] = 1.0 - math.exp(-settling ** -shape)
    progress = (1.0 - math.exp(-(part / settling) ** shape)) / state[0]
    return sample[LEVEL] * (1.0 + (parameters[0] - 1.0) * progress)


EFFECT = Effect(
    id='friction_drift',
    title='Friction drift',
    parameters=(
        Parameter('friction_ratio', '-', 0.05, 10.0, none=1.0, starts=(1.1,)),
        Parameter('settling', '-', 0.1, 20.0, starts=(0.4, 5.0), logarithmic=True),
        Parameter('shape', '-', 0.4, 5.0, starts=(1.0, 2.5), logarithmic=True, kind='exponent'),
    ),
    stages={'level': _level},
    of_motion=True,
    equation='F(t) = F (1 + (ratio − 1) p(t)/p(T)), p = 1 − e^(−(t/τ)^shape)',
    reference='Simoni et al., IFAC WC (2015): friction and temperature in drives',
    statement=lambda p: (
        f"Friction is {p['friction_ratio']:.2f} times what it was at the start."
        if p['settling'] < _AT_ONCE else
        f"Friction {'grows' if p['friction_ratio'] > 1 else 'falls'} during the recording "
        f"to {p['friction_ratio']:.2f} times its value at the start (warm-up)"
        + (f", most of it within {p['settling'] * p['duration']:.2g} s."
           if p['settling'] < 1.0 else '.')),
    reveals='time',
    picture='friction_over_time',
    seen='The same strokes take less, or more, effort as time goes on.',
    confused='a torque constant that drifts with heat, which moves the load as well',
    measure='equal strokes at the start and at the end',
    constants=(('duration', 's'),),
    defaults={'duration': 60.0},
    set_constants=lambda scene: {'duration': scene.duration},
    at_once={'settling': 1e-3, 'shape': 1.0},
    contains=('coulomb_friction_error',),
)
