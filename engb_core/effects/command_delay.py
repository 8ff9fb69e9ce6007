# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The drive acts on its set-point later than it is recorded."""

from engb_core.effects.base import Effect, Parameter, REFERENCE, TIME_STEP
from engb_core.physics.compiled import effect_function, Numbers
from engb_core.physics.delay_line import delayed


@effect_function
def _command(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    return delayed(state, sample[REFERENCE], sample[TIME_STEP], parameters[0])


EFFECT = Effect(
    id='command_delay',
    title='Command delay',
    parameters=(Parameter('delay', 's', 0.0, 0.5, none=0.0, starts=(0.01, 0.03, 0.08),
                          form_steps=0.25),),
    stages={'command': _command},
    equation='effort acted on = k · (reference(t − delay) − θ)',
    reference='contract, additions; bus and interpolation of a position-controlled drive',
    statement=lambda p: (f"The set-point acts {p['delay'] * 1e3:.1f} ms later than recorded, on "
                         'top of any lag of torque (command delay).'),
    reveals='time',
    picture='lag',
    seen='Recorded effort runs ahead while the reference moves, in proportion to its speed and to '
         'the loop gain; nothing at a standing reference.',
    confused='a lag of torque, viscous friction (which does not grow with the loop gain)',
    measure='the same reference at two loop gains: viscous friction stays, a delay grows with the '
            'gain',
    applies=lambda scene: scene.commanded,
)
