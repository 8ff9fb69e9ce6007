# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A file with several wrong numbers, whose others stand: each of them is told, and no other."""

from dataclasses import replace
from functools import cache

import pytest

from engb_core.diagnose.engine import diagnose

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
    ('coulomb', 'viscous'), ('viscous', 'inertia'), ('load_gain', 'load'),
    ('coulomb', 'viscous', 'inertia'), ('coulomb', 'inertia', 'load_gain'),
    ('inertia', 'load_gain', 'load')], ids='+'.join)
def test_each_wrong_number_is_told(wrong):
    said = diagnose([recording()], file_with(*wrong))
    assert {finding.effect for finding in said.effects if finding.probability >= 0.5} \
        == {NAMES[entry] for entry in wrong}
    # Most of the mismatch is the load's where that is wrong: in this brake it is the largest torque.
    assert 'load' not in wrong or said.effects[0].effect == NAMES['load']
    assert sum(finding.share for finding in said.effects) == pytest.approx(1.0, abs=0.05)


def test_a_number_that_stands_is_not_told_beside_one_that_is_off():
    """Coulomb friction and how friction turns with the direction make up for each other: what that
    moves says nothing that the file's others would have to be told for."""
    said = diagnose([recording()], file_with('viscous', 'inertia'))
    assert 'coulomb_friction_error' not in {finding.effect for finding in said.effects}
