# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Torque per effort that changes over the recording; no cause is claimed."""

import math

from engb_core.effects.base import Effect, EFFORT, Parameter, TIME, TIME_STEP
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _actuation(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    settling = parameters[1] * parameters[2]
    if parameters[4] > 0.5:
        # Heat: the loss, ∝ effort², through the winding's time constant.
        if sample[TIME] <= 0.0:
            state[0] = 0.0
        share = 1.0 - math.exp(-sample[TIME_STEP] / settling)
        state[0] += share * ((sample[EFFORT] / parameters[3]) ** 2 - state[0])
        return sample[EFFORT] * (1.0 + parameters[0] * state[0])
    progress = ((1.0 - math.exp(-sample[TIME] / settling))
                / (1.0 - math.exp(-parameters[2] / settling)))
    return sample[EFFORT] * (1.0 + parameters[0] * progress)


EFFECT = Effect(
    id='unexplained_gain_drift',
    title='Unexplained drift of torque per effort',
    parameters=(
        Parameter('relative_change', '-', -0.8, 2.0, none=0.0, starts=(-0.05,)),
        Parameter('settling', '-', 0.05, 20.0, starts=(0.15, 0.6, 5.0), logarithmic=True),
    ),
    stages={'actuation': _actuation},
    of_motion=True,
    proportional=lambda p: p['by_heat'] < 0.5,
    equation='T_M = effort · (1 + change · progress), of time or of the heat of the effort',
    reference='none: what is left',
    statement=lambda p: ('The torque for a given effort changes by '
                         f"{p['relative_change'] * 100:+.1f} % "
                         + ('with the heat of the effort' if p['by_heat'] > 0.5
                            else 'over the recording')
                         + ', load and friction alike; no effect of the library does that.'),
    reveals='time',
    tells=lambda p: ('heat' if p['by_heat'] > 0.5 else 'time', 'effort'),
    remembers=lambda p: p['by_heat'] > 0.5,
    constants=(('duration', 's'), ('largest_effort', 'N·m'), ('by_heat', '-')),
    defaults={'duration': 60.0, 'largest_effort': 0.5, 'by_heat': 0.0},
    set_constants=lambda scene: {'duration': scene.duration,
                                 'largest_effort': max(scene.largest_effort, 1e-9)},
    variants=({'by_heat': 0.0}, {'by_heat': 1.0}),
    unnamed=True,
)
