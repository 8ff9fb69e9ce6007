"""Torque acts later than the recorded effort: a delay, or the current loop."""

import math

from engb_core.compiled import effect_function
from engb_core.effects.base import Effect, EFFORT, Parameter, TIME, TIME_STEP


@effect_function
def _actuation(parameters, state, sample):
    # Forward in time a first-order lag; inverse dynamics uses `lead` instead.
    if sample[TIME] <= 0.0 or parameters[0] <= 0.0:
        state[0] = sample[EFFORT]
    else:
        state[0] += (1.0 - math.exp(-sample[TIME_STEP] / parameters[0])) * (
            sample[EFFORT] - state[0])
    return state[0]


EFFECT = Effect(
    id='actuation_lag',
    title='Actuation lag',
    parameters=(Parameter('lag', 's', 0.0, 0.2, none=0.0, starts=(0.004,)),
                Parameter('first_order', '-', 0.0, 1.0, starts=(0.0, 1.0))),
    stages={'actuation': _actuation},
    equation='T_M(t) = effort(t − delay) through 1/(τ s + 1), lag = delay + τ',
    reference='contract, table 4; delay of bus and current loop',
    statement=lambda p: (f"The torque acts {p['lag'] * 1e3:.2f} ms after the recorded effort "
                         '(delay or current loop).'),
    reveals='acceleration',
    lead=lambda p: (p['lag'] * (1.0 - p['first_order']), p['lag'] * p['first_order']),
)
