# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What smooths the noise of the motion is told only for what it explains beyond that."""

from dataclasses import replace

import numpy as np

from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.search.every_effect import extend, search
from engb_core.diagnose.smoothed_noise import only_smooth
from engb_core.effects.catalogue import get_effect
from engb_core.model import Friction, LoadTorque, Model, Motor
from engb_core.recording import Recording

from .swings import swung

INERTIA = 3.0
MODEL = Model(Motor(1.0, INERTIA, 1.3), LoadTorque(coefficients=(0.0, 0.0, 0.0, 0.0)),
              Friction(4.0, 0.0, 0.03))


def turned(count: float, lag: float = 0.0, unknown: float = 0.0) -> Recording:
    """A heavy turntable whose position is told in counts; its current may be filtered, and
    something unknown may turn with it."""
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 20.0, 1e-3)
    angle, speed, rise = swung(time, (0.11, 0.41, 0.97, 2.1),
                               lambda frequency: 0.6 / (1.0 + frequency), rng)
    effort = INERTIA * rise + 1.3 * speed + 4.0 * np.clip(speed / 0.03, -1.0, 1.0) \
        + unknown * np.sin(9.0 * angle)
    if lag:
        late = effort.copy()
        for row in range(1, time.size):
            late[row] = late[row - 1] + (effort[row] - late[row - 1]) * 1e-3 / lag
        effort = late
    shown = np.round(angle / count) * count if count else angle
    return Recording.from_samples('table', time, shown,
                                  effort + 0.005 * rng.standard_normal(time.size))


def told(recording: Recording) -> set[int]:
    fitter = Fitter(problem_of([recording], MODEL))
    (variant,) = variants_of(get_effect('effort_measurement_lag'), fitter.problem.scene)
    return only_smooth(fitter, fitter.refine(fitter.fit(variant)))


def test_a_lag_that_smooths_counts():
    assert told(turned(count=1e-4)) == {0}


def test_a_lag_that_is_there():
    assert told(turned(count=1e-4, lag=0.03)) == set()
    assert told(turned(count=0.0, lag=0.01)) == set()


def test_a_lag_beside_much_that_is_unknown():
    """It takes away a small part of the whole, but more than it smooths."""
    assert told(turned(count=1e-4, lag=0.003, unknown=4.0)) == set()


def test_what_is_none_is_tried_no_further():
    result = search(Fitter(problem_of([turned(count=1e-4)], MODEL)))
    without = result.without('effort_measurement_lag')
    extend(without, without.of_size(1)[:2])
    assert any('effort_measurement_lag' in ids for ids in result.fits)
    assert not any('effort_measurement_lag' in ids for ids in without.fits)


def test_what_is_settled_is_found_no_more():
    """A gap that stood for a shaft is not asked again beside it."""
    problem = problem_of([turned(count=0.0, lag=0.01)], MODEL)
    found = search(Fitter(problem)).fits['effort_measurement_lag',]
    settled = replace(problem, settled=('effort_measurement_lag',))
    again = search(Fitter(settled), found=found)
    assert not any('effort_measurement_lag' in ids for ids in again.fits)
