# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The recorded effort comes later than the torque: a filter between current and log."""

import math

from engb_core.effects.base import Effect, EFFORT, Parameter, TIME, TIME_STEP
from engb_core.physics.compiled import effect_function, Numbers

# Place in the state: what the filter gave last.
_FILTERED = 0


@effect_function
def _measurement(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    if sample[TIME] <= 0.0 or parameters[0] <= 0.0:
        state[_FILTERED] = sample[EFFORT]
    else:
        share = 1.0 - math.exp(-sample[TIME_STEP] / parameters[0])
        state[_FILTERED] += share * (sample[EFFORT] - state[_FILTERED])
    return state[_FILTERED]


EFFECT = Effect(
    id='effort_measurement_lag',
    title='Effort measured late',
    # Refitted numbers stand far off beside a long lag: no fit leads there from a short one.
    parameters=(Parameter('lag', 's', 1e-4, 1.0, none=0.0, starts=(0.005, 0.015, 0.04, 0.12),
                          logarithmic=True, form_steps=0.25),),
    stages={'measurement': _measurement},
    equation='effort = T_M through 1/(lag · s + 1)',
    reference='contract, additions; filtered current estimates of motor drives',
    statement=lambda p: (f"The recorded effort comes {p['lag'] * 1e3:.1f} ms after the torque "
                         '(filtered current).'),
    reveals='acceleration',
    picture='lag',
    seen='The effort trails the acceleration: at every fast change of torque it arrives late and '
         'rounded off, in both directions of motion.',
    confused='an inertia that is too small, load hysteresis',
    measure='a step of torque against a stop: the recorded effort rises with the time constant of '
            'its filter',
    applies=lambda scene: not scene.commanded,
    # Of two lags between the same two signals a recording tells the difference alone.
    apart=('actuation_lag',),
)
