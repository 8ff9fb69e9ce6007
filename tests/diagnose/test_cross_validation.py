# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a hypothesis leaves of stretches that it was not fitted to."""

from copy import copy

import numpy as np
import pytest

from engb_core.diagnose.cross_validation import (
    carries_over,
    left_out_chi_square,
    odds_of_less,
    stretches,
    time_folds,
    without_each_fold,
)
from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.probability import own_part_left, part_left
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.reduced_chi_square import reduced_chi_square
from engb_core.effects.catalogue import get_effect

from .simulated_brake import brake_with, lively, NOMINAL


@pytest.fixture(scope='module')
def fitter() -> Fitter:
    return Fitter(problem_of([lively(brake_with('asymmetric_friction', asymmetry=0.4))], NOMINAL))


def fitted(fitter: Fitter, effect: str) -> Fit:
    fits = [fitter.refine(fitter.fit(variant, rounds=8))
            for variant in variants_of(get_effect(effect), fitter.problem.scene)]
    return min(fits, key=lambda fit: fit.cost)


def test_each_value_is_left_out_once(fitter):
    found = list(without_each_fold(fitter, fitter.base()))
    assert np.array_equal(sum(rows.astype(int) for rows, _ in found), np.ones(fitter.sigma.size))
    first, as_it_is = found[0]
    assert np.array_equal(first, ~fitter.fitted)
    assert as_it_is.vector == pytest.approx(fitter.base().vector)


@pytest.mark.parametrize('effect', [None, 'asymmetric_friction'])
def test_a_fold_is_predicted_as_by_a_fit_to_all_others(fitter, effect):
    fit = fitter.refine(fitter.base()) if effect is None else fitted(fitter, effect)
    for rows, without in list(without_each_fold(fitter, fit))[1:]:
        part = copy(fitter)
        part.fitted = fitter.fitted & ~rows
        again = part.refine(part.evaluate(fit.hypothesis, fit.vector), 12)
        moved = float(np.std((again.predicted - fit.predicted)[rows]))
        missed = float(np.std((again.predicted - without.predicted)[rows]))
        assert missed < 0.3 * moved + 0.02 * float(np.std(fit.residual[rows]))


def test_what_is_fitted_leaves_more_of_what_it_was_not_fitted_to(fitter):
    for fit in (fitter.base(), fitted(fitter, 'stribeck_friction')):
        assert left_out_chi_square(fitter, fit) > reduced_chi_square(fit, fitter)


def test_the_cause_carries_over_and_leaves_nothing(fitter):
    base, right = fitter.base(), fitted(fitter, 'asymmetric_friction')
    assert carries_over(fitter, base, right)
    assert part_left(fitter, base, right) == 0.0
    assert own_part_left(fitter, right, 0) < 0.1


def test_what_is_not_there_does_not_carry_over(fitter):
    right = fitted(fitter, 'asymmetric_friction')
    assert not carries_over(fitter, right, right)
    assert not carries_over(fitter, fitter.base(), fitter.base())
    assert part_left(fitter, fitter.base(), fitter.base()) > 0.8


def test_folds_are_made_of_stretches(fitter):
    stretch, fold = stretches(fitter), time_folds(fitter)
    assert np.all(np.diff(stretch) >= 0) and stretch[-1] >= 5
    assert all(np.unique(fold[stretch == one]).size == 1 for one in np.unique(stretch))


SHARE = np.full(20, 0.05)


def test_equal_models_are_even_and_a_better_one_is_no_surer_than_that():
    assert odds_of_less(SHARE, SHARE, SHARE, 0.1) == 1.0
    assert odds_of_less(0.5 * SHARE, SHARE, SHARE, 0.1) == 1.0


def test_a_model_that_leaves_more_of_every_stretch_is_surely_the_worse():
    more = SHARE * np.linspace(1.8, 2.2, 20)
    assert odds_of_less(more, SHARE, SHARE, 0.1) < 1e-6


def test_a_model_that_leaves_more_of_one_stretch_may_be_as_good():
    more = SHARE.copy()
    more[3] += 1.0
    assert 0.1 < odds_of_less(more, SHARE, SHARE, 0.1) < 0.4


def test_below_the_floor_models_are_told_apart_no_further():
    less, more = 1e-3 * SHARE, SHARE * np.linspace(0.0, 0.04, 20)
    assert odds_of_less(more, less, SHARE, 10.0) > odds_of_less(more, less, SHARE, 1e-3)


def test_where_nothing_scatters_the_larger_one_is_the_worse():
    assert odds_of_less(2.0 * SHARE, SHARE, SHARE, 0.1) == 0.0
    assert odds_of_less(np.array([2.0]), np.array([1.0]), np.array([1.0]), 0.1) == 1.0
