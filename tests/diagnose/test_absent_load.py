# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A model file without a load curve, on a machine that has a load: told as that."""

import dataclasses

import numpy as np
import pytest

from engb_core.diagnose.absent_load import absent_load
from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.unknown.openset import Explanation
from engb_core.effects.catalogue import get_effect
from engb_core.model import Friction, LoadTorque, Model, Motor
from engb_core.recording import Recording

MODEL = Model(Motor(0.0174, 6.8e-5, 1.1e-3), LoadTorque(), Friction(0.012, 0.0, 0.5))
TIME = np.arange(8000) / 1000.0
POSITION = 10.0 - 14.0 * np.cos(2 * np.pi * 0.37 * TIME) + np.sin(2 * np.pi * 1.7 * TIME)
VELOCITY = np.gradient(POSITION, TIME)


def contact():
    """A pad that is pressed from 5 rad on."""
    return np.polyval([2e-4, 1e-3, 0.0], np.maximum(POSITION - 5.0, 0.0))


def recording(load, friction=0.012, gain=0.0):
    """MODEL's motor, this load (n,) and friction, and noise."""
    level = (friction + gain * load) * np.clip(VELOCITY / 0.5, -1.0, 1.0)
    effort = 6.8e-5 * np.gradient(VELOCITY, TIME) + 1.1e-3 * VELOCITY + load + level
    noise = 1e-3 * np.random.default_rng(4).standard_normal(TIME.size)
    return Recording('run', TIME, POSITION, effort + noise)


def absent(run, model=MODEL):
    fitter = Fitter(problem_of([run], model), 1)
    return absent_load(fitter, fitter.nominal())


@pytest.mark.parametrize('load', [contact(), 0.02 + 2e-3 * POSITION, 0.03 * np.sin(POSITION)],
                         ids=['contact', 'spring', 'gravity'])
def test_a_load_that_is_missing_is_seen(load):
    found = absent(recording(load, gain=0.1))
    assert found is not None and found.share > 0.5
    again = found.model.load_torque
    assert again.amplitude > 0.02 or np.ptp(again.coefficients) > 0.0


@pytest.mark.parametrize('run', [
    recording(0.0 * TIME), recording(0.0 * TIME, 0.03), recording(0.01 + 0.0 * TIME),
    recording(0.01 * np.sign(VELOCITY)), recording(0.004 * np.sin(7.0 * POSITION)),
    recording(1e-5 * VELOCITY * np.abs(VELOCITY))],
    ids=['nothing', 'friction', 'offset', 'asymmetry', 'cogging', 'drag'])
def test_what_is_no_load_is_none(run):
    assert absent(run) is None


def test_a_wrong_load_is_not_a_missing_one():
    model = dataclasses.replace(MODEL, load_torque=LoadTorque(
        coefficients=(0.0, 1e-4), contact_angle=5.0))
    assert absent(recording(contact()), model) is None


@pytest.mark.slow
def test_it_is_told_and_nothing_else_is_named():
    diagnosis = diagnose([recording(contact(), gain=0.1)], MODEL)
    assert diagnosis.verdict == 'unexplained'
    assert diagnosis.effects == ()
    assert 'no load torque' in diagnosis.unexplained.statement
    assert 'Identify it first' in diagnosis.unexplained.statement
    assert diagnosis.unexplained.depends_on == ('position',)
    effort = next(entry for entry in diagnosis.held_out if entry.quantity == 'effort')
    assert effort.rms_after < 0.3 * effort.rms_before


@pytest.mark.slow
def test_gravity_is_a_load_and_no_cogging():
    """A wave of one period per revolution explains it as well, with more values."""
    diagnosis = diagnose([recording(0.03 * np.sin(POSITION))], MODEL)
    assert diagnosis.effects == ()
    assert 'no load torque' in diagnosis.unexplained.statement


@pytest.mark.slow
def test_cogging_is_no_load():
    diagnosis = diagnose([recording(0.01 * np.sin(7.0 * POSITION))], MODEL)
    assert [finding.effect for finding in diagnosis.effects] == ['cogging_torque']


def test_physics_with_a_name_is_not_given_up_for_a_load_that_explains_less():
    """A ball screw that drags more one way than the other, described further by a table."""
    fitter = Fitter(problem_of([recording(contact(), gain=0.1)], MODEL), 1)
    found = absent_load(fitter, fitter.nominal())
    variant = variants_of(get_effect('asymmetric_friction'), fitter.problem.scene)[0]
    named = fitter.fit(variant)
    described = Explanation(named, object())
    assert found.is_plainer(fitter, described)
    better = dataclasses.replace(named, residual=np.zeros(named.residual.size))
    assert not found.is_plainer(fitter, dataclasses.replace(described, fit=better))
    assert found.is_plainer(fitter, dataclasses.replace(described, fit=fitter.base()))
