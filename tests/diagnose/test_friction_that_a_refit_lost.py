# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A refit may have put dry friction into other numbers: what changes friction has none then."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.control.trajectory import Setpoint
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.optimise.linear_start import frictionless
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.search.every_effect import search
from engb_core.diagnose.selection import select
from engb_core.model import EffectSetting
from tests.diagnose.simulated_brake import NOMINAL, recorded


def small_waves(time: float) -> Setpoint:
    """Waves of which few go as far as friction needs to build up."""
    place = speed = rise = 0.0
    for amplitude, frequency, phase in ((0.9, 0.7, 0.0), (0.5, 1.9, 1.0), (0.25, 3.7, 2.0)):
        rate = 2.0 * np.pi * frequency
        place += amplitude * np.sin(rate * time + phase)
        speed += amplitude * rate * np.cos(rate * time + phase)
        rise -= amplitude * rate ** 2 * np.sin(rate * time + phase)
    return Setpoint(5.0 + place, speed, rise)


@pytest.mark.parametrize('coulomb', [0.03, 0.06])
def test_friction_that_builds_up_over_a_distance_is_found_where_a_refit_left_none(coulomb):
    model = replace(NOMINAL, friction=replace(NOMINAL.friction, coulomb=coulomb, load_gain=0.0))
    brake = replace(model, effects=(
        EffectSetting('presliding_friction', {'presliding_distance': 2.5, 'shape': 0.95}),))
    recording = recorded(brake, lambda time, _: small_waves(time), 12.0, noise=0.002)
    fitter = Fitter(problem_of([recording], model))
    assert frictionless(fitter, fitter.base())
    assert select(search(fitter)).chosen.hypothesis.ids == ('presliding_friction',)
