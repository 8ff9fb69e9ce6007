# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A corrected model moves no number of the file farther than the recordings insist on."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.numbers.spike_and_slab import (
    machine_vector,
    predicting_vector,
    standing,
    with_averaged_numbers,
)
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square
from engb_core.diagnose.uncertainty import (
    noise_covariance,
    reported_covariance,
    reported_deviations,
    vector_deviations,
)
from engb_core.effects.catalogue import get_effect
from engb_core.model import Model

from .simulated_brake import brake_with, lively, NOMINAL


def fitted(model: Model) -> tuple[Fitter, Fit]:
    brake = brake_with('asymmetric_friction', asymmetry=0.3)
    fitter = Fitter(problem_of([lively(brake, seed=4)], model))
    variant = variants_of(get_effect('asymmetric_friction'), fitter.problem.scene)[0]
    return fitter, fitter.finish(fitter.refine(fitter.fit(variant, keep=2)))


def probabilities(fitter: Fitter, fit: Fit, **options) -> dict[str, float]:
    """Return how likely each number is as the file has it."""
    return dict(zip((number.name for number in fit.hypothesis.numbers),
                    standing(fitter, fit, **options), strict=True))


def test_right_numbers_stay_and_the_wrong_one_is_changed():
    true = NOMINAL.motor.viscous_friction
    wrong = replace(NOMINAL, motor=replace(NOMINAL.motor, viscous_friction=1.6 * true))
    fitter, fit = fitted(wrong)
    kept = probabilities(fitter, fit)
    assert kept['inertia'] > 0.5
    assert kept['viscous_friction'] < 0.1
    told = with_averaged_numbers(fitter, fit)
    model = told.hypothesis.corrected(told.vector)

    def off(inertia: float) -> float:
        return abs(inertia / wrong.motor.inertia - 1.0)

    refit = fit.hypothesis.corrected(fit.vector)
    assert off(model.motor.inertia) < 0.5 * off(refit.motor.inertia)
    assert model.motor.viscous_friction == pytest.approx(true, rel=0.1)
    effect = next(entry for entry in model.effects if entry.effect == 'asymmetric_friction')
    assert effect.parameters['asymmetry'] == pytest.approx(0.3, rel=0.1)


def test_a_number_far_off_is_not_kept_however_many_others_are():
    far = replace(NOMINAL, motor=replace(NOMINAL.motor, inertia=1.5 * NOMINAL.motor.inertia))
    fitter, fit = fitted(far)
    assert probabilities(fitter, fit)['inertia'] < 1e-3


def test_what_is_said_to_be_wrong_does_not_stand():
    fitter, fit = fitted(NOMINAL)
    assert probabilities(fitter, fit)['inertia'] > 0.5
    free = standing(fitter, fit, free=('inertia',))
    place = [number.name for number in fit.hypothesis.numbers].index('inertia')
    assert free[place] == 0.0
    assert np.all(free <= 1.0 + 1e-12)


def test_no_file_says_how_far_effort_and_position_are_apart():
    fitter, fit = fitted(NOMINAL)
    assert probabilities(fitter, fit)['sampling_delay'] == 0.0


def test_a_number_stands_that_is_off_by_what_another_formula_beside_it_would_do():
    brake = brake_with('nonlinear_viscous_friction', quadratic_viscous_friction=3e-5)
    fitter = Fitter(problem_of([lively(brake, seed=4)], NOMINAL))
    variant = variants_of(get_effect('nonlinear_viscous_friction'), fitter.problem.scene)[0]
    fit = fitter.finish(fitter.refine(fitter.fit(variant, keep=2)))
    place = [number.name for number in fit.hypothesis.numbers].index('viscous_friction')
    known = vector_deviations(fit, fitter)[place]
    by_formula = np.sqrt(reported_deviations(fit, fitter)[place] ** 2 - known ** 2)
    assert by_formula > 5.0 * known
    # With what goes along with it.
    along = reported_covariance(fit, fitter)[:, place]
    off = fit.vector + by_formula * along / along[place]
    count = len(fit.hypothesis.numbers)
    off[:count] += fit.hypothesis.start_of_numbers() - fit.vector[:count]
    assert probabilities(fitter, replace(fit, vector=off))['viscous_friction'] > 0.5


def test_numbers_that_the_recordings_hardly_tell_do_not_change_the_effect():
    """Of numbers that make up for each other in part, the mean is no nearer to any one choice."""
    fitter, fit = fitted(NOMINAL)
    told = with_averaged_numbers(fitter, fit)
    assert told.jacobian is not None
    sizes = [entry.hypothesis.named(entry.vector, 0)['asymmetry'] for entry in (told, fit)]
    assert sizes[0] == pytest.approx(0.3, rel=0.05)
    assert abs(sizes[0] - 0.3) < abs(sizes[1] - 0.3) + 0.01


def test_deviations_are_those_of_the_covariance():
    """Noise, discrepancy and other formulas of an effect move several numbers at once: the
    covariance has all of them, as the deviations that are told have."""
    fitter, fit = fitted(NOMINAL)
    covariance = reported_covariance(fit, fitter)
    # The covariance of effects' parameters that the data hardly tell has their bounds as well.
    numbers = len(fit.hypothesis.numbers)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance))[:numbers],
                               reported_deviations(fit, fitter)[:numbers], rtol=1e-3)
    assert np.linalg.eigvalsh(covariance).min() > -1e-9 * np.diag(covariance).max()
    # Noise leaves less of a number open, and the numbers that predict are asked of noise alone.
    np.testing.assert_allclose(np.sqrt(np.diag(noise_covariance(fit, fitter)))[:numbers],
                               vector_deviations(fit, fitter, by_noise_alone=True)[:numbers],
                               rtol=1e-3)
    away = [np.abs(vector - fit.vector)[:numbers] / np.abs(
        fit.hypothesis.start_of_numbers() - fit.vector[:numbers])
        for vector in (predicting_vector(fitter, fit), machine_vector(fitter, fit))]
    assert away[0].mean() < away[1].mean()


@pytest.mark.parametrize(('effect', 'name', 'value'), [
    ('coulomb_friction_error', 'coulomb', 0.02),
    ('viscous_friction_error', 'viscous_friction', 0.002), ('inertia_error', 'inertia', 9e-5)])
def test_the_one_number_that_is_off_is_named_however_much_the_file_misses(effect, name, value):
    """What the file misses by one number is far more than what that number held would cost, since
    the others make up for most of it: but they stand as they are."""
    found = diagnose([lively(brake_with(effect, **{name: value}), seed=4)], NOMINAL)
    assert [entry.effect for entry in found.effects] == [effect]
    assert found.effects[0].probability > 0.9
    assert found.effects[0].parameters[name].value == pytest.approx(value, rel=0.05)


def test_a_mean_goes_no_farther_than_derivatives_tell():
    """In a file that was refitted around an asymmetry that grows with speed, its constant load
    passes for half of it; as seen from the fit, growth and size can make up for that load, but
    only as far as a product of both is linear."""
    brake = brake_with('asymmetric_friction', asymmetry=0.7, growth=0.4, mean_speed=10.0)
    recording = lively(brake, seed=4)
    refit = Fitter(problem_of([recording], NOMINAL)).base()
    fitter = Fitter(problem_of([recording], refit.hypothesis.corrected(refit.vector)))
    variant = variants_of(get_effect('asymmetric_friction'), fitter.problem.scene)[0]
    fit = fitter.finish(fitter.refine(fitter.fit(variant, keep=2)))
    mean = with_averaged_numbers(fitter, fit)
    before, after = (reduced_chi_square(entry, fitter) for entry in (fit, mean))
    assert after < 1.5 * before
