# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How surely one model leaves less than another."""

import numpy as np

from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.score.stretch_odds import odds_of_less, STRETCH, stretches

from .simulated_brake import lively, NOMINAL


def test_stretches_are_counted_through_all_recordings():
    fitter = Fitter(problem_of([lively(NOMINAL, seed=1), lively(NOMINAL, seed=2)], NOMINAL))
    stretch = stretches(fitter)
    first = fitter.problem.runs[0]
    assert np.all(np.diff(stretch) >= 0)
    assert stretch[first.measured.size] == stretch[first.measured.size - 1] + 1
    time = first.motion.time[first.comparison.grid]
    assert np.ptp(time[stretch[:time.size] == 2]) <= STRETCH


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
