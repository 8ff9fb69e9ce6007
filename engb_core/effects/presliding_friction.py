# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""After a reversal friction builds up over a distance (bristles, Dahl's family)."""

import math

from engb_core.effects.base import DIRECTION, Effect, Parameter, TIME, TIME_STEP, VELOCITY
from engb_core.physics.compiled import effect_function, Numbers
from engb_core.physics.stop_elements import moved_elements, start_elements

# 1 − z runs from 2 (just reversed) to 0; after 63 % of the way it is 2/e.
_FULL = 2.0
_REST = 2.0 * math.exp(-1.0)


@effect_function
def _direction(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    if parameters[0] <= 0.0:
        return sample[DIRECTION]
    if sample[TIME] <= 0.0:
        # What is in motion already has slid before.
        start_elements(state, 1, sample[DIRECTION])
        state[0] = sample[DIRECTION]
    if parameters[2] > 0.5:
        return moved_elements(state, 1, sample[VELOCITY] * sample[TIME_STEP], parameters[0],
                              parameters[1])
    # Exact for constant speed over the step, so that long steps (inverse dynamics) and
    # short ones (simulation) agree.
    travel = sample[VELOCITY] * sample[TIME_STEP] / parameters[0]
    sense = 1.0 if travel > 0.0 else -1.0
    missing = 1.0 - sense * state[0]
    power = 1.0 - parameters[1]
    if abs(power) < 0.02:
        missing *= math.exp(-abs(travel))
    elif missing > 0.0:
        whole = _FULL ** power - _REST ** power
        left = missing ** power - abs(travel) * whole
        # Above 1 the exponent lets the rest die out slowly, below 1 it is gone at once.
        missing = left ** (1.0 / power) if left > 0.0 else 0.0
    state[0] = sense * (1.0 - missing)
    return state[0]


EFFECT = Effect(
    id='presliding_friction',
    title='Presliding friction',
    parameters=(
        Parameter('presliding_distance', 'rad', 1e-4, 20.0, none=0.0,
                  starts=(0.02, 0.06, 0.15, 0.4, 1.0), logarithmic=True),
        Parameter('shape', '-', 0.1, 3.0, starts=(0.95,), kind='exponent'),
    ),
    stages={'direction': _direction},
    of_motion=True,
    equation='dz/dθ ∝ (1 − z sgn ω)^shape, T_C = F z; 63 % of the way after the distance',
    reference='Dahl, AIAA J. 14 (1976) 1675; Canudas de Wit et al., IEEE TAC 40 (1995) 419; '
              'Al-Bender et al., IEEE TAC 50 (2005) 1883',
    constants=(('elements', '-'),),
    defaults={'elements': 0.0},
    # One state that forgets, or elements that each keep their turning point.
    variants=({'elements': 0.0}, {'elements': 1.0}),
    statement=lambda p: (
        'After each reversal friction builds up over '
        f"{p['presliding_distance']:.3g} rad (to 63 %) instead of at once."),
    reveals='since_reversal',
    picture='friction_since_reversal',
    seen='Behind a reversal friction grows over a distance instead of at once.',
    confused='backlash, a lag, the saturation velocity of the file',
    measure='small slow reversals of several amplitudes',
)
