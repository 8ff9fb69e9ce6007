# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Friction that grows with load, but not in a straight line, on a bench of other formulas."""

from dataclasses import replace
import math

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.model import Friction, LoadTorque, Model
from engb_core.physics.nominal_torque import load_friction_gain
from tests.core.bench import Bench, strokes

MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6)),
              friction=Friction(0.012, 0.0, 0.1))
KNEE = 0.25     # N·m: load at which friction is half of what a straight line gives


def levels_off(level: float, velocity: float) -> float:
    load = (level - 0.012) / 0.11
    return (0.012 + 0.3 * load / (1.0 + load / KNEE)) * math.tanh(velocity / 0.03)


def ways() -> np.ndarray:
    return np.concatenate([strokes((top, 3.0, top - 4.0), rate=500.0, acceleration=acceleration,
                                   dwell=0.2)
                           for top, acceleration in ((14.0, 300.0), (24.0, 500.0), (19.0, 150.0))])


@pytest.mark.parametrize('beside', [
    ('torque_offset', lambda position, velocity: 0.0035),
    ('cogging_torque', lambda position, velocity: 0.004 * math.sin(7.0 * position)),
], ids=lambda entry: entry[0])
def test_its_shape_is_not_taken_for_other_physics(beside):
    effect, torque = beside
    recording = Bench(rubbing=levels_off, further=torque).run(ways())
    found = diagnose([recording], MODEL)
    assert {entry.effect for entry in found.effects} == {effect, 'load_dependent_friction'}
    claim, = (entry for entry in found.effects if entry.effect == 'load_dependent_friction')
    assert 'the less the higher the load' in claim.statement
    assert claim.parameters['load_curvature'].value < -0.15
    friction = found.model.friction
    for load in (0.03, 0.08, 0.13, 0.17):
        gain = load_friction_gain(friction.load_gain, friction.load_curvature,
                                  friction.reference_load, load)
        assert friction.coulomb + gain * load == pytest.approx(
            levels_off(0.012 + 0.11 * load, 5.0), rel=0.04)


def test_a_straight_line_stays_one():
    recording = Bench().run(ways())
    found = diagnose([recording], replace(MODEL, friction=Friction(0.012, 0.11, 0.1)))
    assert not found.effects
    assert abs(found.model.friction.load_curvature) < 0.2
