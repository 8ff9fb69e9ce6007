# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The page about effects of one's own, followed literally; and what is said of bad ones."""

from __future__ import annotations

from importlib.metadata import EntryPoint
import json
import math
import os
from pathlib import Path
import re
import subprocess
import sys

import numpy as np
import pytest

from engb_core.effect_check import faults_of_effect
from engb_core.effects import catalogue as effects
from engb_core.errors import InputError
from engb_core.io.bags.write import JointTable, write_bag
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
    'id': ("id='cable_drag'", "id='Cable-Drag'", 'use small letters, digits and _'),
    'title': ("title='Cable drag'", "title=' '", 'title is empty: the report quotes it'),
    'no stage': ("stages={'torque': _torque}", 'stages={}', 'give a function for one of shift'),
    'one name twice': ("'begin', 'rad'", "'drag_slope', 'rad'", 'have one name'),
    'logarithm of nought': ('starts=(2e-4,)', 'starts=(2e-4,), logarithmic=True',
                            'must be above 0'),
    'no start': ('starts=(2.0, 8.0)', 'starts=()', 'begin: give starts='),
    'an empty sentence': ('''lambda p: (f"From {p['begin']:.3g} rad on a cable drags by "
                         f"{p['drag_slope']:.2g} N·m·s/rad per rad."),''', "lambda p: '',",
                          'statement gives no sentence'),
    'it runs away': ('parameters[0] * beyond * sample[VELOCITY]',
                     '-1e4 * parameters[0] * beyond * sample[VELOCITY]', 'ran away|differ'),
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


def cable_bench(seed: int, drag_slope: float, begin: float) -> JointTable:
    """Record a drive under a PD loop whose cable drags: a plant of the test's own, set-valued
    friction at 10 kHz, recorded at 1 kHz by an encoder that counts and a noisy current."""
    rng = np.random.default_rng(seed)
    waves = list(zip((0.23, 0.71, 1.9), rng.uniform(0.9, 1.1, 3) * (4.0, 2.0, 0.7),
                     rng.uniform(0.0, 6.28, 3), strict=True))
    inertia, viscous, coulomb, step = 7e-5, 1e-3, 0.012, 1e-4
    angle = 8.0 + sum(size * math.sin(phase) for _, size, phase in waves)
    speed, rows = 0.0, []
    for count in range(160_000):
        time = count * step
        turns = [(6.2832 * rate, size, phase) for rate, size, phase in waves]
        goal = 8.0 + sum(size * math.sin(rate * time + phase) for rate, size, phase in turns)
        wanted = sum(rate * size * math.cos(rate * time + phase) for rate, size, phase in turns)
        effort = 0.05 * (goal - angle) + 0.004 * (wanted - speed)
        if count % 10 == 0:
            rows.append((time, angle, effort))
        drag = (viscous + drag_slope * max(angle - begin, 0.0)) * speed
        free = speed + step * (effort - drag) / inertia
        most = step * coulomb / inertia
        speed = 0.0 if abs(free) <= most else free - math.copysign(most, free)
        angle += step * speed
    time, position, effort = np.array(rows).T
    count = 2.0 * np.pi / 16384
    return JointTable(1.7e9 + time, position=np.round(position / count) * count,
                      effort=effort + rng.normal(0.0, 2e-4, effort.size))


@pytest.mark.slow
@pytest.mark.parametrize('drag_slope, begin', [(2e-4, 6.0), (-6e-5, 9.0)])
def test_it_is_found_where_it_is_hidden(drag_slope, begin):
    """What the page's effect says is hidden in recordings of a plant that does not know the
    library; the diagnosis names it first, with its numbers, and the corrected model predicts."""
    written(CODE)
    for seed in (1, 2, 3):
        write_bag(f'run{seed}', {'joint_states': cable_bench(seed, drag_slope, begin)})
    Path('nominal.yaml').write_text(
        'format: engb-model/1\nmotor: {inertia: 7.0e-5, viscous_friction: 1.0e-3}\n'
        'friction: {coulomb: 0.012, saturation_velocity: 0.2}\n', encoding='utf-8')
    command, = re.findall(r'`engb (diagnose run1 .*?)`', PAGE.read_text(encoding='utf-8'))
    first, *rest = command.split()
    assert main([first, 'run2', *rest, '--holdout', 'run3']) == 0
    found = json.loads(Path('result', 'diagnosis.json').read_text(encoding='utf-8'))
    names = [entry['effect'] for entry in found['effects']]
    assert names[:1] == ['cable_drag'], found['effects']
    effect = found['effects'][0]
    assert effect['probability'] > 0.5
    assert effect['parameters']['drag_slope']['value'] == pytest.approx(drag_slope, rel=0.05)
    assert effect['parameters']['begin']['value'] == pytest.approx(begin, abs=0.3)
    assert 'a cable drags' in effect['statement']
    assert 'Cable drag' in Path('result', 'report.html').read_text(encoding='utf-8')
    for entry in found['fit']['held_out']:
        assert entry['rms_after'] < 0.5 * entry['rms_before']
    # In processes of their own: the corrected model predicts with the folder, and what is missing
    # without it is told.
    predict = [sys.executable, '-m', 'engb_ros.commands.main', 'predict', 'run3', '--model',
               'result/model.yaml', '--out', 'run3.npz']
    environment = {**os.environ, 'PYTHONPATH': str(PAGE.parents[1])}
    assert not subprocess.run([*predict, '--effects', 'my_effects'], env=environment).returncode
    refused = subprocess.run(predict, env=environment, capture_output=True, text=True)
    assert (refused.returncode, refused.stderr.count('\n')) == (2, 1)
    assert 'cable_drag' in refused.stderr


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
