# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How sure a name is: by what it leaves of what no fit has seen."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.formula import something_known
from engb_core.diagnose.probability import part_left
from engb_core.diagnose.problem import problem_of

from .simulated_brake import brake_with, lively, NOMINAL


def test_a_cause_that_nobody_wrote_down_stays_possible():
    assert 0.9 < something_known(0.0) < 0.95


def test_what_is_left_unexplained_speaks_against_a_name():
    known = [something_known(left) for left in (0.0, 0.05, 0.2, 0.5, 1.0)]
    assert known == sorted(known, reverse=True)
    # A name that leaves half of the torque or more is likelier a makeshift.
    assert something_known(0.5 ** 2) < 0.55


@pytest.fixture(scope='module')
def fitter() -> Fitter:
    return Fitter(problem_of([lively(brake_with('asymmetric_friction', asymmetry=0.4))], NOMINAL))


def scaled(fit: Fit, rows: np.ndarray, factor: float) -> Fit:
    return replace(fit, residual=np.where(rows, factor, 1.0) * fit.residual)


def test_what_is_left_is_asked_where_no_fit_has_looked(fitter):
    """An effect that fits what it was fitted to, and nothing else, explains nothing."""
    base = scaled(fitter.base(), np.array(True), 20.0)
    assert part_left(fitter, base, scaled(base, fitter.fitted, 0.0)) > 0.9
    assert part_left(fitter, base, scaled(base, ~fitter.fitted, 0.5)) == pytest.approx(
        0.25, abs=0.05)
    assert part_left(fitter, base, scaled(base, ~fitter.fitted, 0.0)) == 0.0


def test_what_lies_in_no_stretch_left_out_is_asked_of_all(fitter):
    once = scaled(fitter.base(), np.array(True), 20.0)
    once = scaled(once, ~fitter.fitted, 0.0)
    assert part_left(fitter, once, scaled(once, fitter.fitted, 0.5)) == pytest.approx(
        0.25, abs=0.05)
