# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A model file of the first version means for good what it meant (docs/versions.md)."""

from __future__ import annotations

from dataclasses import replace

import pytest
import yaml

from engb_core.effects.catalogue import catalogue, get_effect, register
from engb_core.errors import InputError
from engb_core.model import (
    Cogging,
    Controller,
    EffectSetting,
    Friction,
    Joint,
    LoadTorque,
    Model,
    Motor,
)

# As version 0.1.0 wrote it. Not to be changed: a new format gets a file of its own beside it.
FIRST = '''\
format: engb-model/1
joint: {name: motor, type: revolute}
motor: {torque_constant: 0.05, inertia: 7.0e-05, viscous_friction: 0.0001}
load_torque:
  form: polynomial
  coefficients: [0.0, 0.001, 0.0002, 5.0e-06]
  contact_angle: null
friction: {coulomb: 0.012, load_gain: 0.11, saturation_velocity: 0.3}
cogging:
- {order: 6.0, amplitude: 0.002, phase: 0.5}
controller: {proportional: 0.3, integral: 1.0, derivative: 0.004, effort_limit: 0.75, rate: 1000.0}
effects:
- effect: stribeck_friction
  parameters: {breakaway_ratio: 1.8, stribeck_velocity: 2.5}
'''
MEANS = Model(
    Motor(torque_constant=0.05, inertia=7e-5, viscous_friction=1e-4),
    LoadTorque(form='polynomial', coefficients=(0.0, 0.001, 0.0002, 5e-6), contact_angle=None),
    Friction(coulomb=0.012, load_gain=0.11, saturation_velocity=0.3),
    (Cogging(order=6.0, amplitude=0.002, phase=0.5),),
    Controller(proportional=0.3, integral=1.0, derivative=0.004, effort_limit=0.75, rate=1000.0),
    (EffectSetting('stribeck_friction', {'breakaway_ratio': 1.8, 'stribeck_velocity': 2.5}),),
    Joint('motor', 'revolute'))


def test_the_first_format_is_read_and_means_the_same(tmp_path):
    path = tmp_path / 'old.yaml'
    path.write_text(FIRST)
    model = Model.read(path)
    assert model == MEANS
    # Read and saved is the migration.
    model.save(tmp_path / 'new.yaml')
    assert Model.read(tmp_path / 'new.yaml') == MEANS


def test_what_a_newer_version_would_say_is_refused_by_name():
    newer = yaml.safe_load(FIRST)
    with pytest.raises(InputError, match='temperature'):
        Model.from_mapping({**newer, 'temperature': {'reference': 20.0}})
    with pytest.raises(InputError, match='engb-model/2'):
        Model.from_mapping({**newer, 'format': 'engb-model/2'})


def renamed():
    """The effect of FIRST, as a version would have it that calls it and a parameter otherwise."""
    old = get_effect('stribeck_friction')
    breakaway, *others = old.parameters
    return replace(
        old, id='velocity_weakening', formerly=('stribeck_friction',),
        parameters=(replace(breakaway, name='static_ratio', formerly=('breakaway_ratio',)),
                    *others))


def test_an_effect_and_a_parameter_that_were_renamed_are_read_by_their_old_names(
        monkeypatch, tmp_path):
    now = {name: entry for name, entry in catalogue().items() if name != 'stribeck_friction'}
    now['velocity_weakening'] = renamed()
    monkeypatch.setattr('engb_core.effects.catalogue.catalogue', lambda: now)
    (tmp_path / 'old.yaml').write_text(FIRST)
    model = Model.read(tmp_path / 'old.yaml')
    assert model.effects == (EffectSetting(
        'velocity_weakening', {'static_ratio': 1.8, 'stribeck_velocity': 2.5}),)
    # What is written has the new names, and they are read as well.
    model.save(tmp_path / 'new.yaml')
    assert 'breakaway_ratio' not in (tmp_path / 'new.yaml').read_text()
    assert Model.read(tmp_path / 'new.yaml') == model
    both = yaml.safe_load(FIRST)
    both['effects'][0]['parameters']['static_ratio'] = 1.9
    with pytest.raises(InputError, match='breakaway_ratio is the former name of static_ratio'):
        Model.from_mapping(both)


def test_a_former_id_is_no_other_effects_id():
    with pytest.raises(InputError, match='stribeck_friction'):
        register(renamed())
    assert 'velocity_weakening' not in catalogue()
