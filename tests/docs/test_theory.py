# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""docs/theory.md leaves no effect out, and what it calls exact is computed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import re

import numpy as np
import pytest

from engb_core.effects.catalogue import catalogue
from engb_core.model import EffectSetting, Friction, LoadTorque, Model, Motor
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.physics.sample_table import sample_table

PAGE = (Path(__file__).resolve().parents[2] / 'docs' / 'theory.md').read_text(encoding='utf-8')
SECTIONS = dict(re.findall(r'^### (\w+)\n(.*?)(?=^##)', PAGE, re.MULTILINE | re.DOTALL))

MODEL = Model(
    motor=Motor(torque_constant=0.0174, inertia=6.8e-5, viscous_friction=1.1e-3),
    friction=Friction(coulomb=0.012, load_gain=0.0, saturation_velocity=1.5),
    load_torque=LoadTorque(coefficients=(0.0, 2e-3, 4e-4)))
LOADED = replace(MODEL, friction=replace(MODEL.friction, load_gain=0.11))
UNLOADED = replace(MODEL, load_torque=LoadTorque(coefficients=(0.0,)))
STRAIGHT = replace(MODEL, load_torque=LoadTorque(coefficients=(0.02, 2e-3)))


def effort(model: Model, effect: str, parameters: dict[str, float]) -> np.ndarray:
    """Return what a motion through a stroke, a disc that turns beside it, needs [N·m], where the
    shaft moves faster than the saturation velocity."""
    step = 1e-3
    time = np.arange(3000) * step
    angle = 10.0 + 4.0 * np.sin(5.0 * time) + 2.0 * np.sin(13.0 * time)
    speed = 20.0 * np.cos(5.0 * time) + 26.0 * np.cos(13.0 * time)
    rate = -100.0 * np.sin(5.0 * time) - 338.0 * np.sin(13.0 * time)
    disc = np.full_like(time, 12.0)
    samples = sample_table(step, time, angle, speed, rate, disc, 12.0 * time,
                           np.full_like(time, 20.0))
    settings = (EffectSetting(effect, parameters),) if effect else ()
    made = effort_of_motion(samples, step, physics_of(replace(model, effects=settings)))
    inside = (np.abs(speed) > 1.6) & (time > 0.1) & (time < 2.9)
    return made[inside]


def scaled(model: Model, factor: float) -> Model:
    """Return the model with every number multiplied."""
    return replace(
        model, motor=replace(model.motor, inertia=factor * model.motor.inertia,
                             viscous_friction=factor * model.motor.viscous_friction),
        friction=replace(model.friction, coulomb=factor * model.friction.coulomb),
        load_torque=replace(model.load_torque, coefficients=tuple(
            factor * value for value in model.load_torque.coefficients)))


TURNING = 1.0 - 0.3 * np.tanh(12.0 / 5.0)
EXACT = {
    'viscous_friction_error': (
        (LOADED, 'viscous_friction_error', {'viscous_friction': 1.6e-3}),
        (LOADED, 'back_emf', {'back_emf': 0.5e-3})),
    'load_stiffness_error': (
        (LOADED, 'load_stiffness_error', {'scale': TURNING}),
        (LOADED, 'self_energizing', {'load_ratio': 0.7, 'turning_speed': 5.0, 'build_up': 1e-3,
                                     'fall_with_load': 0.0, 'reference_load': 0.2})),
    'contact_shift': ((STRAIGHT, 'contact_shift', {'shift': 3.0}),
                      (STRAIGHT, 'torque_offset', {'offset': -6e-3})),
    'torque_offset': ((UNLOADED, 'torque_offset', {'offset': 3.6e-3}),
                      (UNLOADED, 'asymmetric_friction', {'asymmetry': 0.3})),
    'effort_scale_error': ((LOADED, 'effort_scale_error', {'scale': 0.8}),
                           (scaled(LOADED, 1.25), '', {})),
    'sampling_delay': ((LOADED, 'sampling_delay', {'delay': 7e-4}),
                       (LOADED, 'actuation_lag', {'lag': 7e-4, 'first_order': 0.0})),
}


def test_each_effect_is_derived():
    named = {effect.id for effect in catalogue().values()
             if not effect.unnamed and (effect.stages or effect.number_only)}
    assert set(SECTIONS) == named
    for name, text in SECTIONS.items():
        parts = re.findall(r'^\*\*(Derived|Assumed|Not told apart)\.\*\* \S', text, re.MULTILINE)
        assert parts == ['Derived', 'Assumed', 'Not told apart'], name
        assert catalogue()[name].reference


def test_other_effects_that_it_names_are_effects():
    told = {name for text in SECTIONS.values() for name in re.findall(r'`([a-z]+_[a-z_]+)`', text)}
    parameters = {entry.name for effect in catalogue().values() for entry in effect.parameters}
    assert told <= set(catalogue()) | parameters


def test_all_that_it_calls_exact_is_computed():
    assert {name for name, text in SECTIONS.items() if '**Exact:**' in text} == set(EXACT)


@pytest.mark.parametrize('name', EXACT)
def test_it_is_exact(name):
    (model, effect, parameters), other = EXACT[name]
    assert f'`{other[1]}`' in SECTIONS[name] or not other[1]
    one, two = effort(model, effect, parameters), effort(*other)
    without = effort(model, '', {})
    assert np.abs(one - without).max() > 1e-3
    np.testing.assert_allclose(two, one, atol=1e-9)
