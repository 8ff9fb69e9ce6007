# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a model file, an effect or a recording may not be, and small parts at their limits."""

import codecs
from dataclasses import replace
import importlib
import math
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

import engb_core
from engb_core.effect_check import faults_of_effect, MODEL
from engb_core.effects import drivetrain_resonance
from engb_core.effects.catalogue import catalogue, effect_of_file, get_effect, registered
from engb_core.errors import InputError
from engb_core.export.c_model import c_model
from engb_core.export.fmu import write_fmu
from engb_core.export.json_text import json_text
from engb_core.export.kinds import Array, joined, LONG, REAL, Several
from engb_core.io.tables.units import named
from engb_core.model import Controller, EffectSetting, LoadTorque, Model
from engb_core.recording import Recording, Reference
from engb_core.text import printable
from engb_core.text.printable import make_printable
from engb_core.text.yaml_text import load_yaml


@pytest.mark.parametrize(('change', 'words'), [
    ({'controller': {'proportional': 1.0, 'integral': 0.0, 'derivative': 0.0, 'rate': 1e9}},
     'controller.rate is 1e+09; it must be at most'),
    ({'effects': [{'effect': 'law', 'formula': 3, 'parameters': {'a': 1.0}}]},
     'formula is 3; it must be text'),
    ({'effects': [{'effect': 'law', 'formula': 'a * load', 'parameters': {'a': 1.0},
                   'within': [1.0]}]}, 'within must be a mapping of coordinates'),
    ({'effects': [{'effect': 'law', 'formula': 'a * load', 'parameters': {'a': 1.0},
                   'within': {'load': 1.0}}]}, 'within.load must be [lowest, highest]'),
    ({'effects': [{'effect': 'law', 'formula': 'a * load', 'parameters': {'a': 1.0},
                   'within': {'load': [1.0]}}]}, 'within.load must be [lowest, highest]'),
])
def test_a_model_file_without_sense_is_told(tmp_path, change, words):
    path = tmp_path / 'model.yaml'
    path.write_text(yaml.safe_dump({**Model().to_mapping(), **change}))
    with pytest.raises(InputError) as told:
        Model.read(path)
    assert words in str(told.value)


def test_a_law_without_ranges_holds_everywhere_and_too_many_numbers_are_refused(tmp_path):
    path = tmp_path / 'model.yaml'
    law = {'effect': 'law', 'formula': 'a * load', 'parameters': {'a': 1.0}}
    path.write_text(yaml.safe_dump({**Model().to_mapping(), 'effects': [law]}))
    assert Model.read(path).effects[0].within == {}
    letters = 'abcdefghijkmnoprsuvwxy'
    formula = ' + '.join(f'{name} * load' for name in letters)
    many = EffectSetting('law', dict.fromkeys(letters, 1.0), formula, 'torque')
    with pytest.raises(InputError, match='law has more than'):
        get_effect('law').made_of(many)


@pytest.mark.parametrize(('text', 'words'), [
    ('[' * 200 + ']' * 200, 'nested too deep at line 1'),
    ('- 1\n' * 100_001, 'too long at line'),
])
def test_a_text_that_would_take_for_ever_is_refused(text, words):
    with pytest.raises(InputError, match=words):
        load_yaml(text)


def test_a_model_file_of_megabytes_is_refused(tmp_path):
    path = tmp_path / 'model.yaml'
    path.write_text('# ' + 'x' * (5 << 20))
    with pytest.raises(InputError, match='no model file is'):
        Model.read(path)


# ---- effects

def test_an_effect_without_parameters_is_told():
    effect = replace(get_effect('torque_offset'), id='nothing', parameters=(), formerly=())
    assert any('parameters is empty' in line for line in faults_of_effect(effect))


@pytest.mark.parametrize(('change', 'words'), [
    ({'id': 'backlash'}, 'there is an effect backlash already'),
    ({'id': 'new_one', 'formerly': ('backlash',)}, 'backlash, a former id of new_one'),
])
def test_an_id_is_given_once(change, words):
    effect = replace(get_effect('torque_offset'), **{'formerly': (), **change})
    with pytest.raises(InputError, match=words), registered(effect):
        catalogue()


def test_a_file_that_is_no_python_holds_no_effect(tmp_path):
    path = tmp_path / 'effect.txt'
    path.write_text('EFFECT = 1\n')
    with pytest.raises(InputError, match=r'no effect can be read from it \(not a Python file\)'):
        effect_of_file(path)


@pytest.mark.parametrize(('numbers', 'words'), [
    ({'spring': drivetrain_resonance.HARDENS, 'stiffness_change': 1.2, 'stiffness_twist': 0.01},
     'it hardens as it is twisted, to 2.2 times as stiff.'),
    ({'spring': drivetrain_resonance.HARDENS, 'stiffness_change': 5.0, 'stiffness_twist': 0.01},
     'it hardens: twisted by 5 mrad it is twice as stiff.'),
    ({'spring': drivetrain_resonance.SOFT_CENTRE, 'stiffness_change': 0.6,
      'stiffness_twist': 0.01}, 'its centre, some ±10 mrad, is softer by 60 %.'),
    ({'spring': 0.0, 'stiffness_change': 0.0, 'stiffness_twist': 0.01}, 'inertia beyond it.'),
])
def test_a_shaft_is_told_with_how_its_spring_bends(numbers, words):
    told = get_effect('drivetrain_resonance').statement(
        {'frequency': 40.0, 'inertia_fraction': 0.3, **numbers})
    assert told.startswith('A compliant drivetrain resonates at 40.0 Hz with 30 % of the inertia')
    assert told.endswith(words)


def test_only_public_names_are_there():
    assert engb_core.effects is importlib.import_module('engb_core.effects')
    assert engb_core.effects.register is importlib.import_module(
        'engb_core.effects.catalogue').register
    for module in (engb_core, engb_core.effects):
        with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
            module.nothing      # noqa: B018


# ---- what is exported

def test_an_unlimited_controller_is_json_all_the_same():
    text = json_text(replace(MODEL, controller=Controller(1.0, 0.0, 0.0, math.inf)))
    assert 'effort_limit' not in text and 'Infinity' not in text
    assert 'effort_limit' in json_text(replace(MODEL, controller=Controller(1.0, 0.0, 0.0, 2.0)))


def test_an_unknown_version_of_fmi_is_refused(tmp_path):
    with pytest.raises(InputError, match='there is no FMI 1 here; give 2 or 3'):
        write_fmu(MODEL, tmp_path / 'a.fmu', version=1)


@pytest.mark.parametrize(('load', 'names'), [
    (LoadTorque('sinusoid', amplitude=0.1, phase=0.2),
     ['load_torque.amplitude', 'load_torque.phase']),
    (LoadTorque(coefficients=(0.0, 1e-3)), ['load_torque.coefficients[0]',
                                            'load_torque.coefficients[1]']),
    (LoadTorque(coefficients=(0.0, 1e-3), contact_angle=2.0),
     ['load_torque.contact_angle', 'load_torque.coefficients[0]',
      'load_torque.coefficients[1]']),
])
def test_the_numbers_of_the_load_can_be_set_in_what_is_exported(load, names):
    made = c_model(replace(MODEL, load_torque=load))
    found = [entry.name for entry in made.quantities if entry.name.startswith('load_torque')]
    assert found == names


def test_kinds_that_have_nothing_in_common_are_refused():
    assert joined(LONG, REAL) == REAL
    both = joined(Several((LONG, REAL)), Several((REAL, REAL)))
    assert both == Several((REAL, REAL))
    for other in (Several((LONG,)), REAL, Array(3)):
        with pytest.raises(TypeError, match='a number here and something else there'):
            joined(Several((LONG, REAL)), other)


# ---- recordings and texts

def test_bursts_with_long_pauses_are_no_recording():
    time = np.concatenate([1000.0 * burst + np.arange(40) * 1e-3 for burst in range(5)])
    with pytest.raises(InputError, match='200 samples 0.001 s apart lie scattered over 4e'):
        Recording.from_samples('bursts', time, np.sin(time), np.cos(time))


def test_a_set_point_of_one_usable_sample_is_none():
    time = np.arange(100) * 0.01
    reference = Reference(time, np.where(time == 0.0, 1.0, np.nan))
    assert Recording.from_samples('a', time, np.sin(time), np.cos(time),
                                  reference=reference).reference is None


def test_an_unknown_unit_is_told_with_those_there_are():
    with pytest.raises(InputError, match='position=furlong: not a known unit; known: rad'):
        named('furlong', 'position')


def test_bytes_that_are_no_text_are_not_made_printable():
    """The handler that writes what a terminal cannot show is for writing alone."""
    make_printable(SimpleNamespace(reconfigure=lambda **_: None, encoding='ascii'))
    handler = codecs.lookup_error(printable._HANDLER)
    assert handler(UnicodeEncodeError('ascii', '5 µm', 2, 3, 'x'))[1] == 3
    with pytest.raises(UnicodeDecodeError):
        handler(UnicodeDecodeError('utf-8', b'\xff', 0, 1, 'x'))
