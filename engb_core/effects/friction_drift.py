"""Friction changes over the recording, for instance by warm-up."""

import math

from engb_core.compiled import effect_function
from engb_core.effects.base import Effect, LEVEL, Parameter, TIME


@effect_function
def _level(parameters, state, sample):
    duration = parameters[2]
    settling = parameters[1] * duration
    progress = ((1.0 - math.exp(-sample[TIME] / settling))
                / (1.0 - math.exp(-duration / settling)))
    return sample[LEVEL] * (1.0 + (parameters[0] - 1.0) * progress)


EFFECT = Effect(
    id='friction_drift',
    title='Friction drift',
    parameters=(
        Parameter('friction_ratio', '-', 0.05, 10.0, none=1.0, starts=(1.1,)),
        Parameter('settling', '-', 0.1, 20.0, starts=(0.4, 5.0), logarithmic=True),
    ),
    stages={'level': _level},
    equation='F(t) = F (1 + (ratio − 1) (1 − e^(−t/τ)) / (1 − e^(−T/τ)))',
    reference='Simoni et al., IFAC WC (2015): friction and temperature in drives',
    statement=lambda p: (
        f"Friction {'grows' if p['friction_ratio'] > 1 else 'falls'} during the recording "
        f"to {p['friction_ratio']:.2f} times its value at the start (warm-up)."),
    reveals='time',
    constants=(('duration', 's'),),
    set_constants=lambda scene: {'duration': scene.duration},
)
