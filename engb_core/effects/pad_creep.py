"""Load relaxes while the pad is held (visco-elastic pad)."""

import math

from engb_core.compiled import effect_function
from engb_core.effects.base import Effect, LOAD, Parameter, TIME, TIME_STEP


@effect_function
def _load(parameters, state, sample):
    if sample[TIME] <= 0.0:
        state[0] = 0.0
    blend = 1.0 - math.exp(-sample[TIME_STEP] / parameters[1])
    state[0] += blend * (sample[LOAD] - state[0])
    return sample[LOAD] - parameters[0] * state[0]


EFFECT = Effect(
    id='pad_creep',
    title='Pad creep',
    parameters=(
        Parameter('relaxed_fraction', '-', 0.0, 0.8, none=0.0, starts=(0.05,), form=0.15),
        Parameter('time_constant', 's', 0.1, 60.0, starts=(0.3, 1.0, 3.0),
                  logarithmic=True, form=0.15),
    ),
    stages={'load': _load},
    equation='T_L = T_L(θ) − fraction·q, τ q̇ = T_L(θ) − q',
    reference='standard linear solid; Ferry, Viscoelastic Properties of Polymers (1980)',
    statement=lambda p: (
        f"Held at one angle the load relaxes by {p['relaxed_fraction'] * 100:.1f} % with a "
        f"time constant of {p['time_constant']:.2g} s (pad creep)."),
    reveals='time_in_contact',
    applies=lambda scene: scene.largest_load > 0,
)
