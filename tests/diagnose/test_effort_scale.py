# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Inertia and load off by one factor: the scale of effort, one cause."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.effort_scale import Factors, with_effort_scale
from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.selection import Selection
from engb_core.effects.catalogue import get_effect
from engb_core.model import Friction, LoadTorque, Model, Motor
from engb_core.recording import Recording

# A pendulum as its masses and lengths say.
MODEL = Model(Motor(0.09, 0.15, 0.03), LoadTorque('sinusoid', amplitude=3.0),
              Friction(0.1, 0.0, 0.1))
TIME = np.arange(6000) / 500.0
POSITION = 1.5 * np.sin(2 * np.pi * 0.4 * TIME) + 0.5 * np.sin(2 * np.pi * 1.3 * TIME)
VELOCITY = np.gradient(POSITION, TIME)


def recording(inertia=1.0, load=1.0, friction=1.0):
    """Return MODEL's motion with these factors on its torques, as effort tells them."""
    effort = (0.15 * inertia * np.gradient(VELOCITY, TIME) + 3.0 * load * np.sin(POSITION)
              + friction * (0.03 * VELOCITY + 0.1 * np.clip(VELOCITY / 0.1, -1.0, 1.0)))
    noise = 0.05 * np.random.default_rng(7).standard_normal(TIME.size)
    return Recording('run', TIME, POSITION, effort + noise)


def chosen(run, model=MODEL, effect=None):
    fitter = Fitter(problem_of([run], model), 1)
    fit = fitter.base() if effect is None else fitter.refine(fitter.fit(
        variants_of(get_effect(effect), fitter.problem.scene)[0]))
    return with_effort_scale(fitter, Selection(
        fit, (), 1.0, 0.0, 0.0, further=(('cogging_torque', 0.3),)))


def test_one_factor_on_inertia_and_load_is_one_cause():
    selection = chosen(recording(1.25, 1.25, 1.25))
    assert selection.chosen.hypothesis.ids == ('effort_scale_error',)
    assert selection.chosen.hypothesis.named(
        selection.chosen.vector, 0)['scale'] == pytest.approx(0.8, abs=0.01)
    probability, rival = selection.believed['effort_scale_error']
    assert 0.9 < probability < 1.0
    assert rival == 'load_stiffness_error'
    # That was asked beside other effects.
    assert selection.further == ()


@pytest.mark.parametrize('factors', [(1.25, 1.0), (1.0, 1.25), (1.25, 1.5), (0.8, 1.25),
                                     (1.0, 1.0)])
def test_two_factors_or_none_are_not(factors):
    selection = chosen(recording(*factors))
    assert selection.chosen.hypothesis.ids == ()
    assert selection.believed == {}


def test_torque_that_is_lost_from_the_smallest_efforts_on_is_a_scale():
    """Saturation with a straight line from nought on is the same, with two numbers more."""
    run = recording(1.25, 1.25, 1.25)
    assert chosen(run, effect='torque_saturation').chosen.hypothesis.ids == ('effort_scale_error',)


def test_saturation_that_bends_is_none():
    run = recording()
    largest = float(np.abs(run.effort).max())
    effort = run.effort * (1.0 + 0.3 * (run.effort / largest) ** 2)
    found = chosen(replace(run, effort=effort), effect='torque_saturation')
    assert found.chosen.hypothesis.ids == ('torque_saturation',)


def test_less_than_masses_and_lengths_are_sure_to_is_nothing():
    assert not Factors(0.005, 0.0005, 0.006, 0.0005).both_off_alike
    assert Factors(0.05, 0.0005, 0.06, 0.0005).both_off_alike


def test_two_numbers_that_are_each_off_by_little_are_never_far_apart():
    """That they agree says little then."""
    slightly, much = (Factors(size, 0.007, size + 0.015, 0.007).one_cause()
                      for size in (0.026, 0.3))
    assert slightly < 0.75
    assert much > 0.9


def test_whether_a_refit_moved_the_inertia_and_whether_it_agrees_with_the_load_is_one_question():
    """A refit around a wrong load moves the inertia anywhere: not just to where the load is."""
    agrees, another = (Factors(0.25, 0.007, load, 0.007, by_itself=0.3) for load in (0.25, 0.215))
    assert 0.5 < agrees.one_cause() < Factors(0.25, 0.007, 0.25, 0.007).one_cause()
    assert another.one_cause() < 0.5
    assert Factors(0.25, 0.007, 0.25, 0.007, by_itself=0.04).one_cause() < 0.5


def test_a_file_that_was_refitted_says_nothing_of_masses_and_lengths():
    model = replace(MODEL, motor=replace(MODEL.motor, inertia=0.15 * 1.25),
                    load_torque=replace(MODEL.load_torque, amplitude=3.0 * 1.25))
    assert chosen(recording(1.25, 1.25, 1.0), model).believed == {}


@pytest.mark.slow
def test_it_is_told_and_nothing_else():
    found = diagnose([recording(1.25, 1.25, 1.25)], MODEL)
    told = {entry.effect: entry for entry in found.effects if entry.probability >= 0.5}
    assert set(told) == {'effort_scale_error'}
    scale = told['effort_scale_error']
    assert scale.parameters['scale'].value == pytest.approx(0.8, abs=0.01)
    assert [effect for effect, _ in scale.alternatives] == ['load_stiffness_error']
    assert found.model.motor.inertia == 0.15
    effort = next(entry for entry in found.held_out if entry.quantity == 'effort')
    assert effort.rms_after < 0.2 * effort.rms_before


FREE = replace(MODEL, load_torque=LoadTorque())


@pytest.mark.parametrize('factor', [1.25, 0.8])
def test_without_load_friction_tells_what_the_load_would(factor):
    selection = chosen(recording(factor, 0.0, factor), FREE)
    assert selection.chosen.hypothesis.ids == ('effort_scale_error',)
    assert selection.chosen.hypothesis.named(
        selection.chosen.vector, 0)['scale'] == pytest.approx(1.0 / factor, abs=0.01)
    probability, rival = selection.believed['effort_scale_error']
    assert 0.6 < probability < 0.9
    assert rival == 'inertia_error'


@pytest.mark.parametrize('factors', [(1.25, 1.0), (1.0, 1.25), (1.25, 1.7), (0.8, 1.25), (1, 1)])
def test_without_load_two_factors_or_none_are_not(factors):
    assert chosen(recording(factors[0], 0.0, factors[1]), FREE).believed == {}
