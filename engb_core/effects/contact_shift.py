# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The load curve is moved along the angle: worn pads, another clearance."""

from engb_core.effects.base import Effect, NUMBER_OFF, Parameter
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _shift(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    return -parameters[0]


EFFECT = Effect(
    id='contact_shift',
    title='Contact has shifted',
    parameters=(Parameter('shift', 'rad', -50.0, 50.0, none=0.0, starts=(0.3, -0.3),
                          of_stroke=0.1),),
    stages={'shift': _shift},
    equation='T_L = T_L,model(θ − shift)',
    reference='contract, table 4; pad wear and running clearance',
    statement=lambda p: (
        NUMBER_OFF + 'the load curve lies '
        f"{abs(p['shift']):.3g} rad {'later' if p['shift'] > 0 else 'earlier'} than in the "
        'model (pad wear or clearance).'),
    reveals='position',
    picture='load_over_position',
    seen='The load curve keeps its shape and begins earlier or later.',
    confused='a wrong load stiffness',
    measure='one full stroke from clearance into contact',
    number_only=True,
    # There is no contact in a load that is straight throughout; what moves it is an offset.
    applies=lambda scene: scene.largest_load > 0 and not scene.load_is_straight,
)
