"""Friction after a rest that grows with the rest's length; no cause is claimed."""

import math

from engb_core.compiled import effect_function
from engb_core.effects.base import Effect, LEVEL, Parameter, TIME, TIME_STEP, VELOCITY


@effect_function
def _level(parameters, state, sample):
    # state: 0 time at rest, 1 what is left of the last rest's growth
    if sample[TIME] <= 0.0:
        state[0] = 0.0
        state[1] = 0.0
    speed = abs(sample[VELOCITY])
    if speed < parameters[3]:
        state[0] += sample[TIME_STEP]
    else:
        if state[0] > 0.0:
            state[1] += math.log(1.0 + state[0] / parameters[1])
            state[0] = 0.0
        state[1] *= math.exp(-speed * sample[TIME_STEP] / parameters[2])
    return sample[LEVEL] * (1.0 + parameters[0] * state[1])


EFFECT = Effect(
    id='unexplained_rest',
    title='Unexplained friction after rest',
    parameters=(
        Parameter('growth', '-', -1.0, 20.0, none=0.0, starts=(0.1,)),
        Parameter('rest_time', 's', 1e-3, 100.0, starts=(0.05, 0.6), logarithmic=True),
        Parameter('distance', 'rad', 1e-3, 100.0, starts=(0.1, 0.6, 2.5), logarithmic=True),
    ),
    stages={'level': _level},
    equation='F (1 + growth · ln(1 + rest/τ) · e^(−travel/distance))',
    reference='none: what is left',
    statement=lambda p: ('Friction after standing still is higher the longer it stood, and '
                         f"falls back within {p['distance']:.2g} rad; no effect of the "
                         'library does that.'),
    reveals='since_reversal',
    constants=(('still', 'rad/s'),),
    set_constants=lambda scene: {'still': 0.004 * scene.speed},
    unnamed=True,
)
