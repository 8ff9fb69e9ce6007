# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Torque acts later than the recorded effort: a delay, or the current loop."""

import math

from engb_core.effects.base import Effect, EFFORT, Parameter, TIME, TIME_STEP
from engb_core.physics.compiled import effect_function, Numbers
from engb_core.physics.delay_line import delayed

# Place in the state of the first-order lag's output; the others are the delay's.
_LAGGED = 0


@effect_function
def _actuation(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    # Forward in time; inverse dynamics uses `time_shift` instead.
    effort = sample[EFFORT]
    settling = parameters[0] * parameters[1]
    delay = parameters[0] - settling
    if sample[TIME] <= 0.0:
        state[_LAGGED] = effort
    if delay > 0.5 * sample[TIME_STEP]:
        effort = delayed(state, effort, sample[TIME_STEP], delay)
    if settling > 0.0:
        state[_LAGGED] += (1.0 - math.exp(-sample[TIME_STEP] / settling)) * (
            effort - state[_LAGGED])
        effort = state[_LAGGED]
    return effort


EFFECT = Effect(
    id='actuation_lag',
    title='Actuation lag',
    parameters=(Parameter('lag', 's', 0.0, 0.2, none=0.0, starts=(0.004, 0.012, 0.035),
                          form_steps=0.25),
                Parameter('first_order', '-', 0.0, 1.0, starts=(0.0, 1.0))),
    stages={'actuation': _actuation},
    equation='T_M(t) = effort(t − delay) through 1/(τ s + 1), lag = delay + τ',
    reference='contract, table 4; delay of bus and current loop',
    statement=lambda p: (f"The torque acts {p['lag'] * 1e3:.2f} ms after the recorded effort "
                         '(delay or current loop).'),
    reveals='acceleration',
    picture='lag',
    seen='Torque turns later than the current says: residual spikes at every fast change of '
         'effort, of the sign of its rate.',
    confused='presliding friction and sampling delay',
    measure='steps of effort at several rates: a lag shifts all by the same time',
    time_shift=lambda p: (p['lag'] * (1.0 - p['first_order']), p['lag'] * p['first_order']),
)
