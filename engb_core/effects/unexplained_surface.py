# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What is left when no physics is known for it: a torque tabulated over one or two coordinates.

Not a cause: it is never named, only written into the corrected model so that it predicts better.
"""

import math

from engb_core.effects.base import DIRECTION, Effect, Parameter, POSITION
from engb_core.physics.compiled import compiled, effect_function, Numbers

__all__ = ['DIRECTION_CODE', 'EFFECT', 'MOTOR_ANGLE_CODE', 'NOTHING_CODE', 'SURFACE_VALUES']

SURFACE_VALUES = 96
# Coordinates are given by their place in the sample, or by one of these.
MOTOR_ANGLE_CODE = 100.0
DIRECTION_CODE = float(DIRECTION)
NOTHING_CODE = -1.0


@compiled
def _coordinate(sample: Numbers, code: float) -> float:
    if code < 0.0:
        return 0.0
    if code == 100.0:
        return sample[POSITION] - 2.0 * math.pi * math.floor(sample[POSITION] / (2.0 * math.pi))
    return sample[int(code)]


@compiled
def _place(value: float, low: float, high: float, count: int) -> tuple[int, float]:
    """Return the lower knot and the part of the way to the next; held at both ends."""
    if count < 2:
        return 0, 0.0
    way = (value - low) / (high - low) * (count - 1)
    way = min(max(way, 0.0), count - 1.000001)
    knot = int(way)
    return knot, way - knot


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    base = 96
    columns = int(parameters[base + 3])
    rows = int(parameters[base + 7])
    x, along = _place(_coordinate(sample, parameters[base]), parameters[base + 1],
                      parameters[base + 2], columns)
    y, across = _place(_coordinate(sample, parameters[base + 4]), parameters[base + 5],
                       parameters[base + 6], rows)
    first = y * columns + x
    value = (1.0 - along) * parameters[first]
    if columns > 1:
        value += along * parameters[first + 1]
    if rows > 1:
        second = first + columns
        other = (1.0 - along) * parameters[second]
        if columns > 1:
            other += along * parameters[second + 1]
        value = (1.0 - across) * value + across * other
    return value


EFFECT = Effect(
    id='unexplained_surface',
    title='Unexplained torque',
    parameters=tuple(Parameter(f'value_{index:02d}', 'N·m', -1e9, 1e9, none=0.0, starts=(0.0,),
                               default=0.0)
                     for index in range(SURFACE_VALUES)),
    stages={'torque': _torque},
    equation='T = table over the coordinates, linear between knots',
    reference='none: what is left',
    statement=lambda p: 'A torque that no known effect accounts for.',
    reveals='position',
    constants=(('x_code', '-'), ('x_from', 'SI'), ('x_to', 'SI'),
               ('x_count', '-'), ('y_code', '-'), ('y_from', 'SI'), ('y_to', 'SI'),
               ('y_count', '-')),
    unnamed=True,
)
