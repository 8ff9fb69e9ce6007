# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A torque at one place of the stroke; no cause is claimed."""

import math

from engb_core.effects.base import DIRECTION, Effect, Parameter, POSITION
from engb_core.physics.compiled import effect_function, Numbers


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    distance = abs(sample[POSITION] - parameters[1]) / parameters[2]
    if distance > 20.0 or (distance > 6.5 and parameters[3] >= 2.0):
        # Nothing is left of it here.
        return 0.0
    bump = parameters[0] * math.exp(-0.5 * distance ** parameters[3])
    return bump * sample[DIRECTION] if parameters[4] > 0.5 else bump


EFFECT = Effect(
    id='unexplained_spot',
    title='Unexplained torque at one place',
    parameters=(
        Parameter('height', 'N·m', -1e12, 1e12, none=0.0, starts=(0.005,)),
        Parameter('centre', 'rad', -1e12, 1e12, kind='place'),
        Parameter('width', 'rad', 1e-3, 1e4, logarithmic=True, kind='width'),
        Parameter('shape', '-', 1.2, 12.0, starts=(2.0,), logarithmic=True, kind='exponent'),
    ),
    stages={'torque': _torque},
    equation='T = height · exp(−½ |(θ − centre)/width|^shape), even or odd in speed',
    reference='none: what is left',
    statement=lambda p: (f"A torque of {p['height'] * 1e3:.3g} mN·m acts at one place of the "
                         f"stroke, from {p['centre'] - p['width']:.3g} to "
                         f"{p['centre'] + p['width']:.3g} rad"
                         + (', against the motion' if p['by_direction'] > 0.5 else '')
                         + '; no effect of the library does that.'),
    reveals='position',
    tells=lambda p: ('position', 'direction') if p['by_direction'] > 0.5 else ('position',),
    constants=(('by_direction', '-'),),
    variants=({'by_direction': 0.0}, {'by_direction': 1.0}),
    unnamed=True,
)
