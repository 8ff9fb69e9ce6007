# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Beside an effect a number is wrong by itself, or a refit around the effect has moved it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.numbers import load_friction
from engb_core.diagnose.numbers.held_load_curve import numbers_without_load
from engb_core.diagnose.numbers.moved_by_refit import posterior
from engb_core.diagnose.numbers.wrong_numbers import refit_of_file, wrong_numbers
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.effects.catalogue import get_effect
from engb_core.model import LoadTorque, Model
from engb_core.recording import Recording

from .simulated_brake import brake_with, NOMINAL, recorded, strokes_and_waves

INERTIA = replace(NOMINAL, motor=replace(NOMINAL.motor, inertia=1.4 * NOMINAL.motor.inertia))
LITTLE_LOAD_FRICTION = replace(NOMINAL, friction=replace(NOMINAL.friction, load_gain=0.05))
NO_LOAD_FRICTION = replace(NOMINAL, friction=replace(NOMINAL.friction, load_gain=0.0))


@pytest.fixture(scope='module')
def recording() -> Recording:
    """A brake whose friction falls off with the speed."""
    return with_breakaway(1.5)


@pytest.fixture(scope='module')
def less() -> Recording:
    """A brake whose friction rises with the speed."""
    return with_breakaway(0.6)


def with_breakaway(ratio: float) -> Recording:
    way = strokes_and_waves(1)
    brake = brake_with('stribeck_friction', breakaway_ratio=ratio, stribeck_velocity=5.0)
    return recorded(brake, lambda time, _: way.at(time), way.duration, seed=2, noise=0.002)


def refitted(recording: Recording, model: Model, moved: tuple[str, ...]) -> Model:
    """Return the file with these numbers at the minimum of what it misses, in plain torque."""
    fitter = Fitter(problem_of([recording], model))
    hypothesis = fitter.hypothesis((), tuple(
        number for number in fitter.numbers if number.name in moved))
    vector = least_squares(lambda vector: fitter.predict(hypothesis, vector) - fitter.measured,
                           hypothesis.start_of_numbers(), x_scale='jac').x
    return replace(hypothesis.corrected(vector), effects=())


def with_the_effect(recording: Recording, file: Model) -> tuple[Fitter, Fit]:
    fitter = Fitter(problem_of([recording], file))
    variant = variants_of(get_effect('stribeck_friction'), fitter.problem.scene)[0]
    return fitter, fitter.finish(fitter.refine(fitter.fit(variant)))


@pytest.mark.parametrize('moved', [('viscous_friction',), ('coulomb', 'viscous_friction')])
def test_what_a_refit_moved_is_no_wrong_number(recording, moved):
    """Whatever else the refit held: there are as many ways to refit as there are engineers."""
    file = refitted(recording, NOMINAL, moved)
    assert abs(file.motor.viscous_friction / NOMINAL.motor.viscous_friction - 1.0) > 0.01
    fitter, fit = with_the_effect(recording, file)
    refit = refit_of_file(fitter, fit)
    assert refit.by_itself['viscous_friction'] < 0.2
    assert refit.probability > 0.8
    assert wrong_numbers(fitter, fit) == []


def test_a_wrong_number_beside_an_effect_is_wrong_by_itself(recording):
    fitter, fit = with_the_effect(recording, INERTIA)
    finding, = wrong_numbers(fitter, fit)
    assert finding.effect == 'inertia_error'
    assert finding.moved > 0.95


def test_a_wrong_number_that_a_refit_held_is_told_from_those_that_it_moved(recording):
    fitter, fit = with_the_effect(
        recording, refitted(recording, INERTIA, ('coulomb', 'viscous_friction')))
    finding, = wrong_numbers(fitter, fit)
    assert finding.effect == 'inertia_error'
    assert finding.moved > 0.9


def test_what_the_file_does_not_have_no_refit_has_moved(recording):
    file = refitted(recording, NO_LOAD_FRICTION, ('coulomb', 'viscous_friction'))
    fitter, fit = with_the_effect(recording, file)
    assert refit_of_file(fitter, fit).by_itself['load_gain'] == 1.0


def test_a_number_that_others_made_up_for_is_told_from_those_that_moved_with_it(recording):
    """A gain that a refit held, and Coulomb friction, which it moved to make up for it, act much
    alike: along each of them alone the file seems to be at its minimum."""
    fitter, fit = with_the_effect(recording, refitted(
        recording, LITTLE_LOAD_FRICTION, ('coulomb', 'viscous_friction', 'inertia')))
    refit = refit_of_file(fitter, fit)
    assert refit.by_itself['load_gain'] > 0.9
    assert refit.by_itself['coulomb'] < 0.5


@pytest.mark.parametrize(('moved', 'found'), [
    (('load_gain', 'coulomb', 'viscous_friction'), False),
    (('coulomb', 'viscous_friction'), True)])
def test_load_friction_is_missing_where_no_refit_moved_it(less, monkeypatch, moved, found):
    """That other recordings ask for more of it says nothing of how the file came to have less."""
    monkeypatch.setattr(load_friction, 'better_on_others', lambda *fits: True)
    monkeypatch.setattr(load_friction, 'LEAST_RECORDINGS', 1)
    file = LITTLE_LOAD_FRICTION if found else NOMINAL
    file = refitted(less, file, moved)
    fitter, fit = with_the_effect(less, file)
    assert file.friction.load_gain < NOMINAL.friction.load_gain
    missing = load_friction.missing_load_friction(fitter, fit)
    assert (missing is not None) == found
    if missing is not None:
        gain, = (value for number, value in zip(missing.fit.hypothesis.numbers, missing.fit.vector,
                                                strict=False) if number.name == 'load_gain')
        assert gain == pytest.approx(NOMINAL.friction.load_gain, rel=0.1)
        assert missing.moved > 0.8


def test_a_number_that_is_off_by_many_times_itself_is_off_by_itself(recording):
    low = replace(NOMINAL, motor=replace(
        NOMINAL.motor, viscous_friction=0.1 * NOMINAL.motor.viscous_friction))
    fitter, fit = with_the_effect(recording, low)
    refit = refit_of_file(fitter, fit)
    assert refit.by_itself['viscous_friction'] > 0.9
    assert refit.probability < 0.5


CREEPS = 'pad_creep'
SCALE = 'load_stiffness_error'


def with_creep(scale: float = 1.0) -> Recording:
    way = strokes_and_waves(1)
    brake = replace(brake_with(CREEPS, relaxed_fraction=0.2, time_constant=0.3),
                    load_torque=with_load(scale))
    return recorded(brake, lambda time, _: way.at(time), way.duration, seed=2, noise=0.002)


def with_load(scale: float) -> LoadTorque:
    """Return the nominal load curve, scaled as a whole."""
    load = NOMINAL.load_torque
    return replace(load, coefficients=tuple(scale * entry for entry in load.coefficients))


def with_the_load_scaled(recording: Recording) -> Model:
    """Return the file refitted with its load curve scaled as a whole, in plain torque."""
    fitter = Fitter(problem_of([recording], NOMINAL))
    variant, = variants_of(get_effect(SCALE), fitter.problem.scene)
    hypothesis = fitter.hypothesis((variant,), tuple(
        number for number in fitter.numbers if number.name in ('inertia', 'coulomb')))
    found = least_squares(lambda vector: fitter.predict(hypothesis, vector) - fitter.measured,
                          np.append(hypothesis.start_of_numbers(), 1.0), x_scale='jac').x
    return replace(hypothesis.corrected(found), load_torque=with_load(found[-1]), effects=())


@pytest.mark.parametrize('moved', [True, False])
def test_a_load_curve_that_a_refit_scaled_is_told_from_one_that_is_off(moved):
    recording = with_creep(scale=1.0 if moved else 1.04)
    file = with_the_load_scaled(recording) if moved else NOMINAL
    fitter = Fitter(problem_of([recording], file))
    fit = fitter.refit(fitter.base(), numbers_without_load(fitter))
    for effect in (CREEPS, SCALE):
        fit = fitter.refine(fitter.fit(
            variants_of(get_effect(effect), fitter.problem.scene)[0], fit), 20)
    by_itself = refit_of_file(fitter, fitter.finish(fit)).by_itself[SCALE]
    assert by_itself < 0.3 if moved else by_itself > 0.9


def test_of_numbers_alone_a_refit_held_one_at_least():
    found = posterior({SCALE: 0.0, 'contact_shift': 0.0},
                      lambda moved, groups: {SCALE: 20.0, 'contact_shift': 2.0}, (),
                      (SCALE, 'contact_shift'))
    assert found.by_itself['contact_shift'] > 0.5 > found.by_itself[SCALE]


@pytest.mark.parametrize(('stand', 'likely'), [((), False), (('inertia', 'coulomb'), True)])
def test_numbers_that_stand_say_that_no_refit_moved_the_one_that_is_off(stand, likely):
    """To have moved this one alone, a refit would have had to hold all others."""
    kept = {'viscous_friction': 0.0, **dict.fromkeys(stand, 1.0)}
    found = posterior(kept, lambda moved, groups: dict.fromkeys(moved, 3.0), ())
    refit = 0.5 * (1.0 + 3.0) * 0.5 ** len(stand)
    assert found.probability == pytest.approx(refit / (1.0 + refit))
    assert found.by_itself['viscous_friction'] == pytest.approx(
        (1.0 + refit / 4.0) / (1.0 + refit))
    assert (found.by_itself['viscous_friction'] > 0.5) == likely


def test_numbers_that_a_refit_moved_are_asked_for_together():
    """Neither is off by what the effects pull it alone, but both are by what they pull them."""
    found = posterior({'coulomb': 0.0, 'viscous_friction': 0.0},
                      lambda moved, groups: dict.fromkeys(
                          moved, 20.0 if len(moved) == 2 else 0.01), ())
    assert found.probability > 0.98
    assert all(value < 0.02 for value in found.by_itself.values())
