"""After a reversal friction builds up over a distance (bristle, Dahl)."""

import math

from engb_core.compiled import effect_function
from engb_core.effects.base import Effect, Parameter, TIME_STEP, VELOCITY


@effect_function
def _direction(parameters, state, sample):
    # Exact for constant speed over the step, so that long steps (inverse dynamics) and
    # short ones (simulation) agree.
    travel = sample[VELOCITY] * sample[TIME_STEP] / parameters[0]
    target = 1.0 if travel > 0.0 else -1.0
    state[0] = target + (state[0] - target) * math.exp(-abs(travel))
    return state[0]


EFFECT = Effect(
    id='presliding_friction',
    title='Presliding friction',
    parameters=(Parameter('presliding_distance', 'rad', 1e-4, 20.0, none=0.0,
                          starts=(0.02, 0.06, 0.15, 0.4, 1.0), logarithmic=True),),
    stages={'direction': _direction},
    equation='dz/dθ = (1 − z sgn ω)/distance, T_C = F z',
    reference='Dahl, AIAA J. 14 (1976) 1675; Canudas de Wit et al., IEEE TAC 40 (1995) 419',
    statement=lambda p: (
        'After each reversal friction builds up over '
        f"{p['presliding_distance']:.3g} rad (to 63 %) instead of at once."),
    reveals='since_reversal',
)
