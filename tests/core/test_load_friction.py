# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Friction that grows with load in a straight line, or roughly so."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.model import EffectSetting, Friction, LoadTorque, Model
from engb_core.physics.nominal_torque import load_friction_gain
from engb_core.physics.simulation import BrakePlant

LOADS = np.linspace(0.0, 0.5, 501)


def friction(curvature: float, reference: float = 0.4) -> np.ndarray:
    return np.array([load_friction_gain(0.1, curvature, reference, load) * load
                     for load in LOADS])


@pytest.mark.parametrize('curvature', [-0.9, -0.4, 0.0, 0.3, 0.9])
def test_the_gain_is_the_slope_of_the_best_straight_line(curvature):
    """Up to the reference, all loads alike; beyond it friction doesn't fall."""
    reached = LOADS <= 0.4
    values = friction(curvature)
    assert np.polyfit(LOADS[reached], values[reached], 1)[0] == pytest.approx(0.1, rel=0.02)
    assert values[400] == pytest.approx(0.04)
    assert values[0] == 0.0
    assert (np.diff(values) >= -1e-12).all()
    assert np.diff(values, 2)[:300].mean() == pytest.approx(2e-6 * 0.1 * curvature / 0.4)


def test_a_load_that_pulls_rubs_as_one_that_presses():
    assert load_friction_gain(0.1, -0.5, 0.4, -0.2) == load_friction_gain(0.1, -0.5, 0.4, 0.2)


@pytest.mark.parametrize('curvature', [-0.6, 0.6])
def test_the_fast_way_of_a_plant_without_effects_is_the_same(curvature):
    model = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6), contact_angle=2.0),
                  friction=Friction(0.012, 0.2, 0.3, curvature, 0.15))
    fast = BrakePlant(model)
    slow = BrakePlant(replace(model, effects=(EffectSetting('torque_offset', {'offset': 0.0}),)))
    straight = BrakePlant(replace(model, friction=replace(model.friction, load_curvature=0.0)))
    for plant in (fast, slow, straight):
        plant.advance(0.25, 0.5)
    assert fast.position == pytest.approx(slow.position, rel=1e-12)
    assert fast.position != pytest.approx(straight.position, rel=1e-3)
