# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Beside an effect a number is wrong by itself, or a refit around the effect has moved it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from scipy.optimize import least_squares

from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.numbers import moved_by_refit
from engb_core.diagnose.numbers.moved_by_refit import wrong_by_itself, wrong_by_themselves
from engb_core.diagnose.numbers.wrong_numbers import number_place, wrong_numbers
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.effects.catalogue import get_effect
from engb_core.model import Model
from engb_core.recording import Recording

from .simulated_brake import brake_with, NOMINAL, recorded, strokes_and_waves

INERTIA = replace(NOMINAL, motor=replace(NOMINAL.motor, inertia=1.4 * NOMINAL.motor.inertia))
NO_LOAD_FRICTION = replace(NOMINAL, friction=replace(NOMINAL.friction, load_gain=0.0))


@pytest.fixture(scope='module')
def recording() -> Recording:
    """A brake whose friction falls off with the speed."""
    way = strokes_and_waves(1)
    brake = brake_with('stribeck_friction', breakaway_ratio=1.5, stribeck_velocity=5.0)
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


def by_itself(fitter: Fitter, fit: Fit, effect: str) -> float:
    return wrong_by_itself(fitter, fit, number_place(fit.hypothesis.numbers, effect))


@pytest.mark.parametrize('moved', [('viscous_friction',), ('coulomb', 'viscous_friction')])
def test_what_a_refit_moved_is_no_wrong_number(recording, moved):
    """Whatever else the refit held: there are as many ways to refit as there are engineers."""
    file = refitted(recording, NOMINAL, moved)
    assert abs(file.motor.viscous_friction / NOMINAL.motor.viscous_friction - 1.0) > 0.01
    fitter, fit = with_the_effect(recording, file)
    assert by_itself(fitter, fit, 'viscous_friction_error') < 0.1
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
    assert by_itself(fitter, fit, 'load_dependent_friction') == 1.0


@pytest.mark.parametrize(('stand', 'likely'), [((), False), (('inertia', 'coulomb'), True)])
def test_numbers_that_stand_say_that_no_refit_moved_the_one_that_is_off(
        recording, monkeypatch, stand, likely):
    """To have moved this one alone, a refit would have had to hold all others."""
    fitter, fit = with_the_effect(recording, INERTIA)
    off = number_place(fit.hypothesis.numbers, 'viscous_friction_error')
    monkeypatch.setattr(moved_by_refit, 'wrong_by_itself',
                        lambda fitter, fit, place: 0.25 if place == off else 0.5)
    kept = {'viscous_friction': 0.0, **dict.fromkeys(stand, 1.0)}
    found = wrong_by_themselves(fitter, fit, kept)
    refit = 0.5 * (1.0 + 3.0) * 0.5 ** len(stand)
    assert found['viscous_friction'] == pytest.approx(
        (1.0 + refit / 4.0) / (1.0 + refit))
    assert (found['viscous_friction'] > 0.5) == likely
