# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A law that a diagnosis found, as a file of effects: so that next time it has a name."""

from __future__ import annotations

from collections.abc import Mapping
import keyword
import math
import re
from typing import Any

from engb_core.diagnose.diagnosis import ParameterEstimate
from engb_core.effects.base import Parameter
from engb_core.errors import InputError
from engb_core.laws.adopted import adopted_effect
from engb_core.laws.grammar import (
    Call,
    COORDINATES,
    coordinates_of,
    Expression,
    Name,
    parameters_of,
    parse,
    walk,
)
from engb_core.laws.line import with_error

__all__ = ['effect_text', 'test_text']

# What may be another one on the next machine, or later on this one. A size: so many times as
# large, with either sign. A width or a time: by this factor, and by what its own error leaves
# open.
_SIZE, _WIDTH = 10.0, 5.0
# Standard errors that are left open of a number.
_ERRORS = 5.0
# An order is that of a part: it stays, as far as the law itself and the region tell it. A quarter
# of a period over the region is what a search for orders resolves (atoms.py); of a wave that goes
# on beyond the region, which is not kept then, a part of the order.
_PART_OF_PERIOD, _PART_OF_ORDER = 0.25, 0.05
# A place may be anywhere in the region, and so far beyond as a part of it; without a region, so
# many times its value away.
_BEYOND, _PLACE = 0.1, 3.0
_WIDTHS = ('step', 'bell', 'lag', 'heat', 'travel_lag', 'stop', 'drag', 'rested',
           'highest')


def effect_text(name: str, law: Mapping[str, Any], within: Mapping[str, tuple[float, float]],
                origin: str) -> str:
    """Return the text of an effect's file.

    Args:
        name: that the effect gets.
        law: `unexplained.law` of a diagnosis.json.
        within: the ranges of the law in the corrected model file.
        origin: where it was found, one line.

    Raises:
        InputError: not a name, or not a law.
    """
    if not re.fullmatch(r'[a-z][a-z0-9_]*', name) or keyword.iskeyword(name):
        raise InputError(f'--name {name}: use small letters, digits and _, such as '
                         'screw_lead_error')
    pattern, acts_as, given = law.get('pattern'), law.get('acts_as'), law.get('parameters')
    if not isinstance(pattern, str) or not isinstance(acts_as, str) \
            or not isinstance(given, Mapping):
        raise InputError('diagnosis.json: unexplained.law lacks pattern, acts_as or parameters; '
                         'write it anew with engb diagnose')
    expression = parse(pattern)
    title = name.replace('_', ' ').capitalize()
    spans = {key: (float(low), float(high)) for key, (low, high) in within.items()}
    made = [_parameter(entry, index == 0, expression, given, spans)
            for index, entry in enumerate(parameters_of(expression))]
    parameters = tuple(entry for entry, _ in made)
    # Whoever reads the file later gets no surprise: it is made once here.
    adopted_effect(name, title, pattern, acts_as, parameters, origin, spans)
    lines = '\n'.join(f'        # {why}\n        {_written(entry)},' for entry, why in made)
    seen = '; '.join(f'{key} {low:.4g} to {high:.4g} {COORDINATES[key].unit}'
                     for key, (low, high) in spans.items()) or 'not recorded'
    return f'''"""{title}: a law that was found in recordings and adopted by name.

The region in which it was seen: {seen}.
"""

from engb_core.effects.base import Parameter
from engb_core.laws.adopted import adopted_effect

EFFECT = adopted_effect(
    id={name!r},
    title={title!r},
    formula={pattern!r},
    acts_as={acts_as!r},
    parameters=(
{lines}
    ),
    reference={origin!r},
    within={spans!r},
)
'''


def test_text(name: str) -> str:
    """Return the text of the adopted effect's test, which lies beside it."""
    return f'''"""{name}: an adopted law does nothing without its size, and something with it."""

import importlib.util
from pathlib import Path

import numpy as np

from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.model import LoadTorque, Model
from engb_core.physics.plant import physics_of
from engb_core.physics.sample_table import sample_table


def effect():
    path = Path(__file__).with_name({name + '.py'!r})
    module = importlib.util.module_from_spec(spec := importlib.util.spec_from_file_location(
        {name!r}, path))
    spec.loader.exec_module(module)
    return module.EFFECT


def effort(values):
    """Return the effort of a stroke over all the effect was seen in."""
    made = effect()
    model = Model(load_torque=LoadTorque(coefficients=(0.01, 1e-3)))
    low, high = {{'position': (0.0, 20.0), **_within()}}['position']
    time = np.arange(0.0, 4.0, 1e-3)
    middle, reach = 0.5 * (low + high), 0.5 * (high - low)
    samples = sample_table(1e-3, time, middle + reach * np.sin(3.0 * time),
                           3.0 * reach * np.cos(3.0 * time), -9.0 * reach * np.sin(3.0 * time),
                           disc_speed=10.0 + time, disc_angle=10.0 * time,
                           pad_temperature=20.0 + 20.0 * time)
    physics = physics_of(model, [(made, [*values, *made.defaults.values()])])
    return effort_of_motion(samples, 1e-3, physics)


def _within():
    import ast
    tree = ast.parse(Path(__file__).with_name({name + '.py'!r}).read_text())
    call = next(node for node in ast.walk(tree) if isinstance(node, ast.Call)
                and getattr(node.func, 'id', '') == 'adopted_effect')
    return ast.literal_eval(next(word.value for word in call.keywords if word.arg == 'within'))


def test_nothing_without_its_size():
    made = effect()
    starts = [entry.starts[0] for entry in made.parameters]
    none = effort([made.parameters[0].none, *starts[1:]])
    assert np.isfinite(none).all()
    assert np.abs(effort(starts) - none).max() > 0.0


def test_it_lies_within_its_bounds():
    for entry in effect().parameters:
        assert entry.low <= entry.starts[0] <= entry.high
        assert entry.unit
'''


# It is no test of this module.
test_text.__test__ = False  # type: ignore[attr-defined]


def _parameter(name: str, sizing: bool, expression: Expression, given: Mapping[str, Any],
               within: Mapping[str, tuple[float, float]]) -> tuple[Parameter, str]:
    """Return a parameter with bounds from its estimate and the region, and why these."""
    try:
        entry = given[name]
        value, unit = float(entry['value']), str(entry['unit'])
        error = float(entry.get('std') or 0.0)
        if not (math.isfinite(value) and math.isfinite(error)):
            raise ValueError
    except (TypeError, KeyError, ValueError):
        raise InputError(f'diagnosis.json: unexplained.law.parameters.{name} has no value and '
                         'unit; write it anew with engb diagnose') from None
    seen = f'{name} was {with_error(ParameterEstimate(value, error or None, unit))}'
    open_ = _ERRORS * error
    if sizing:
        most = max(_SIZE * abs(value), abs(value) + open_)
        return Parameter(name, unit, -most, most, none=0.0, starts=(value,)), \
            f'{seen}: up to {_SIZE:g} times that, with either sign'
    role, coordinate = _role(name, expression)
    if role == 'phase':
        turn = 2.0 * math.pi
        return Parameter(name, unit, value - turn, value + turn, starts=(value,)), \
            f'{seen}: a phase may be any'
    region = within.get(coordinate)
    if role == 'order':
        period = _PART_OF_PERIOD * 2.0 * math.pi / (region[1] - region[0]) if region else \
            _PART_OF_ORDER * abs(value)
        reach = min(max(open_, period), 0.5 * abs(value))
        return Parameter(name, unit, value - reach, value + reach, starts=(value,)), \
            f'{seen}: a part keeps its order, as far as error and region tell it'
    if role == 'width' and value > 0.0:
        factor = max(_WIDTH, 1.0 + open_ / value)
        return Parameter(name, unit, value / factor, value * factor, starts=(value,),
                         logarithmic=True), f'{seen}: a {factor:.2g}th to {factor:.2g} times that'
    if region:
        beyond = _BEYOND * (region[1] - region[0])
        low, high = (min(region[0] - beyond, value - open_), max(region[1] + beyond,
                                                                 value + open_))
        return Parameter(name, unit, low, high, starts=(value,)), \
            f'{seen}: anywhere in the region of {coordinate}'
    reach = max(_PLACE * max(abs(value), 1e-6), open_)
    return Parameter(name, unit, value - reach, value + reach, starts=(value,)), \
        f'{seen}: within {_PLACE:g} times that'


def _role(name: str, expression: Expression) -> tuple[str, str]:
    """Return what a parameter is in its formula (a phase, an order, a width or a place), and the
    coordinate that it is compared with or multiplies ('' for none of them alone)."""
    for entry in walk(expression):
        if not isinstance(entry, Call):
            continue
        inside = [Name(name) in list(walk(argument)) for argument in entry.arguments]
        if not any(inside):
            continue
        beside = coordinates_of(entry)
        coordinate = beside[0] if len(set(beside)) == 1 else ''
        if entry.function in ('sin', 'cos') and inside[0]:
            product = any(isinstance(part, Call) and part.function == '*'
                          and Name(name) in part.arguments for part in walk(entry.arguments[0]))
            return 'order' if product else 'phase', coordinate
        if entry.function in _WIDTHS and inside[-1]:
            return 'width', coordinate
        if entry.function == 'rested' or (entry.function == '/' and inside[1]):
            return 'width', coordinate
        if entry.function in ('+', '-'):
            return 'place', coordinate
    return 'place', ''


def _written(entry: Parameter) -> str:
    more = '' if entry.none is None else f', none={entry.none!r}'
    more += ', logarithmic=True' if entry.logarithmic else ''
    return (f'Parameter({entry.name!r}, {entry.unit!r}, {entry.low:.6g}, {entry.high:.6g}, '
            f'starts=({entry.starts[0]:.6g},){more})')
