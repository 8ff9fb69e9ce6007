# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Is an effect's formula right, whatever else is missing? Asked over its own coordinate."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.formula import something_known
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.score.probability import part_left
from engb_core.diagnose.unknown.flexible import Axis, form_left, left_out, Table
from engb_core.effects.base import LOAD, VELOCITY
from engb_core.effects.catalogue import get_effect

from .simulated_brake import brake_with, lively, NOMINAL


@pytest.fixture(scope='module')
def fitter() -> Fitter:
    """Drag that grows with the square of speed, and beside it a torque that swings with time as
    nothing in the library does."""
    recording = lively(brake_with('nonlinear_viscous_friction', quadratic_viscous_friction=1.5e-4))
    beside = 0.014 * np.sin(2.0 * np.pi * 0.9 * recording.time) * np.exp(-recording.time / 5.0)
    return Fitter(problem_of([replace(recording, effort=recording.effort + beside)], NOMINAL))


def fitted(fitter: Fitter, effect: str) -> Fit:
    fits = [fitter.finish(fitter.refine(fitter.fit(variant, rounds=8)))
            for variant in variants_of(get_effect(effect), fitter.problem.scene)]
    return min(fits, key=lambda fit: fit.cost)


def test_what_else_is_missing_says_nothing_of_a_formula_that_is_right(fitter):
    right, base = fitted(fitter, 'nonlinear_viscous_friction'), fitter.base()
    left, own = part_left(fitter, base, right), form_left(fitter, base, right, 'velocity')
    assert left > 0.3
    assert own is not None and own < 0.1
    assert something_known(left, own) > 0.7 > 0.55 > something_known(left)


def test_a_makeshift_over_the_same_coordinate_leaves_its_form(fitter):
    other, base = fitted(fitter, 'asymmetric_friction'), fitter.base()
    own = form_left(fitter, base, other, 'velocity')
    assert own is not None and own > 0.3
    assert something_known(part_left(fitter, base, other), own) < 0.5


def test_a_coordinate_that_does_not_show_it_says_nothing(fitter):
    right, base = fitted(fitter, 'nonlinear_viscous_friction'), fitter.base()
    assert form_left(fitter, base, right, 'pad_temperature') is None
    assert form_left(fitter, base, right, 'time') is None
    assert form_left(fitter, base, base, 'velocity') is not None
    assert form_left(fitter, base, base, 'velocity') > 0.5


def test_what_is_missing_beside_is_as_likely_as_any_unwritten_cause():
    """However much is left: a name whose own form is right may stand beside what has none."""
    assert 0.7 < something_known(1.0, 0.0) < something_known(0.0, 0.0)
    assert something_known(1.0, 1.0) < 0.1
    assert something_known(0.0) == pytest.approx(0.9, abs=0.02)


def test_it_hangs_on_nothing_that_was_predicted_before():
    """Neither on threads nor on what somebody else has filled into the samples."""
    recording = lively(brake_with('asymmetric_friction', asymmetry=0.4))
    problem = problem_of([recording], NOMINAL)
    labels = np.arange(problem.measured.size) * 5 // problem.measured.size
    low, high = problem.scene.largest_load * np.array([0.0, 1.0])
    table = Table(Axis('load', float(LOAD), 9), Axis('velocity', float(VELOCITY), 9),
                  (low, high), (-problem.scene.speed, problem.scene.speed))
    told = []
    for threads in (1, 4):
        fitter = Fitter(problem, threads)
        right = fitted(fitter, 'asymmetric_friction')
        without = fitter.without(right, 0)
        told.append((form_left(fitter, without, right, 'load'),
                     left_out(fitter, right, table, labels)))
        fitter.predict(right.hypothesis, 1.1 * right.vector)
        assert left_out(fitter, right, table, labels) == told[-1][1]
    assert told[0][0] is not None
    assert told[0] == told[1]
