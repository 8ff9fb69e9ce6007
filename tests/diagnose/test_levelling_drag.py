# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Drag that rises steeply at first and then levels off, as of a grease that thins."""

import pytest

from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.score.reduced_chi_square import excess
from engb_core.effects.catalogue import get_effect

from .simulated_brake import brake_with, lively, NOMINAL

# 0.1 N·m more at speed than in proportion to it.
MOST, SPEED, MEAN = 0.1, 6.0, 10.0
LEVELS_OFF = {'quadratic_viscous_friction': -MOST / MEAN ** 2, 'transition_speed': SPEED,
              'levels_off': 1.0, 'mean_speed': MEAN}


def test_it_is_found_from_its_starts_and_the_quadratic_form_is_not_enough():
    fitter = Fitter(problem_of([lively(brake_with('nonlinear_viscous_friction', **LEVELS_OFF),
                                       seed=4)], NOMINAL))
    quadratic, levels_off = (
        fitter.refine(fitter.fit(variant, keep=2), 12) for variant in variants_of(
            get_effect('nonlinear_viscous_friction'), fitter.problem.scene))
    assert excess(levels_off, fitter) < 0.3 < excess(quadratic, fitter)
    found = levels_off.hypothesis.named(levels_off.vector, 0)
    assert found['transition_speed'] == pytest.approx(SPEED, rel=0.3)
    assert -found['quadratic_viscous_friction'] * found['mean_speed'] ** 2 == pytest.approx(
        MOST, rel=0.3)
