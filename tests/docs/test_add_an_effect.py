# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The page about effects of one's own, followed literally; and what is said of bad ones."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from pathlib import Path
import re

import pytest

from engb_core.effect_check import faults_of_effect
from engb_core.effects import catalogue as effects
from engb_core.errors import InputError
from engb_ros.commands.main import main

PAGE = Path(__file__).resolve().parents[2] / 'docs' / 'add-an-effect.md'
CODE, = re.findall(r'^```python\n(.*?)^```', PAGE.read_text(encoding='utf-8'),
                   re.MULTILINE | re.DOTALL)


@pytest.fixture(autouse=True)
def alone(tmp_path, monkeypatch):
    """Each test in a folder of its own, with no effects from elsewhere, before or after."""
    monkeypatch.setenv('ENGB_EFFECTS', str(tmp_path / 'none'))
    monkeypatch.setattr(effects, '_REGISTERED', {})
    monkeypatch.chdir(tmp_path)
    effects.catalogue.cache_clear()
    yield
    effects.catalogue.cache_clear()


def written(text: str) -> Path:
    path = Path('my_effects') / 'cable_drag.py'
    path.parent.mkdir()
    path.write_text(text, encoding='utf-8')
    return path


def test_the_page_s_effect_is_fit_and_found(capsys):
    path = written(CODE)
    command, = re.findall(r'^    engb (check-effect .*)$', PAGE.read_text(encoding='utf-8'),
                          re.MULTILINE)
    assert main(command.split()) == 0
    assert 'cable_drag: fit for use' in capsys.readouterr().out
    assert 'cable_drag' not in effects.catalogue()
    assert effects.read_effects_of(path.parent) == ('cable_drag',)
    assert 'cable_drag' in effects.catalogue()


BAD = {
    'unit': ("'N·m·s/rad²'", "''", 'the unit is empty'),
    'bounds': ('-1e-3, 1e-3', '1e-3, -1e-3', 'are no range'),
    'start': ('starts=(2e-4,)', 'starts=(2.0,)', 'outside its bounds'),
    'stage': ("stages={'torque'", "stages={'wind'", 'no stage'),
    'finite': ('* sample[VELOCITY]', '* max(sample[VELOCITY], 0.0) ** -1.0', 'gives|computed'),
    'none': ('none=0.0, ', '', 'at which the effect vanishes'),
    'vanishes': ('none=0.0', 'none=1e-4', 'it should vanish'),
    'nothing': ('starts=(2e-4,)', 'starts=(1e-12,)', 'next to nothing'),
    'a name that is nowhere': ('if beyond <=', 'if beyound <=',
                               r"cannot be computed.*beyound.*\(line 1\d of the file\)"),
    'a place that is nowhere': ('sample[VELOCITY]', 'state[72]',
                                r'torque .*out of bounds.*\(line 1\d of the file\)'),
    'not compiled': ('return parameters[0] *', "return float(f'{parameters[0]:.17g}') *",
                     'torque cannot be compiled'),
    'statement': ("p['begin']", "p['beginning']", "statement .*beginning"),
    'two definitions': ('return parameters[0] * beyond * sample[VELOCITY]',
                        'state[0] += 1.0\n    return parameters[0] * state[0]', 'differ|ran away'),
}


@pytest.mark.parametrize('name', BAD)
def test_a_fault_is_told_in_words(name, capsys):
    old, new, expected = BAD[name]
    assert old in CODE
    assert main(['check-effect', str(written(CODE.replace(old, new)))]) == 2
    said = capsys.readouterr()
    assert re.search(expected, said.out + said.err), said


@pytest.mark.parametrize('name', ['asymmetric_friction', 'pad_friction_fade', 'pad_creep'])
def test_effects_of_the_library_are_fit(name):
    assert faults_of_effect(effects.get_effect(name)) == []


def test_a_file_that_is_no_effect(capsys):
    assert main(['check-effect', str(written('EFFECT = 1'))]) == 2
    assert 'EFFECT is no Effect' in capsys.readouterr().err
    assert main(['check-effect', 'missing.py']) == 2


def test_a_folder_is_checked_file_by_file(capsys):
    folder = written(CODE).parent
    (folder / 'second.py').write_text(CODE.replace('cable_drag', 'rope_drag').replace(
        "'N·m·s/rad²'", "''"), encoding='utf-8')
    assert main(['check-effect', str(folder)]) == 2
    said = capsys.readouterr().out
    assert 'cable_drag: fit for use' in said and 'rope_drag: drag_slope: the unit is empty' in said
    (folder / 'second.py').unlink()
    assert main(['check-effect', str(folder)]) == 0


def test_what_a_sample_holds_is_told_with_its_unit():
    from engb_core.effects import base
    text = base.__doc__
    places = [name for name in base.__all__ if isinstance(getattr(base, name), int)
              and name not in ('SAMPLE_SIZE', 'STATE_SIZE')]
    assert len(places) == base.SAMPLE_SIZE
    for name in places:
        assert re.search(rf'^    {name}\b.*\[[^\]]+\]$', text, re.MULTILINE), name


def test_a_package_brings_an_effect_by_its_entry_point(monkeypatch, tmp_path):
    path = written(CODE)
    monkeypatch.syspath_prepend(str(path.parent))
    entry = EntryPoint('cable_drag', 'cable_drag:EFFECT', effects.GROUP)
    monkeypatch.setattr(effects, 'entry_points', lambda group: [entry])
    assert effects.get_effect('cable_drag').title == 'Cable drag'
    effects.catalogue.cache_clear()
    entry = EntryPoint('cable_drag', 'cable_drag:_torque', effects.GROUP)
    with pytest.raises(InputError, match='is no Effect'):
        effects.catalogue()


def test_a_folder_without_effects_is_told(tmp_path):
    with pytest.raises(InputError, match='no folder'):
        effects.read_effects_of(tmp_path / 'missing')
    with pytest.raises(InputError, match='holds no effect'):
        effects.read_effects_of(tmp_path)


def test_diagnose_and_predict_take_the_folder(capsys):
    from engb_ros.commands import diagnose, predict
    from engb_ros.commands.main import _parser
    for module, words in ((diagnose, ['run1', '--out', 'x']),
                          (predict, ['run1', '--model', 'm.yaml', '--out', 'x.npz'])):
        parser = _parser('engb', 'x')
        module.add_arguments(parser)
        parser.parse_args([*words, '--effects', 'my_effects'])
    written(CODE)
    Path('m.yaml').write_text('format: engb-model/1\nmotor: {inertia: 7.0e-5, '
                              'viscous_friction: 1.0e-3}\neffects:\n- effect: cable_drag\n'
                              '  parameters: {drag_slope: 1.0e-4, begin: 1.0}\n', encoding='utf-8')
    status = main(['predict', 'missing', '--model', 'm.yaml', '--effects', 'my_effects',
                   '--out', 'x.npz'])
    assert status == 2
    assert 'cable_drag' in effects.catalogue()
