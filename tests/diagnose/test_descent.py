# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The arithmetic of a fit: sums of products, corrected derivatives, work within work."""

import threading

import numpy as np
import pytest

from engb_core.diagnose.fit_steps import secant
from engb_core.diagnose.optimise.normal_equations import normal_equations
from engb_core.diagnose.parallel_map import parallel_map


def test_normal_equations_are_those_of_weighted_rows():
    generator = np.random.default_rng(4)
    design, target = generator.normal(size=(50, 4)), generator.normal(size=50)
    weight = np.where(generator.random(50) < 0.3, 0.0, generator.random(50))
    # What is left out may hold anything.
    design[weight == 0.0] = np.inf
    target[weight == 0.0] = np.nan
    gram, right = normal_equations(design, target, weight)
    rows = weight > 0.0
    scaled = design[rows] * weight[rows, None]
    assert gram == pytest.approx(scaled.T @ scaled)
    assert right == pytest.approx(scaled.T @ (target[rows] * weight[rows]))


def test_secant_agrees_with_the_step_and_leaves_other_directions():
    generator = np.random.default_rng(5)
    design, change = generator.normal(size=(30, 3)), generator.normal(size=30)
    step, weight = np.array([0.2, -0.1, 0.0]), np.array([2.0, 5.0, 1.0])
    corrected = secant(design, step, change, weight)
    assert corrected @ step == pytest.approx(change)
    across = np.array([weight[1] * step[1], -weight[0] * step[0], 7.0])
    assert corrected @ across == pytest.approx(design @ across)
    assert secant(design, np.zeros(3), change, weight) is design


def test_work_within_work_stays_on_its_thread():
    def outer(_: int) -> set[str]:
        names = parallel_map(lambda _: threading.current_thread().name, range(4), 4)
        return {*names, threading.current_thread().name}

    assert all(len(names) == 1 for names in parallel_map(outer, range(3), 3))
    assert list(parallel_map(lambda item: item * item, range(5), 3)) == [0, 1, 4, 9, 16]


def test_who_is_interrupted_does_not_wait_for_what_still_runs():
    """Without numba one piece of work takes minutes."""
    running, go_on, went_on = (threading.Event() for _ in range(3))

    def work(item: int) -> None:
        if item == 0:
            running.wait(10.0)
            raise KeyboardInterrupt
        running.set()
        go_on.wait(10.0)
        went_on.set()

    with pytest.raises(KeyboardInterrupt):
        list(parallel_map(work, range(2), 2))
    assert not went_on.is_set()
    go_on.set()
