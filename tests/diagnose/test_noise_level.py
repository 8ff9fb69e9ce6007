# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A level of noise that is too high hides nothing: what an effect predicts is no noise."""

import numpy as np
import pytest

from engb_core.diagnose import problem as problems
from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.noise_level import predicted_of_noise
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of, with_less_noise
from engb_core.diagnose.search.every_effect import search

from .simulated_brake import brake_with, lively, NOMINAL

BRAKE = brake_with('asymmetric_friction', asymmetry=0.5)
TOO_MUCH = 400.0     # of the mean square


@pytest.fixture(scope='module')
def recording():
    return lively(BRAKE)


def test_what_is_left_of_a_noise_that_is_too_high_is_told(recording):
    noisy = with_less_noise(problem_of([recording], NOMINAL), TOO_MUCH)
    part = predicted_of_noise(search(Fitter(noisy)))
    assert part is not None
    assert 0.3 / TOO_MUCH < part < 3.0 / TOO_MUCH


def test_noise_is_not_predicted():
    assert predicted_of_noise(search(Fitter(problem_of([lively(NOMINAL)], NOMINAL)))) is None


def test_counts_and_timing_stay(recording):
    problem = problem_of([recording], NOMINAL)
    (run,), (less,) = problem.runs, with_less_noise(problem, 0.01).runs
    assert np.all(less.noise >= run.counts)
    assert np.all(less.noise < run.noise)
    np.testing.assert_allclose(less.sigma ** 2 - less.noise ** 2, run.sigma ** 2 - run.noise ** 2,
                               atol=1e-12)


def test_physics_behind_a_noise_that_is_too_high_is_named(recording, monkeypatch):
    told = problems._noise_of_effort
    monkeypatch.setattr(problems, '_noise_of_effort',
                        lambda *given: np.sqrt(TOO_MUCH) * told(*given))
    found = diagnose([recording], NOMINAL)
    assert found.effects[0].effect == 'asymmetric_friction'
    (held_out,) = [entry for entry in found.held_out if entry.quantity == 'effort']
    assert held_out.rms_after < 2.0 * held_out.noise_floor < held_out.rms_before
