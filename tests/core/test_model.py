# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Model files: what is read is what was written, and what is wrong is told in one line."""

from __future__ import annotations

import copy
import math

import pytest
import yaml

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

FULL = {
    'format': 'engb-model/1',
    'joint': {'name': 'front_left_motor', 'type': 'revolute'},
    'motor': {'torque_constant': 0.0174, 'inertia': 6.813e-5, 'viscous_friction': 1.125e-3},
    'load_torque': {'form': 'polynomial', 'coefficients': [0.0, 1e-3, 2e-4, 5e-6],
                    'contact_angle': 2.5},
    'friction': {'coulomb': 0.012, 'load_gain': 0.11, 'saturation_velocity': 1.5},
    'cogging': [{'order': 8.0, 'amplitude': 0.003, 'phase': 0.4}],
    'controller': {'proportional': 0.05, 'integral': 0.2, 'derivative': 0.002,
                   'effort_limit': 0.6, 'rate': 1000.0},
    'effects': [
        {'effect': 'stribeck_friction',
         'parameters': {'breakaway_ratio': 1.4, 'stribeck_velocity': 2.0}},
        {'effect': 'asymmetric_friction', 'parameters': {'asymmetry': -0.2}}],
}


@pytest.fixture
def file(tmp_path):
    """Write a mapping (or a text) as a model file."""
    path = tmp_path / 'brake.yaml'

    def write(content) -> str:
        path.write_text(content if isinstance(content, str) else yaml.safe_dump(content),
                        encoding='utf-8')
        return path

    return write


def changed(place: str, value: object) -> dict:
    """Return FULL with one place replaced; 'a.b.0.c' walks mappings and lists."""
    content = copy.deepcopy(FULL)
    here = content
    *way, last = place.split('.')
    for name in way:
        here = here[int(name)] if isinstance(here, list) else here[name]
    here[int(last) if isinstance(here, list) else last] = value
    return content


def refusal(path) -> str:
    """Return the one line with which a file is refused."""
    with pytest.raises(InputError) as caught:
        Model.read(path)
    text = str(caught.value)
    assert '\n' not in text
    assert text.startswith(f'{path}: ')
    return text.removeprefix(f'{path}: ')


@pytest.mark.parametrize('model', [
    Model(),
    Model.from_mapping(FULL),
    Model(load_torque=LoadTorque('sinusoid', amplitude=0.4, phase=-0.7)),
    Model(joint=Joint('carriage', 'prismatic'), motor=Motor(35.0, 95.0, 203.0),
          friction=Friction(20.4, 0.0, 1e-3)),
    Model(load_torque=LoadTorque(coefficients=tuple(0.1 ** power for power in range(12)),
                                 contact_angle=-3.25)),
    Model(cogging=tuple(Cogging(order, 1e-4 * order, 1.0) for order in (1.0, 6.0, 12.5)),
          controller=Controller(0.05, effort_limit=math.inf)),
    Model(friction=Friction(0.012, 0.11, 1.5, -0.4, 0.2)),
    Model(effects=(EffectSetting('pad_creep', {'relaxed_fraction': 0.1, 'time_constant': 1e-5}),
                   EffectSetting('anything', {'list': [1.0, -2.5e-12]}))),
], ids=['default', 'full', 'sinusoid', 'prismatic', 'long', 'cogging', 'curved', 'effects'])
def test_what_is_written_is_read(model, tmp_path):
    path = tmp_path / 'model.yaml'
    model.write(path)
    again = Model.read(path)
    assert again == model
    again.write(tmp_path / 'again.yaml')
    assert (tmp_path / 'again.yaml').read_text() == path.read_text()
    assert [entry.name for entry in tmp_path.iterdir() if entry.name.startswith('.')] == []


def test_every_number_of_the_contract_is_read(file):
    model = Model.read(file(FULL))
    assert model.joint == Joint('front_left_motor', 'revolute')
    assert model.motor == Motor(0.0174, 6.813e-5, 1.125e-3)
    assert model.load_torque == LoadTorque('polynomial', (0.0, 1e-3, 2e-4, 5e-6), 2.5)
    assert model.friction == Friction(0.012, 0.11, 1.5)
    assert model.cogging == (Cogging(8.0, 0.003, 0.4),)
    assert model.controller == Controller(0.05, 0.2, 0.002, 0.6, 1000.0)
    assert [entry.effect for entry in model.effects] == ['stribeck_friction',
                                                         'asymmetric_friction']
    assert model.effects[0].parameters == {'breakaway_ratio': 1.4, 'stribeck_velocity': 2.0}


def test_curved_friction_is_kept_with_the_load_that_it_is_about(file):
    """Contract, section 2, knows neither: they are written only where friction is curved."""
    straight = Model(friction=Friction(0.012, 0.11, 1.5, reference_load=0.2))
    assert set(straight.to_mapping()['friction']) == {'coulomb', 'load_gain',
                                                      'saturation_velocity'}
    assert 'friction.reference_load' in refusal(file(changed('friction.load_curvature', -0.3)))


def test_what_may_be_left_out(file):
    model = Model.read(file({'format': 'engb-model/1',
                             'motor': {'inertia': 1e-4, 'viscous_friction': 0.0}}))
    assert model.controller is None
    assert model.effects == model.cogging == ()
    assert model.load_torque.contact_angle is None
    assert model.joint == Joint()


@pytest.mark.parametrize('text', ['1e-5', '1E-5', '1.0e-5', '0.00001', '+1e-5'])
def test_numbers_as_people_write_them(file, text):
    """YAML 1.1 takes 1e-5 for text; the file means the number."""
    path = file(f'format: engb-model/1\nmotor: {{inertia: {text}, viscous_friction: 0}}\n')
    assert Model.read(path).motor.inertia == 1e-5


def test_a_limit_may_be_infinite(file):
    assert Model.read(file(changed('controller.effort_limit', math.inf))
                      ).controller.effort_limit == math.inf


@pytest.mark.parametrize('place', ['frictoin', 'joint.colour', 'motor.Inertia',
                                   'load_torque.offset', 'load_torque.amplitude',
                                   'friction.stribeck', 'cogging.0.ampltiude',
                                   'controller.gain', 'effects.1.value'])
def test_unknown_keys_are_named(file, place):
    text = refusal(file(changed(place, 1.0)))
    name = place.replace('.0.', '[0].').replace('.1.', '[1].')
    assert f'unknown key {name};' in text


NUMBERS = ['motor.torque_constant', 'motor.inertia', 'motor.viscous_friction',
           'load_torque.coefficients.2', 'load_torque.contact_angle', 'friction.coulomb',
           'friction.load_gain', 'friction.saturation_velocity', 'cogging.0.order',
           'cogging.0.amplitude', 'cogging.0.phase', 'controller.proportional',
           'controller.integral', 'controller.derivative', 'controller.rate',
           'effects.0.parameters.breakaway_ratio', 'effects.1.parameters.asymmetry']


def shown(place: str) -> str:
    """Return a place as messages write it: effects[0].parameters.asymmetry."""
    words = place.split('.')
    return ''.join(f'[{word}]' if word.isdigit() else f'.{word}' for word in words)[1:]


@pytest.mark.parametrize('value', ['fast', True, math.nan, math.inf, [[]], {}])
@pytest.mark.parametrize('place', NUMBERS)
def test_values_that_are_no_number_are_named(file, place, value):
    assert shown(place) in refusal(file(changed(place, value)))


@pytest.mark.parametrize('place', ['joint', 'motor', 'load_torque', 'friction', 'cogging',
                                   'cogging.0', 'controller', 'effects', 'effects.0',
                                   'effects.0.parameters', 'load_torque.coefficients'])
@pytest.mark.parametrize('value', ['text', 7])
def test_sections_of_the_wrong_kind_are_named(file, place, value):
    assert shown(place) in refusal(file(changed(place, value)))


@pytest.mark.parametrize(('place', 'value'), [
    ('format', 'engb-model/2'), ('joint.type', 'spherical'), ('joint.name', 3),
    ('motor.inertia', 0.0), ('motor.inertia', -1e-5), ('motor.torque_constant', 0),
    ('friction.saturation_velocity', 0.0), ('friction.saturation_velocity', -1),
    ('friction.load_curvature', 1.5), ('controller.proportional', -1),
    ('controller.integral', -0.1), ('controller.derivative', -1e-9),
    ('controller.rate', 0.0), ('controller.effort_limit', 0.0), ('controller.effort_limit', -1),
    ('load_torque.form', 'spline'), ('load_torque.coefficients', []),
    ('load_torque.coefficients', [0.0] * 13), ('effects.0.effect', 4)])
def test_values_out_of_range_are_named(file, place, value):
    text = refusal(file(changed(place, value)))
    assert shown(place).removesuffix('.effect') in text


@pytest.mark.parametrize('place', ['motor', 'motor.inertia', 'motor.viscous_friction',
                                   'cogging.0.order', 'cogging.0.amplitude', 'effects.0.effect',
                                   'format'])
def test_what_is_missing_is_named(file, place):
    content = copy.deepcopy(FULL)
    here = content
    *way, last = place.split('.')
    for name in way:
        here = here[int(name)] if isinstance(here, list) else here[name]
    del here[last]
    assert shown(place).removesuffix('.effect') in refusal(file(content))


@pytest.mark.parametrize(('place', 'value'), [
    ('friction.coulomb', -0.03), ('friction.load_gain', -0.1), ('motor.viscous_friction', -1e-4)])
def test_friction_that_drives_may_be_diagnosed_and_moves_nothing(file, place, value):
    """Least squares leave such numbers in a file."""
    model = Model.read(file(changed(place, value)))
    with pytest.raises(InputError, match=place):
        model.refuse_negative_friction()
    Model.read(file(FULL)).refuse_negative_friction()


def test_a_sinusoid_without_amplitude_is_no_load(file):
    assert 'load_torque.amplitude is missing' in refusal(file(
        changed('load_torque', {'form': 'sinusoid'})))
    assert Model.read(file(changed('load_torque', {'form': 'sinusoid', 'amplitude': 0.2}))
                      ).load_torque == LoadTorque('sinusoid', amplitude=0.2)


@pytest.mark.parametrize('text', ['', '- 1\n', 'motor', 'a: [1\n', 'a: &a\n', '\t', '? [a]\n: 1\n',
                                  'format: engb-model/1\nmotor: !!python/object:os.system {}\n'])
def test_files_that_are_no_model(file, text):
    refusal(file(text))


def test_files_that_cannot_be_read(tmp_path):
    assert 'cannot be read' in refusal(tmp_path / 'absent.yaml')
    assert 'cannot be read' in refusal(tmp_path)
    (tmp_path / 'binary').write_bytes(b'\xff\xfe\x00')
    assert 'cannot be read' in refusal(tmp_path / 'binary')


def test_a_failed_write_leaves_the_old_file(tmp_path):
    path = tmp_path / 'model.yaml'
    Model().write(path)
    before = path.read_text()
    with pytest.raises((TypeError, ValueError)):
        Model(effects=(EffectSetting('pad_creep', {'relaxed_fraction': 'much'}),)).write(path)
    assert path.read_text() == before
    assert list(tmp_path.iterdir()) == [path]
