# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which part of the mechanism turns with the order of a law's wave."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from engb_core.diagnose.constants import STANDS_OUT
from engb_core.diagnose.diagnosis import Diagnosis, ParameterEstimate
from engb_core.laws.grammar import Call, Expression, Name, Number, parse, walk
from engb_core.laws.line import with_error
from engb_core.mechanism.kinematics import Mechanism
from engb_core.mechanism.turning import Turning, turning_parts

__all__ = ['orders_of_waves', 'parts_that_turn', 'with_mechanism']

# A whole order that stands in a law without a free number is exact but for rounding.
_EXACT = 1e-6
_ANGLES = ('position', 'motor_angle')
_PARTS = {'motor': 'the motor, with the pinion of its reduction gear',
          'screw': 'the ball screw, with the wheel of its reduction gear',
          'lever': 'the lever', 'gear': 'the non-circular gear'}
_ONCE = {'motor': 'something off centre or bent on its shaft', 'screw': 'its lead error',
         'lever': 'the shape of its contact', 'gear': 'its shape'}


def with_mechanism(diagnosis: Diagnosis, mechanism: Mechanism) -> Diagnosis:
    """Return the diagnosis whose law, if it repeats along the stroke, says which part of the
    mechanism turns so."""
    rest = diagnosis.unexplained
    if rest is None or rest.law is None:
        return diagnosis
    law = rest.law
    joint = diagnosis.model.joint.type
    parts = turning_parts(mechanism, joint)
    said = ' '.join(_sentence(order, parts_that_turn(order, parts), joint)
                    for order in orders_of_waves(parse(law.pattern), law.parameters))
    if not said:
        return diagnosis
    statement = f'{law.statement} {said}'
    return replace(diagnosis, unexplained=replace(
        rest, statement=rest.statement.replace(law.statement, statement),
        law=replace(law, statement=statement)))


def orders_of_waves(pattern: Expression, parameters: Mapping[str, ParameterEstimate],
                    ) -> list[ParameterEstimate]:
    """Return the order of each wave along the stroke [1/rad or 1/m], with its standard deviation
    (0: a whole one without a free number)."""
    found = []
    for entry in walk(pattern):
        if not (isinstance(entry, Call) and entry.function in ('sin', 'cos')):
            continue
        inside = list(walk(entry.arguments[0]))
        if not any(Name(name) in inside for name in _ANGLES):
            continue
        order: Expression = Number(1.0)
        for part in inside:
            if isinstance(part, Call) and part.function == '*':
                order = next((other for other, axis in (part.arguments, part.arguments[::-1])
                              if isinstance(axis, Name) and axis.name in _ANGLES), order)
        if isinstance(order, Number):
            found.append(ParameterEstimate(order.value, 0.0, ''))
        elif isinstance(order, Name) and order.name in parameters:
            found.append(parameters[order.name])
    return found


def parts_that_turn(order: ParameterEstimate, parts: tuple[Turning, ...]) -> list[Turning]:
    """Return the parts of which a harmonic lies within `STANDS_OUT` standard errors of the order,
    the lowest harmonics first; none of an order whose error is not known."""
    if order.std is None:
        return []
    reach = max(STANDS_OUT * order.std, _EXACT * abs(order.value))
    found: dict[str, Turning] = {}
    for part in sorted(parts, key=lambda entry: entry.harmonic):
        if part.low - reach <= abs(order.value) <= part.high + reach:
            found.setdefault(part.part, part)
    return list(found.values())


def _sentence(order: ParameterEstimate, parts: list[Turning], joint: str) -> str:
    per = 'per motor turn' if joint == 'revolute' else 'per 2π m'
    number = with_error(replace(order, unit=''))
    if order.std is None:
        return f'Which part of the mechanism turns with its order, {number} {per}, is not told: ' \
            'its error is not known.'
    if not parts:
        return f'By the mechanism file no part turns with its order, {number} {per}, within ' \
            f'{STANDS_OUT:g} standard errors.'
    told = ' or '.join(_named(part) for part in parts)
    return f'By the mechanism file the order {number} {per} is that of {told}.'


def _named(part: Turning) -> str:
    if part.harmonic == 1:
        return f'{_PARTS[part.part]} ({_ONCE[part.part]})'
    return f'{_PARTS[part.part]}, {part.harmonic} times a turn'
