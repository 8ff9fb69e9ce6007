# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A remainder without colour holds nothing that a model could predict, though its level be off."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.score.noise_like import colour, is_noise
from engb_core.diagnose.unknown.openset import Explanation
from engb_core.diagnose.verdict import verdict_of

from .simulated_brake import lively, NOMINAL


@pytest.fixture(scope='module')
def fitter() -> Fitter:
    return Fitter(problem_of([lively(NOMINAL)], NOMINAL))


def left(fitter: Fitter, size: float, smooth: int = 1) -> Fit:
    """Return a fit that leaves noise of so many times the expected deviation, smoothed over so
    many values."""
    drawn = np.random.default_rng(7).normal(0.0, 1.0, fitter.sigma.size + smooth - 1)
    drawn = np.convolve(drawn, np.full(smooth, smooth ** -0.5), 'valid')
    return replace(fitter.nominal(), residual=size * drawn * fitter.sigma)


@pytest.mark.parametrize(('size', 'smooth', 'noise'), [
    (1.0, 1, True), (1.25, 1, True), (1.25, 6, False), (2.0, 1, False), (1.0, 6, True)])
def test_what_is_larger_than_the_noise_is_noise_where_it_has_no_colour(fitter, size, smooth,
                                                                       noise):
    assert is_noise(fitter, left(fitter, size, smooth)) == noise


def test_one_in_a_hundred_is_taken_for_coloured(fitter):
    random = np.random.default_rng(3)
    sure = [colour(fitter, replace(fitter.nominal(), residual=fitter.sigma * random.normal(
        0.0, 1.0, fitter.sigma.size))) for _ in range(200)]
    assert np.quantile(sure, 0.5) == pytest.approx(0.5, abs=0.12)
    assert np.mean(np.array(sure) < 0.05) == pytest.approx(0.05, abs=0.05)


@pytest.mark.parametrize(('smooth', 'said'), [(1, 'consistent'), (6, 'unexplained')])
def test_a_file_that_leaves_noise_of_another_level_is_consistent(fitter, smooth, said):
    nominal = left(fitter, 1.25, smooth)
    verdict, _ = verdict_of(fitter, nominal, Explanation(nominal, None), [])
    assert verdict == said


def test_a_wave_has_colour_whatever_the_rate_of_another_recording():
    """Which values follow one another is told by each recording's own grid."""
    fast, slow = lively(NOMINAL), lively(NOMINAL)
    slow = replace(slow, name='slow', time=slow.time[::8], position=slow.position[::8],
                   effort=slow.effort[::8], velocity=None, reference=None)
    both = Fitter(problem_of([fast, slow], NOMINAL))
    quick, other = both.problem.times
    white = np.random.default_rng(4).normal(0.0, 1.0, other.size)
    residual = np.concatenate([2.0 * np.sin(2.0 * np.pi * 2.0 * quick), white]) * both.sigma
    assert colour(both, replace(both.nominal(), residual=residual)) < 1e-6
