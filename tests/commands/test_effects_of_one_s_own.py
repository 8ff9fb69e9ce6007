# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What is wrong with effects, of one's own or in a model file, is told with the file's name."""

import dataclasses

import pytest

from engb_core.effects import catalogue as effects
from engb_core.model import EffectSetting, Model

DRAG = '''\
from engb_core.effects.base import Effect, Parameter, POSITION, VELOCITY
from engb_core.physics.compiled import effect_function


@effect_function
def _torque(parameters, state, sample):
    return parameters[0] * sample[VELOCTY]


EFFECT = Effect(
    id='cable_drag', title='Cable drag',
    parameters=(Parameter('drag', 'N·m·s/rad', -1e-3, 1e-3, none=0.0, starts=(2e-4,)),),
    stages={'torque': _torque}, equation='T = drag · ω', reference='own bench',
    reveals='position', statement=lambda p: f"A cable drags by {p['drag']:.2g}.")
'''


@pytest.fixture(autouse=True)
def alone(tmp_path, monkeypatch):
    """No effects from elsewhere, before or after."""
    monkeypatch.setenv('ENGB_EFFECTS', str(tmp_path / 'none'))
    monkeypatch.setattr(effects, '_REGISTERED', {})
    effects.catalogue.cache_clear()
    yield
    effects.catalogue.cache_clear()


COMMANDS = {
    'diagnose': ['diagnose', 'run1', '--model', 'model.yaml', '--out', 'out'],
    'predict': ['predict', 'run1', '--model', 'model.yaml', '--out', 'out.npz'],
    'export': ['export', 'model.yaml', '--to', 'json', '--out', 'out'],
}


@pytest.mark.parametrize('command', COMMANDS)
@pytest.mark.parametrize('where', ['--effects', 'ENGB_EFFECTS'])
def test_an_effect_that_cannot_be_computed_is_told_before_it_is_used(
        refused, tmp_path, monkeypatch, bag, model_file, command, where):
    folder = tmp_path / 'mine'
    folder.mkdir()
    (folder / 'drag.py').write_text(DRAG, encoding='utf-8')
    monkeypatch.setenv('ENGB_EFFECTS', 'mine' if where == 'ENGB_EFFECTS' else 'none')
    given = ['--effects', 'mine'] if where == '--effects' else []
    refused(*COMMANDS[command], *given, words=[
        'mine/drag.py', "name 'VELOCTY' is not defined (line 7 of the file)"])
    (folder / 'drag.py').write_text(DRAG.replace('VELOCTY', 'VELOCITY').replace(
        'return parameters[0]', "return float(f'{parameters[0]:.9g}')"), encoding='utf-8')
    refused(*COMMANDS[command], *given, words=['mine/drag.py', 'cannot be compiled'])
    assert not (tmp_path / 'out').exists() and not (tmp_path / 'out.npz').exists()


@pytest.mark.parametrize('command', COMMANDS)
@pytest.mark.parametrize(('setting', 'words'), [
    (EffectSetting('coging', {'amplitude': 1.0}), "'coging'; did you mean cogging_torque?"),
    (EffectSetting('magic', {'amplitude': 1.0}), "unknown effect 'magic'; known: "),
    (EffectSetting('pad_creep', {'volts': 1.0}), "no parameter 'volts'; it has relaxed_fraction"),
    (EffectSetting('pad_creep', {}), 'needs the parameter relaxed_fraction'),
    (EffectSetting('cogging_torque', {'amplitud': 1.0}), 'did you mean amplitude?')])
def test_a_wrong_name_in_a_model_file_is_told_with_the_file(
        refused, bag, model_file, command, setting, words):
    dataclasses.replace(Model(), effects=(setting,)).write(model_file)
    refused(*COMMANDS[command], words=['model.yaml: ', words])
