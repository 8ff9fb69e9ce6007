# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""`import engb_core as engb`: what it offers, that it is light, and its page's example."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path
import re
import subprocess
import sys

import numpy as np
import pytest

import engb_core as engb
from engb_core.effects.catalogue import _REGISTERED, catalogue, get_effect

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / 'docs' / 'library.md'


def columns(size: int = 200) -> dict[str, np.ndarray]:
    time = np.linspace(0.0, 2.0, size)
    return {'time': time, 'position': np.sin(time), 'effort': np.cos(time)}


def in_a_process(code: str, **options) -> str:
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                          timeout=120, **options)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_importing_loads_nothing():
    loaded = in_a_process('import sys, engb_core\n'
                          'print([name for name in ("numpy", "scipy", "numba", "yaml")'
                          ' if name in sys.modules])')
    assert loaded.strip() == '[]'


def test_every_public_name_is_there_with_words():
    for name in engb.__all__:
        assert inspect.getdoc(getattr(engb, name)), name
    assert set(engb.__all__) <= set(dir(engb))
    with pytest.raises(AttributeError, match='no attribute'):
        _ = engb.nothing_of_this_name


def test_paths_are_read_and_what_is_no_recording_is_told(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = columns()
    np.savetxt('run.csv', np.stack(list(rows.values()), 1), delimiter=',', comments='',
               header='t [s],phi [rad],M [N·m]')
    model = engb.Model()
    model.save('m.yaml')
    recording = engb.read('run.csv')
    expected = engb.predict(recording, model)
    for run, nominal in (('run.csv', model), (recording, Path('m.yaml')), ('run.csv', 'm.yaml')):
        np.testing.assert_array_equal(engb.predict(run, nominal), expected)
    for call, words in (
            (lambda: engb.predict('gone.csv', model), 'gone.csv: there is no such file'),
            (lambda: engb.predict(recording, 'gone.yaml'), 'gone.yaml: cannot be read'),
            (lambda: engb.diagnose(recording, None), 'None is no model; give an engb.Model'),
            (lambda: engb.diagnose('x', model), 'x: there is no such file'),
            (lambda: engb.diagnose(3, model), 'an object of type int is no recording'),
            (lambda: engb.diagnose([recording, None], model), 'None is no recording'),
            (lambda: engb.diagnose(recording, model, holdout=['y']), 'y: there is no such file'),
            (lambda: engb.simulate(recording, {}), 'an object of type dict is no model'),
            (lambda: engb.read(None), 'None is no path'),
            (lambda: engb.load_model(None), 'None is no path; name a model file'),
            (lambda: engb.Recording(**{**rows, 'effort': ['a'] * 200}),
             'recording: effort is no row of numbers')):
        with pytest.raises(engb.InputError, match=words):
            call()


def test_a_recording_without_effort_may_be_made():
    assert not engb.Recording(**{**columns(), 'effort': None}).effort_recorded


@pytest.mark.parametrize('first', ['engb_core.diagnose.engine', 'engb_core.library'])
def test_diagnose_is_a_function_and_a_package_in_either_order(first):
    said = in_a_process(f'import {first}, engb_core as engb\n'
                        'import engb_core.diagnose.engine as engine\n'
                        'print(callable(engb.diagnose), engine.__name__)')
    assert said.split() == ['True', 'engb_core.diagnose.engine']


def test_the_page_lists_the_public_names():
    page = PAGE.read_text(encoding='utf-8')
    missing = [name for name in engb.__all__ if name not in page]
    assert not missing


def test_columns_of_different_lengths_are_told():
    with pytest.raises(engb.InputError, match='one length.*effort'):
        engb.Recording(**{**columns(), 'effort': np.zeros(3)})
    with pytest.raises(engb.InputError, match='one length'):
        engb.Recording(**{name: values[:, None] for name, values in columns().items()})


def test_a_table_and_a_bag_are_read_alike(tmp_path):
    from engb_core.io.bags.write import JointTable, write_bag
    given = columns()
    table = tmp_path / 'bench.csv'
    np.savetxt(table, np.column_stack(list(given.values())), delimiter=',', comments='',
               header='time [s],position [rad],effort [N·m]', encoding='utf-8')
    recording = engb.read(table)
    np.testing.assert_allclose(recording.position, given['position'], atol=1e-12)
    np.testing.assert_allclose(recording.effort, given['effort'], atol=1e-12)
    time = given['time']
    write_bag(tmp_path / 'bag', {'/joint_states': JointTable(
        time, given['position'], None, given['effort'])})
    bag = engb.read(tmp_path / 'bag', engb.Model())
    np.testing.assert_allclose(bag.effort, recording.effort, atol=1e-12)
    with pytest.raises(engb.InputError, match='no such file'):
        engb.read(tmp_path / 'missing.csv')


def test_reading_needs_neither_ros_nor_engb_ros(tmp_path):
    """Not even installed: the folder of engb_core alone is on the path."""
    (tmp_path / 'engb_core').symlink_to(ROOT / 'engb_core')
    given = columns()
    table = tmp_path / 'bench.csv'
    np.savetxt(table, np.column_stack(list(given.values())), delimiter=',', comments='',
               header='time [s],position [rad],effort [N·m]', encoding='utf-8')
    bag = ROOT / 'bags' / 'brake_1' / 'recording'
    said = in_a_process(f"""
import sys
sys.path.insert(0, {str(tmp_path)!r})
for name in ('engb_ros', 'rclpy', 'rosbags', 'rosidl_runtime_py'):
    sys.modules[name] = None   # importing it is an ImportError
import engb_core as engb
print(engb.__file__)
print([len(engb.read(path).time) for path in ({str(table)!r}, {str(bag)!r})])
""", cwd=tmp_path)
    where, sizes = said.splitlines()
    assert where.startswith(str(tmp_path))
    assert min(ast.literal_eval(sizes)) >= len(given['time'])


def test_an_effect_is_registered_once():
    from dataclasses import replace
    mine = replace(get_effect('torque_offset'), id='offset_of_mine')
    try:
        assert engb.effects.register(mine) is mine
        assert get_effect('offset_of_mine') is mine
        with pytest.raises(engb.InputError, match='already'):
            engb.effects.register(mine)
        with pytest.raises(engb.InputError, match='no engb_core'):
            engb.effects.register('offset')
    finally:
        _REGISTERED.clear()
        catalogue.cache_clear()


def test_the_page_example_names_the_cogging(tmp_path, monkeypatch):
    code, = re.findall(r'^```python\n(.*?)^```', PAGE.read_text(encoding='utf-8'),
                       re.MULTILINE | re.DOTALL)
    ast.parse(code)
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(code, names)
    found = names['diagnosis']
    assert [entry.effect for entry in found.effects] == ['cogging_torque']
    assert np.std(names['left']) < 0.5 * 0.01 / np.sqrt(2.0)
    assert all(row['rms_after'] < 0.5 * row['rms_before'] for row in found.compare()
               if row['quantity'] == 'effort')
    assert found.to_dict()['verdict'] == found.verdict
    assert found._repr_html_().startswith('<iframe srcdoc="')
    pytest.importorskip('matplotlib')
    assert len(found.plot().axes) == len(found.evidence.traces)
