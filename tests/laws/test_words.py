# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How formulas are printed and read, and what is said of a law, settled or not."""

from __future__ import annotations

from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest

from engb_core.diagnose.diagnosis import ParameterEstimate
from engb_core.errors import InputError
from engb_core.laws.adoption import effect_text
from engb_core.laws.atoms import first_forms
from engb_core.laws.forms import Atom, BASE_UNITS, Form, Scales, Slot
from engb_core.laws.grammar import parse, printed, with_names, with_values
from engb_core.laws.line import Line, line_of, LONGEST_LINE
from engb_core.laws.machine import MOST_PARAMETERS, program_of
from engb_core.laws.statement import statement_of

SLOT = Slot('rad', 2.0, 0.1, 10.0)


def test_a_negative_number_is_taken_away():
    law = with_values(parse('a * load + b'), {'a': 1.5, 'b': -2.0})
    assert printed(law) == '1.5 * load - 2'
    assert printed(with_values(parse('b + a * load'), {'a': 1.5, 'b': -2.0})) == '-2 + 1.5 * load'


def test_parameters_get_other_names():
    law = with_names(parse('a * sin(b * position) + 2'), {'a': 'x', 'b': 'y'})
    assert printed(law) == 'x * sin(y * position) + 2'


def estimated(**values: float) -> dict[str, ParameterEstimate]:
    return {name: ParameterEstimate(value, 0.01 * abs(value), '-')
            for name, value in values.items()}


@pytest.mark.parametrize(('pattern', 'line'), [
    ('a * (-position)', 'T = 2.00(2) · −θ'), ('a * 2 * load', 'T = 2.00(2) · 2 · load'),
    ('a * velocity**2', 'T = 2.00(2) · ω²'), ('-(a + load)', 'T = −(2.00(2) + load)'),
    ('a / (load - time)', 'T = 2.00(2)/(load − t)'),
    ('a * sin(1 * disc_angle)', 'T = 2.00(2) · sin(disc_angle)'),
    ('a * exp(-abs(velocity) / (3 * abs(load)))', 'T = 2.00(2) · exp(−|ω|/(3 · |load|))'),
])
def test_a_formula_is_written_for_reading(pattern, line):
    assert line_of('torque', parse(pattern), estimated(a=2.0)).text == line


def test_a_line_of_many_factors_names_some_and_tells_them_below():
    names = 'bcdefghijkl'
    pattern = 'a' + ''.join(f' * sin(position - {name})' for name in names)
    line = line_of('torque', parse(pattern), estimated(a=2.0, **dict.fromkeys(names, 1.23456)))
    assert len(line.text) <= LONGEST_LINE and line.text.count('sin(') + len(line.below) == 11
    assert all(said.endswith(' = sin(θ − 1.23(1))') for said in line.below)


def test_short_symbols_come_before_letters_and_are_explained():
    line = line_of('torque', parse('a * load * exp(-time_since_reversal / b) * abs(effort)'),
                   estimated(a=2.0, b=0.345))
    assert line.text == 'T = 2.00(2) · T_L · exp(−t_r/0.345) · |T_M|'
    assert line.below == ('T_L is the load', 'T_M is the effort',
                          't_r is the time since the last reversal')
    assert str(line).endswith(', where T_L is the load, T_M is the effort, '
                              't_r is the time since the last reversal')


SCALES = Scales(low=-3.2, high=31.7, speed=83.1, load=0.6123, effort=0.7712, acceleration=812.3,
                duration=61.7, sampling=1e-3, disc=104.2, temperature=(20.0, 180.0),
                pulls_both_ways=True)


def written(acts_as: str, factors: tuple[Atom, ...], size: float, error: float) -> Line:
    form = Form(acts_as, factors, size)
    return line_of(acts_as, parse(form.formula), {
        entry.name: ParameterEstimate(value * 1.0173 or -3.8412, error * abs(value), entry.unit)
        for entry, value in zip(form.parameters(), form.starts(), strict=True)})


@pytest.mark.parametrize('acts_as', list(BASE_UNITS))
@pytest.mark.parametrize(('size', 'error'), [(0.0031, 0.012), (-3.1271e-5, 1.2e-4), (41.7, 0.3)])
def test_no_line_of_up_to_three_factors_is_longer(acts_as, size, error):
    """Every atom alone; and of those that take most room, with the most common short ones, every
    pair and product of three."""
    atoms = list({(atom.kind, atom.text): atom
                  for form in first_forms(SCALES) if form.acts_as == acts_as
                  for atom in form.factors}.values())
    assert len(atoms) > 10
    longest = sorted(atoms, key=lambda atom: -len(atom.text))[:9]
    units = sorted(atoms, key=lambda atom: -len(str(atom.unit)))[:6]
    chosen = list({atom.text: atom for atom in (*longest, *units, *atoms[:3])}.values())
    for factors in (*((atom,) for atom in atoms), *combinations(chosen, 2),
                    *combinations(chosen, 3)):
        line = written(acts_as, factors, size, error)
        assert len(line.text) <= LONGEST_LINE, line
        # Nothing is cut off: each letter is told.
        assert all(said.partition(' = ')[2] or ' is ' in said or ' in ' in said
                   for said in line.below)


def test_a_law_of_too_many_numbers_is_refused():
    law = parse(' + '.join(f'p{number} * load' for number in range(MOST_PARAMETERS + 1)))
    with pytest.raises(InputError, match=f'at most {MOST_PARAMETERS} can be had'):
        program_of(law, 'torque', {})


# ---- what is said

def found(acts_as: str, *atoms: Atom, settled: bool = True, approximate: bool = False,
          rival: bool = False, joint: str = 'revolute') -> SimpleNamespace:
    """Return a law as it is believed, over a stroke that is fast where the law misses most."""
    form = Form(acts_as, atoms, 0.5)
    names = [entry.name for entry in form.parameters()]
    size = 400
    position = np.linspace(0.0, 40.0, size)
    velocity = np.where(position > 30.0, 7.0, 1.0)
    residual = np.where(position > 30.0, 1.0, 0.1)
    run = SimpleNamespace(motion=SimpleNamespace(velocity=velocity, position=position),
                          comparison=SimpleNamespace(grid=np.arange(size)))
    values = dict(zip(names, form.starts(), strict=True))
    candidate = SimpleNamespace(form=form, values=values, fit=SimpleNamespace(
        residual=residual, predicted=np.zeros(size)))
    other = SimpleNamespace(form=Form('torque', (), 0.5), values={'a': 0.25},
                            fit=SimpleNamespace(predicted=residual))
    return SimpleNamespace(
        candidate=candidate, settled=settled, approximate=approximate, explained=0.8,
        parameters={name: ParameterEstimate(value, None, '-') for name, value in values.items()},
        alternatives=(other,) if rival else (),
        fitter=SimpleNamespace(problem=SimpleNamespace(
            runs=[run], scene=SimpleNamespace(joint_type=joint))))


def atom(kind: str, text: str) -> Atom:
    return Atom(kind, text, (SLOT,) * text.count('{'))


@pytest.mark.parametrize(('law', 'words'), [
    (found('delay', atom('speed', 'abs(velocity)')),
     'A machine does so with a sensor, filter or bus whose delay is not constant.'),
    (found('position_delay', atom('speed', 'abs(velocity)')),
     'with a position sensor whose reading comes late, the more so the larger these are.'),
    (found('position_shift', atom('wave', 'sin({0} * motor_angle)')),
     'with an encoder that is off centre or interpolates wrongly.'),
    (found('load_shift', atom('load', 'load')),
     'with a part that grows with heat, wears or bends, so that contact comes elsewhere.'),
    (found('torque', atom('load', 'load'), atom('wave', 'sin({0} * position)')),
     'with a screw, gear or guide whose error repeats along the stroke.'),
    (found('torque', atom('heat effort long', 'heat(abs(effort), {0})')),
     'with a part that its own losses warm.'),
    (found('torque', atom('lag load', 'lag(load, {0})')),
     'with a part that follows late: something soft, viscous or warm.'),
])
def test_a_settled_law_is_told_with_what_does_so_in_a_machine(law, words):
    told = statement_of(law)
    assert words in told
    assert told.endswith(' It explains 80 % of what was left.') and 'not settled' not in told


def test_a_law_beside_a_name_of_its_coordinate_corrects_it():
    law = found('torque', atom('wave', 'sin({0} * position)'))
    assert 'It corrects the form of cogging torque.' in statement_of(law, ('Cogging torque',))
    assert 'corrects' not in statement_of(law)


def test_a_law_of_a_kind_without_a_cause_names_none():
    told = statement_of(found('torque', atom('odd', 'abs(load)')))
    assert 'A machine does so' not in told
    assert told.startswith('A torque that depends on the load: T = 0.5 · |load|.')


def test_a_law_that_is_not_settled_says_what_to_record():
    told = statement_of(found('torque', atom('load', 'load'), settled=False, rival=True))
    assert told.startswith('What is left follows the load like T = 0.5 · load; the form is not')
    assert told.endswith('As well does 0.25; the two differ most at 7 to 7 rad/s between 31.1 and '
                         '39 rad: record more of that, and beyond it.')


def test_an_approximation_is_no_cause_and_says_where_it_misses():
    told = statement_of(found('torque', atom('wave', 'sin({0} * position)'), settled=False,
                              approximate=True, joint='prismatic'))
    assert 'roughly like' in told and 'A machine does so' not in told
    assert told.endswith('It misses most at 7 to 7 m/s between 31.1 and 39 m: record more of '
                         'that, slower and faster.')


# ---- a law that gets a name of its own

def adopted(pattern: str, **values: float) -> dict[str, tuple[float, float]]:
    """Return the bounds that the written effect gives each of its parameters."""
    text = effect_text('my_law', {'pattern': pattern, 'acts_as': 'torque', 'parameters': {
        name: {'value': value, 'std': None, 'unit': '-'} for name, value in values.items()}}, {},
        'a test')
    space: dict[str, object] = {}
    exec(compile(text, 'my_law.py', 'exec'), space)     # noqa: S102 — what a user would import
    return {entry.name: (entry.low, entry.high) for entry in space['EFFECT'].parameters}


@pytest.mark.parametrize(('pattern', 'values', 'logarithmic'), [
    ('a * peak(velocity / b)', {'a': 1.0, 'b': 3.0}, True),
    ('a * tanh(load / b)', {'a': 1.0, 'b': 3.0}, True),
    ('a * lag(load, b)', {'a': 1.0, 'b': 3.0}, True),
    ('a * rested(position, b)', {'a': 1.0, 'b': 3.0}, True),
    ('a * sin(position + b)', {'a': 1.0, 'b': 3.0}, False),
    ('a * abs(load - b)', {'a': 1.0, 'b': 3.0}, False),
    ('a * abs(load - b)', {'a': -2.0, 'b': -3.0}, False),
])
def test_an_adopted_parameter_has_bounds_of_its_kind(pattern, values, logarithmic):
    found = adopted(pattern, **values)
    low, high = found['b']
    assert low < values['b'] < high
    assert (low > 0.0) == logarithmic
    if logarithmic:
        assert values['b'] / low == pytest.approx(high / values['b'])
    assert found['a'][0] == -found['a'][1] < 0.0


@pytest.mark.parametrize('law', [
    {'pattern': 3, 'acts_as': 'torque', 'parameters': {}},
    {'pattern': 'a * load', 'parameters': {}}, {'pattern': 'a', 'acts_as': 'torque'},
    {'pattern': 'a * load', 'acts_as': 'torque', 'parameters': {}},
    {'pattern': 'a * load', 'acts_as': 'torque', 'parameters': {'a': {'value': float('nan'),
                                                                      'unit': '-'}}},
])
def test_a_law_that_lacks_a_part_is_refused(law):
    with pytest.raises(InputError, match='write it anew with engb diagnose'):
        effect_text('my_law', law, {}, 'a test')
