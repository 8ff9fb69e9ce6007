# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The drive moves its set-point no faster than a speed of its own."""

import math

from engb_core.effects.base import Effect, Parameter, REFERENCE, TIME, TIME_STEP
from engb_core.physics.compiled import effect_function, Numbers

# Place in the state: the set-point on which the drive acted last.
_ACTED = 0


@effect_function
def _command(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    if sample[TIME] <= 0.0:
        state[_ACTED] = sample[REFERENCE]
    most = parameters[0] * sample[TIME_STEP]
    state[_ACTED] += min(most, max(-most, sample[REFERENCE] - state[_ACTED]))
    return state[_ACTED]


EFFECT = Effect(
    id='command_rate_limit',
    title='Command rate limit',
    # Starts are those of a motor's speed, and are scaled to the speed of a short swing.
    parameters=(Parameter('speed', 'rad/s', 1e-3, 1e5, none=math.inf,
                          starts=(15.0, 25.0, 40.0, 60.0, 90.0), logarithmic=True),),
    stages={'command': _command},
    equation='|d/dt set-point acted on| ≤ speed',
    reference='contract, additions; profile velocity of position-controlled servos',
    statement=lambda p: (f"The drive moves its set-point by no more than {p['speed']:.3g} rad/s "
                         '(command rate limit).'),
    reveals='time',
    picture='lag',
    seen='Recorded effort runs ahead only where the reference moves faster than some speed, and '
         'after its steps.',
    confused='a delay of the set-point, a limit of effort, back-EMF',
    measure='steps of the reference of several heights: the time to arrive grows with the height',
    applies=lambda scene: scene.commanded,
)
