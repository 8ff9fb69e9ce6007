# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The load curve has another form than the model's: a table over the angle that is added to it.

A caliper's, a linkage's or a cable's load need be no polynomial. What the model's own form cannot
follow stands here, a cubic between knots that lie evenly along the stroke, or a part of them about
one place where the curve bends: an end stop, a spring that is preloaded. Beyond them its slope
goes on as far as two knots lie apart, since a stiffness does not end where a recording did;
further on nothing is known, and the last value holds.
"""

from collections.abc import Mapping
import math

import numpy as np

from engb_core.effects.base import Effect, LOAD, Parameter, POSITION
from engb_core.physics.compiled import compiled, effect_function, Numbers

__all__ = ['EFFECT', 'KNOTS', 'knot_of']

# A wave that repeats five times or more along the stroke is told from the load curve by that
# (findings.py): knots a little nearer than its half wave follow every slower one.
KNOTS = 12
_EVENLY = {'dense_at': 0.0, 'dense_width': 1.0, 'dense_part': 0.0}


@compiled
def knot_of(parameters: Numbers, position: float) -> float:
    """Return how many knots lie before a position, and the part of the way to the next."""
    low, high = parameters[12], parameters[13]
    even = (position - low) / (high - low)
    at, width, dense = parameters[14], max(parameters[15], 1e-9), parameters[16]
    begin, end = math.tanh((low - at) / width), math.tanh((high - at) / width)
    if dense <= 0.0 or end <= begin:
        return 11.0 * even
    passed = (math.tanh((position - at) / width) - begin) / (end - begin)
    return 11.0 * ((1.0 - dense) * even + dense * passed)


@effect_function
def _load(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    way = knot_of(parameters, sample[POSITION])
    beyond = min(max(way, -1.0), 12.0)
    way = min(max(way, 0.0), 10.999999)
    beyond -= min(max(beyond, 0.0), 11.0)
    knot = int(way)
    part = way - knot
    here, there = parameters[knot], parameters[knot + 1]
    # Straight on beyond the ends.
    before = parameters[knot - 1] if knot > 0 else 2.0 * here - there
    after = parameters[knot + 2] if knot < 10 else 2.0 * there - here
    bend = 2.0 * before - 5.0 * here + 4.0 * there - after
    twist = 3.0 * (here - there) + after - before
    return (sample[LOAD] + here + 0.5 * part * (there - before + part * (bend + part * twist))
            + beyond * (there - here))


def _statement(p: Mapping[str, float]) -> str:
    values = [p[f'value_{index:02d}'] for index in range(KNOTS)]
    place = max(range(KNOTS), key=lambda index: abs(values[index]))
    constants = [*values, p['from'], p['to'], *(p.get(name, default)
                                                for name, default in _EVENLY.items())]
    angles = np.linspace(p['from'], p['to'], 1001)
    angle = np.interp(place, [knot_of(constants, angle) for angle in angles], angles)
    return ('The load curve has another form than the model file can give it: '
            f'{values[place] * 1e3:+.3g} mN·m at {angle:.3g} rad beside it. The table in the '
            'corrected model holds it.')


EFFECT = Effect(
    id='load_curve_shape',
    title='The load curve has another form',
    parameters=tuple(Parameter(f'value_{index:02d}', 'N·m', -1e9, 1e9, none=0.0, starts=(0.01,),
                               default=0.0) for index in range(KNOTS)),
    stages={'load': _load},
    equation='T_L = T_L,model(θ) + table(θ), cubic between 12 knots along the stroke',
    reference='Catmull and Rom, Computer Aided Geometric Design (1974)',
    statement=_statement,
    reveals='position',
    picture='load_over_position',
    seen='What the refitted load curve leaves lies along the angle, the same at every speed.',
    confused='a contact or stiffness that is off; play and creep, which differ on the way back',
    measure='slow full strokes, both ways, and the load curve identified anew from them',
    constants=(('from', 'rad'), ('to', 'rad'), ('dense_at', 'rad'), ('dense_width', 'rad'),
               ('dense_part', '-')),
    defaults=_EVENLY,
    set_constants=lambda scene: {
        **dict(zip(('from', 'to'), scene.position_range, strict=True)), **_EVENLY},
    number_only=True,
    applies=lambda scene: scene.largest_load > 0,
)
