# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A corrected model changes no number of the file that may stand as it is."""

from dataclasses import replace

import pytest

from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.spike_and_slab import kept_numbers, with_kept_numbers
from engb_core.effects.catalogue import get_effect
from engb_core.model import Model

from .simulated_brake import brake_with, lively, NOMINAL


def fitted(model: Model) -> tuple[Fitter, Fit]:
    brake = brake_with('asymmetric_friction', asymmetry=0.3)
    fitter = Fitter(problem_of([lively(brake, seed=4)], model))
    variant = variants_of(get_effect('asymmetric_friction'), fitter.problem.scene)[0]
    return fitter, fitter.finish(fitter.refine(fitter.fit(variant, keep=2)))


def names(fit: Fit, places: list[int]) -> set[str]:
    return {fit.hypothesis.numbers[place].name for place in places}


def test_right_numbers_stay_and_the_wrong_one_is_changed():
    true = NOMINAL.motor.viscous_friction
    wrong = replace(NOMINAL, motor=replace(NOMINAL.motor, viscous_friction=1.6 * true))
    fitter, fit = fitted(wrong)
    kept = names(fit, kept_numbers(fitter, fit))
    assert 'inertia' in kept
    assert 'viscous_friction' not in kept
    model = with_kept_numbers(fitter, fit).hypothesis.corrected(
        with_kept_numbers(fitter, fit).vector)
    assert model.motor.inertia == wrong.motor.inertia
    assert model.motor.viscous_friction == pytest.approx(true, rel=0.1)
    effect = next(entry for entry in model.effects if entry.effect == 'asymmetric_friction')
    assert effect.parameters['asymmetry'] == pytest.approx(0.3, rel=0.1)


def test_a_number_far_off_is_not_kept_however_many_others_are():
    far = replace(NOMINAL, motor=replace(NOMINAL.motor, inertia=1.5 * NOMINAL.motor.inertia))
    fitter, fit = fitted(far)
    assert 'inertia' not in names(fit, kept_numbers(fitter, fit))


def test_what_the_recordings_hardly_tell_changes_nothing_else():
    fitter, fit = fitted(NOMINAL)
    kept = with_kept_numbers(fitter, fit)
    assert kept.jacobian is not None
    free = len(kept.hypothesis.numbers)
    assert free < len(fit.hypothesis.numbers)
    sizes = [entry.hypothesis.named(entry.vector, 0)['asymmetry'] for entry in (kept, fit)]
    assert sizes[0] == pytest.approx(sizes[1], rel=0.2)
