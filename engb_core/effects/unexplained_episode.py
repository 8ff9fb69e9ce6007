# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A torque that was there for a while and went; no cause is claimed, and no other recording
has it."""

import math

from engb_core.effects.base import DIRECTION, Effect, LOAD, Parameter, TIME
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    if sample[TIME] < parameters[1] - 0.5 or sample[TIME] > parameters[2] + 0.5:
        return 0.0
    # Edges of 20 ms: sharp, and yet the fit can move them.
    begun = 1.0 / (1.0 + math.exp(-min(max((sample[TIME] - parameters[1]) / 0.02, -40.0), 40.0)))
    ended = 1.0 / (1.0 + math.exp(-min(max((sample[TIME] - parameters[2]) / 0.02, -40.0), 40.0)))
    size = parameters[0] * (begun - ended)
    if parameters[3] > 1.5:
        return size * sample[LOAD]
    return size * sample[DIRECTION] if parameters[3] > 0.5 else size


EFFECT = Effect(
    id='unexplained_episode',
    title='Unexplained episode',
    parameters=(
        Parameter('size', 'N·m', -1e12, 1e12, none=0.0, starts=(0.01,)),
        Parameter('begin', 's', -1e12, 1e12, kind='begin'),
        Parameter('end', 's', -1e12, 1e12, kind='end'),
    ),
    stages={'torque': _torque},
    equation='T = size · (1, sgn ω or T_L) from begin to end',
    reference='none: what is left',
    statement=lambda p: (f"From {p['begin']:.2f} to {p['end']:.2f} s something acts that is "
                         'not there before or after (a passing fault).'),
    reveals='time',
    tells=lambda p: ('time', *((), ('direction',), ('load',))[int(p['kind'] + 0.5)]),
    constants=(('kind', '-'),),
    variants=({'kind': 0.0}, {'kind': 1.0}, {'kind': 2.0}),
    unnamed=True,
    only_here=True,
)
