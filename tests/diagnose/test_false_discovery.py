# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Of the stretches of time that are told few hold no mismatch, however the noise is coloured."""

import numpy as np
import pytest

from engb_core.diagnose.constants import FALSE_PART
from engb_core.diagnose.false_discovery import mismatched, PERIODS, rejected
from engb_core.diagnose.locate import intervals
from engb_core.diagnose.problem import problem_of
from engb_core.signals.gaussian import filtered, gaussian_kernel

from .simulated_brake import lively, NOMINAL

BANDWIDTH = 20.0
STEP = 0.02
BLOCK = round(PERIODS / BANDWIDTH / STEP)


def noise(random: np.random.Generator, count: int, colour: float) -> np.ndarray:
    """Noise of variance 1 whose autocorrelation falls by `colour` each step."""
    found = np.empty(count)
    found[0] = random.standard_normal()
    for place in range(1, count):
        found[place] = (colour * found[place - 1]
                        + np.sqrt(1.0 - colour ** 2) * random.standard_normal())
    return found


def test_benjamini_and_hochberg() -> None:
    chances = np.array([0.01, 0.9, 0.04, 0.03, 0.005])
    assert rejected(chances, 0.05).tolist() == [True, False, True, True, True]
    assert rejected(chances, 0.02).tolist() == [False, False, False, False, False]
    assert rejected(np.array([0.011, 0.9, 0.5, 0.4, 0.005]), 0.03).tolist() == [
        True, False, False, False, True]
    assert rejected(np.array([]), 0.1).size == 0


@pytest.mark.parametrize('residual', [False, True])
@pytest.mark.parametrize('colour', [0.0, 0.5])
@pytest.mark.parametrize('part', [0.0, 0.1, 0.5, 1.0])
def test_the_false_part_of_what_is_told_is_held(residual: bool, colour: float, part: float,
                                                ) -> None:
    """An effect is fitted to all blocks, and acts in a part of them."""
    random = np.random.default_rng(7)
    blocks, rounds = 60, 150
    time = (np.arange(blocks * BLOCK) + 0.5) * STEP
    sigma = np.full(time.size, 0.3)
    false, found = [], []
    for _ in range(rounds):
        true = np.repeat(random.random(blocks) < part, BLOCK)
        shape = 4.0 * sigma * np.sin(2.0 * np.pi * time / 0.3 + random.uniform(0.0, 6.0))
        noisy = sigma * noise(random, time.size, colour)
        missed = np.where(true, shape, 0.0) + noisy
        fitted = shape * (missed @ shape) / (shape @ shape)
        told, = mismatched([time], [missed if residual else fitted],
                           [noisy if residual else missed - fitted], [sigma], BANDWIDTH, residual)
        told, true = told[::BLOCK], true[::BLOCK]
        false.append((told & ~true).sum() / max(told.sum(), 1))
        found.append((told & true).sum() / max(true.sum(), 1))
    spread = 3.0 * np.sqrt(FALSE_PART * (1.0 - FALSE_PART) / rounds)
    assert np.mean(false) <= FALSE_PART + spread
    assert part == 0.0 or np.mean(found) > 0.9


def test_low_passed_noise_alone_is_told_as_seldom_as_stated() -> None:
    """The comparison's own low-pass, on its grid: in some recording of ten something is told."""
    random = np.random.default_rng(3)
    kernel = gaussian_kernel(BANDWIDTH, 1e-3)
    told = 0
    for _ in range(200):
        white = filtered(random.standard_normal(12000), kernel)[::20]
        values = white / white.std()
        time = np.arange(values.size) * STEP
        said = np.sin(2.0 * np.pi * time / 0.7)
        found, = mismatched([time], [said], [values - said], [np.ones(time.size)], BANDWIDTH)
        told += found.any()
    assert told <= 200 * FALSE_PART + 3.0 * np.sqrt(200 * FALSE_PART * (1.0 - FALSE_PART))


def test_nothing_is_told_where_nothing_is_said() -> None:
    time = np.arange(200) * STEP
    rest = np.random.default_rng(1).standard_normal(200)
    found = mismatched([time, time], [np.zeros(200), np.full(200, 9.0)], [rest, rest],
                       [np.ones(200)] * 2, BANDWIDTH)
    assert not found[0].any() and found[1].all()


def test_intervals_lie_where_there_is_a_mismatch() -> None:
    run, = problem_of([lively(NOMINAL)], NOMINAL).runs
    early = run.time < run.time.mean()
    mismatch = np.where(early, 1.0, 2.0)
    assert not intervals(run, mismatch, np.zeros(early.size, bool))
    told = intervals(run, mismatch, early)
    assert told and max(entry.end for entry in told) <= run.time[early].max() + STEP
    # Shares are of the whole mismatch, told or not.
    assert sum(entry.share for entry in told) < 0.5
    assert max(entry.end for entry in intervals(run, mismatch, ~early)) > run.time[early].max()
