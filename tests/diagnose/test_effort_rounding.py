# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The noise of an effort that a drive tells in coarse counts."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.effort_rounding import rounding_noise
from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.problem import problem_of
from engb_core.model import Friction, LoadTorque, Model
from engb_core.recording import Recording
from engb_core.signals.gaussian import filtered, gaussian_kernel
from tests.core.bench import Bench, strokes

MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6)),
              friction=Friction(0.012, 0.11, 0.03))
NOISE = 1e-3


@pytest.fixture(scope='module')
def exact() -> Recording:
    return Bench(noise=0.0).run(strokes(acceleration=20.0, dwell=0.4))


def told_in_counts(exact: Recording, count: float, seed: int = 3) -> Recording:
    random = np.random.default_rng(seed)
    effort = exact.effort + NOISE * random.standard_normal(exact.effort.size)
    return replace(exact, effort=count * (np.round(effort / count + 0.2) - 0.2))


@pytest.mark.parametrize('counts', [2.5, 4.0, 8.0])
def test_the_noise_of_coarse_counts_is_told(exact, counts):
    """A shaft that stands shows none of it: there the effort is the same count all the time."""
    given = told_in_counts(exact, counts * NOISE)
    (run,) = problem_of([given], MODEL).runs
    passed = filtered(given.effort - exact.effort,
                      gaussian_kernel(run.motion.bandwidth, given.interval))
    off = run.comparison(np.interp(run.motion.time, given.time, passed))
    off -= np.mean(off)
    assert 0.6 < np.sqrt(np.mean((off / run.noise) ** 2)) < 1.25


def test_a_fine_effort_has_none(exact):
    given = told_in_counts(exact, 0.5 * NOISE)
    (run,) = problem_of([given], MODEL).runs
    assert not rounding_noise(given, run.motion, run.comparison).any()


def test_nothing_is_said_of_a_right_model_with_coarse_counts(exact):
    given = told_in_counts(exact, 6.0 * NOISE)
    found = diagnose([given], MODEL)
    assert (found.verdict, found.effects) == ('consistent', ())
