# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A file with several wrong numbers, whose others stand: each of them is told, and no other."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.nominal import CURVATURE, DELAY, LOAD_NUMBERS, with_numbers
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of

from .simulated_brake import lively, NOMINAL

pytestmark = pytest.mark.slow

# What each wrong number is called.
NAMES = {'coulomb': 'coulomb_friction_error', 'viscous': 'viscous_friction_error',
         'inertia': 'inertia_error', 'load_gain': 'load_dependent_friction',
         'load': 'load_stiffness_error'}


@cache
def recording():
    return lively(NOMINAL)


def file_with(*wrong):
    """Return the true brake's model file with some numbers wrong by 30 to 100 %."""
    friction, motor, load = NOMINAL.friction, NOMINAL.motor, NOMINAL.load_torque
    if 'coulomb' in wrong:
        friction = replace(friction, coulomb=0.6 * friction.coulomb)
    if 'load_gain' in wrong:
        friction = replace(friction, load_gain=0.5 * friction.load_gain)
    if 'viscous' in wrong:
        motor = replace(motor, viscous_friction=0.0)
    if 'inertia' in wrong:
        motor = replace(motor, inertia=0.7 * motor.inertia)
    if 'load' in wrong:
        load = replace(load, coefficients=tuple(0.7 * entry for entry in load.coefficients))
    return replace(NOMINAL, friction=friction, motor=motor, load_torque=load)


@pytest.mark.parametrize('wrong', [
    ('coulomb', 'viscous'), ('load_gain', 'load'), ('coulomb', 'inertia', 'load_gain'),
    ('inertia', 'load_gain', 'load')], ids='+'.join)
def test_each_wrong_number_is_told(wrong):
    said = diagnose([recording()], file_with(*wrong))
    assert {finding.effect for finding in said.effects if finding.probability >= 0.5} \
        == {NAMES[entry] for entry in wrong}
    # In this brake the load is the largest torque, and most of the mismatch where it is wrong.
    assert 'load' not in wrong or said.effects[0].effect == NAMES['load']
    assert sum(finding.share for finding in said.effects) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize('wrong', ['coulomb', 'viscous'])
def test_a_load_curve_that_is_nearly_right_hides_no_wrong_number(wrong):
    """No file is exact: what is off by 1 % and matters little is not what has to be told."""
    file = file_with(wrong)
    load = file.load_torque
    nearly = replace(load, coefficients=tuple(1.01 * entry for entry in load.coefficients))
    said = diagnose([recording()], replace(file, load_torque=nearly))
    assert [finding.effect for finding in said.effects] == [NAMES[wrong]]
    assert said.effects[0].probability >= 0.7


def test_a_number_that_stands_is_not_told_beside_one_that_is_off():
    """Coulomb friction and how friction turns with the direction make up for each other: what that
    moves says nothing that the file's others would have to be told for."""
    said = diagnose([recording()], file_with('viscous', 'inertia'))
    assert 'coulomb_friction_error' not in {finding.effect for finding in said.effects}


def refitted(file):
    """Return a file refitted on the recording with its load curve held."""
    fitter = Fitter(problem_of([recording()], file))
    fit = fitter.refine(fitter.base(tuple(
        number for number in fitter.numbers
        if number.name not in {*LOAD_NUMBERS, CURVATURE, DELAY})))
    return with_numbers(file, {
        number.name: float(np.exp(value) if number.logarithmic else value)
        for number, value in zip(fit.hypothesis.numbers, fit.vector, strict=True)})


def test_numbers_that_a_refit_moved_to_make_up_for_the_load_are_not_told():
    said = diagnose([recording()], refitted(file_with('load')))
    assert [finding.effect for finding in said.effects] == ['load_stiffness_error']
