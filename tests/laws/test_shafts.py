# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""With a mechanism file the order of a law says which part of the machine turns so."""

from __future__ import annotations

import argparse
from dataclasses import replace
import math

import pytest

from engb_core.diagnose.diagnosis import ParameterEstimate
from engb_core.laws.grammar import parse
from engb_core.laws.shafts import orders_of_waves, parts_that_turn, with_mechanism
from engb_core.mechanism.kinematics import CHOSEN
from engb_core.mechanism.turning import turning_parts
from engb_core.model import Joint, Model
from engb_ros.commands.diagnose import add_arguments
from engb_ros.commands.main import main
from tests.laws.test_told import law
from tests.report.samples import unexplained

SCREW = replace(CHOSEN, gear_ratio=4.3)


def told(order: float, std: float | None, mechanism=SCREW, joint: str = 'revolute') -> str:
    """Return what the mechanism adds to a law with this order."""
    diagnosis = unexplained()
    own = replace(law(), parameters={**law().parameters,
                                     'b': ParameterEstimate(order, std, '1/rad')})
    diagnosis = replace(diagnosis, model=replace(Model(), joint=Joint(type=joint)),
                        unexplained=replace(diagnosis.unexplained, law=own,
                                            statement=own.statement))
    found = with_mechanism(diagnosis, mechanism).unexplained
    assert found.statement == found.law.statement
    assert found.statement.startswith(own.statement)
    return found.statement.removeprefix(own.statement)


@pytest.mark.parametrize(('order', 'std', 'words'), [
    (1.0 / 4.3 + 1e-3, 1e-3, 'is that of the ball screw, with the wheel of its reduction '
                             'gear (its lead error).'),
    (2.0 / 4.3, 1e-3, 'the ball screw, with the wheel of its reduction gear, 2 times a turn.'),
    (3.001, 1e-3, 'the motor, with the pinion of its reduction gear, 3 times a turn.'),
    (1.0 / 4.3 + 3e-3, 1e-3, 'no part turns with its order'),
    (1.0, None, 'is not told: its error is not known'),
])
def test_the_part_that_turns_so_within_the_error(order, std, words):
    assert words in told(order, std)


def test_several_parts_are_a_set():
    """A screw that turns once in four motor turns has its fourth harmonic where the motor is."""
    text = told(1.0, 1e-3, replace(CHOSEN, gear_ratio=4.0))
    assert 'the motor, with the pinion of its reduction gear (something off centre' in text
    assert ' or the ball screw, with the wheel of its reduction gear, 4 times a turn' in text


def test_the_non_circular_gear_has_a_range():
    parts = [part for part in turning_parts(CHOSEN, 'revolute') if part.part == 'gear']
    middle = 0.5 * (parts[1].low + parts[1].high)
    assert 0.0 < parts[0].low < parts[0].high < 0.1
    assert 'the non-circular gear' in told(middle, 1e-6, CHOSEN)


def test_on_a_linear_axis_the_screw_turns_once_per_lead():
    assert 'lead error' in told(2.0 * math.pi / CHOSEN.screw_lead, 1.0, CHOSEN, 'prismatic')


@pytest.mark.parametrize(('pattern', 'orders'), [
    ('a * sin(b * position + c)', [(1.249, 0.001)]),
    ('a * load * sin(3 * position + c)', [(3, 0)]),
    ('a * cos(position + c)', [(1, 0)]), ('a * sin(2 * disc_angle + c)', []), ('a * load', []),
    ('a * sin(position * b)', [(1.249, 0.001)])])
def test_orders_are_read_from_the_formula(pattern, orders):
    found = orders_of_waves(parse(pattern), law().parameters)
    assert [(entry.value, entry.std) for entry in found] == orders


def test_an_exact_order_meets_exact_parts_alone():
    exact = ParameterEstimate(2.0, 0.0, '')
    assert {(part.part, part.harmonic) for part in parts_that_turn(
        exact, turning_parts(SCREW, 'revolute'))} == {('motor', 2)}


def test_without_a_law_nothing_is_added():
    diagnosis = unexplained()
    assert with_mechanism(diagnosis, CHOSEN) is diagnosis


def test_the_command_takes_a_mechanism_file():
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    given = parser.parse_args(['run', '--out', 'result', '--mechanism', 'mechanism.yaml'])
    assert given.mechanism == 'mechanism.yaml'


def test_a_mechanism_file_that_is_none_ends_in_one_line(tmp_path, capsys):
    (tmp_path / 'mechanism.yaml').write_text('gear_ratio: 4\n')
    assert main(['diagnose', str(tmp_path / 'run'), '--mechanism',
                 str(tmp_path / 'mechanism.yaml'), '--out', str(tmp_path / 'result')]) == 2
    error = capsys.readouterr().err
    assert 'screw_lead is missing' in error and error.count('\n') == 1
