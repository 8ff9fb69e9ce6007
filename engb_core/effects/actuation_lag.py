"""Torque acts later than the recorded effort: a delay, or the current loop."""

import math

from engb_core.compiled import compiled, effect_function
from engb_core.effects.base import Effect, EFFORT, Parameter, STATE_SIZE, TIME, TIME_STEP

# Places in the state: the first-order lag's output, the past efforts' places filled so far, time
# and effort·time gathered for the next; from _PAST on the past efforts, in a ring.
_LAGGED, _FILLED, _TIME, _EFFORT, _PAST = range(5)
_RING = STATE_SIZE - _PAST


@compiled
def _delayed(state, effort, step, delay):
    """Return the effort of `delay` [s] ago, from means over stretches of a sixtieth of it."""
    stretch = step * max(1.0, math.ceil(delay / (_RING - 6) / step - 1e-9))
    if state[_FILLED] == 0.0:
        state[_PAST:] = effort
        state[_FILLED] = 1.0
    state[_TIME] += step
    state[_EFFORT] += effort * step
    if state[_TIME] > stretch - 0.5 * step:
        state[_PAST + int(state[_FILLED]) % _RING] = state[_EFFORT] / state[_TIME]
        state[_FILLED] += 1.0
        state[_TIME] = 0.0
        state[_EFFORT] = 0.0
    # Now is half a step ago: effort is held over a step. A mean stands for its stretch's middle.
    back = max((delay + 0.5 * step - state[_TIME]) / stretch - 0.5, 0.0)
    whole = int(back)
    latest = int(state[_FILLED]) - 1
    newer = state[_PAST + (latest - whole) % _RING]
    older = state[_PAST + (latest - whole - 1) % _RING]
    return newer + (back - whole) * (older - newer)


@effect_function
def _actuation(parameters, state, sample):
    # Forward in time; inverse dynamics uses `lead` instead.
    effort = sample[EFFORT]
    settling = parameters[0] * parameters[1]
    delay = parameters[0] - settling
    if sample[TIME] <= 0.0:
        state[_LAGGED] = effort
    if delay > 0.5 * sample[TIME_STEP]:
        effort = _delayed(state, effort, sample[TIME_STEP], delay)
    if settling > 0.0:
        state[_LAGGED] += (1.0 - math.exp(-sample[TIME_STEP] / settling)) * (
            effort - state[_LAGGED])
        effort = state[_LAGGED]
    return effort


EFFECT = Effect(
    id='actuation_lag',
    title='Actuation lag',
    parameters=(Parameter('lag', 's', 0.0, 0.2, none=0.0, starts=(0.004, 0.012, 0.035), form=0.02,
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
    lead=lambda p: (p['lag'] * (1.0 - p['first_order']), p['lag'] * p['first_order']),
)
