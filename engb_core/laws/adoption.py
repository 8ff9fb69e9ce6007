# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A law that a diagnosis found, as a file of effects: so that next time it has a name."""

from __future__ import annotations

from collections.abc import Mapping
import keyword
import math
import re
from typing import Any

from engb_core.effects.base import Parameter
from engb_core.errors import InputError
from engb_core.laws.adopted import adopted_effect
from engb_core.laws.grammar import Call, Expression, Name, parameters_of, parse, walk

__all__ = ['effect_text', 'test_text']

# How far beside its value a number may lie: a size, a width or order, a place.
_SIZE, _WIDTH, _ORDER, _PLACE = 30.0, 20.0, 1.5, 3.0
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
    parameters = tuple(_parameter(entry, index == 0, expression, given)
                       for index, entry in enumerate(parameters_of(expression)))
    title = name.replace('_', ' ').capitalize()
    spans = {key: (float(low), float(high)) for key, (low, high) in within.items()}
    # Whoever reads the file later gets no surprise: it is made once here.
    adopted_effect(name, title, pattern, acts_as, parameters, origin, spans)
    lines = '\n'.join(f'        {_written(entry)},' for entry in parameters)
    return f'''"""{title}: a law that was found in recordings and adopted by name."""

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
               ) -> Parameter:
    try:
        entry = given[name]
        value, unit = float(entry['value']), str(entry['unit'])
        if not math.isfinite(value):
            raise ValueError
    except (TypeError, KeyError, ValueError):
        raise InputError(f'diagnosis.json: unexplained.law.parameters.{name} has no value and '
                         'unit; write it anew with engb diagnose') from None
    if sizing:
        return Parameter(name, unit, -_SIZE * abs(value), _SIZE * abs(value), none=0.0,
                         starts=(value,))
    role = _role(name, expression)
    if role == 'phase':
        return Parameter(name, unit, -20.0, 20.0, starts=(value,))
    if role in ('width', 'order') and value > 0.0:
        factor = _WIDTH if role == 'width' else _ORDER
        return Parameter(name, unit, value / factor, value * factor, starts=(value,),
                         logarithmic=True)
    reach = _PLACE * max(abs(value), 1e-6)
    return Parameter(name, unit, value - reach, value + reach, starts=(value,))


def _role(name: str, expression: Expression) -> str:
    """Return what a parameter is in its formula: a phase, an order, a width or a place."""
    for entry in walk(expression):
        if not isinstance(entry, Call):
            continue
        inside = [Name(name) in list(walk(argument)) for argument in entry.arguments]
        if entry.function in ('sin', 'cos') and inside[0]:
            product = any(isinstance(part, Call) and part.function == '*'
                          and Name(name) in part.arguments for part in walk(entry.arguments[0]))
            return 'order' if product else 'phase'
        if entry.function in _WIDTHS and inside[-1]:
            return 'width'
        if entry.function == 'rested' or (entry.function == '/' and inside[1]):
            return 'width'
    return 'place'


def _written(entry: Parameter) -> str:
    more = '' if entry.none is None else f', none={entry.none!r}'
    more += ', logarithmic=True' if entry.logarithmic else ''
    return (f'Parameter({entry.name!r}, {entry.unit!r}, {entry.low:.6g}, {entry.high:.6g}, '
            f'starts=({entry.starts[0]:.6g},){more})')
