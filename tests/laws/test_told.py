# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How a law is told: the line with units, the report, diagnosis.json, and its own name."""

from __future__ import annotations

from dataclasses import replace
import importlib.util
import json

import numpy as np
import pytest

from engb_core.diagnose.diagnosis import LawFinding, LawPicture, ParameterEstimate
from engb_core.diagnose.document import to_document, to_json
from engb_core.effects.catalogue import catalogue
from engb_core.laws.dimensions import divided, written
from engb_core.laws.grammar import parse
from engb_core.laws.line import line_of, LONGEST_LINE, with_error
from engb_core.model import EffectSetting, LoadTorque, Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.physics.sample_table import sample_table
from engb_core.report.page import diagnosis_page
from tests.report.samples import unexplained

PATTERN = 'a * abs(load) * sin(b * position + c)'


def law() -> LawFinding:
    centre = np.linspace(0.0, 20.0, 30)
    wave = 0.01 * np.sin(1.249 * centre)
    return LawFinding(
        '0.031 * abs(load) * sin(1.249 * position + 3.84)', PATTERN, 'torque',
        {'a': ParameterEstimate(0.031, 0.002, 'N·m/N·m'), 'b': ParameterEstimate(
            1.249, 0.001, '1/rad'), 'c': ParameterEstimate(3.84, 0.05, 'rad')},
        'T = 0.031(2) · |load| · sin(1.249(1) 1/rad · position + 3.84(5) rad)',
        'A torque that depends on the load and the position.', ('load_gain: 0.03 * position',),
        True, 0.97, LawPicture('position', 'rad', centre, (wave, wave), (wave, wave),
                               (0.1 * wave, np.full(30, np.nan))))


def told():
    diagnosis = unexplained()
    return replace(diagnosis, unexplained=replace(diagnosis.unexplained, law=law()))


def test_the_document_holds_the_law():
    document = json.loads(to_json(told()))['unexplained']['law']
    assert document['formula'] == '0.031 * abs(load) * sin(1.249 * position + 3.84)'
    assert document['acts_as'] == 'torque'
    assert document['parameters']['b'] == {'value': 1.249, 'std': 0.001, 'unit': '1/rad'}
    assert document['alternatives'] == ['load_gain: 0.03 * position']
    assert 'law' not in to_document(unexplained())['unexplained']


@pytest.mark.parametrize('backend', ['plotly', 'matplotlib', 'table'])
def test_the_report_shows_points_law_and_rest(backend):
    if backend != 'table':
        pytest.importorskip(backend)
    text = diagnosis_page(told(), backend=backend).html()
    assert 'A law for it' in text and 'sin(1.249(1)' in text
    assert 'the law through it, over position' in text
    assert 'load_gain: 0.03' in text


@pytest.mark.parametrize(('value', 'std', 'unit', 'wanted'), [
    (0.031, 0.002, 'N·m', '0.031(2) N·m'), (1.2493, 0.0011, '-', '1.249(1)'),
    (-3.84, 0.05, 'rad', '-3.84(5) rad'), (3.5e-5, 4e-7, 'kg·m²', '3.50(4)e-5 kg·m²'),
    (1234.0, 56.0, 's', '1230(60) s'), (2.0, None, 's', '2 s'), (2.0, 5.0, 's', '2 s'),
    (0.999, 0.0996, '-', '1.0(1)'),
])
def test_standard_errors_in_the_last_digit(value, std, unit, wanted):
    assert with_error(ParameterEstimate(value, std, unit)) == wanted


def estimated(**values: tuple[float, float, str]) -> dict[str, ParameterEstimate]:
    return {name: ParameterEstimate(*entry) for name, entry in values.items()}


def test_a_law_is_one_short_line():
    """Sizes with unit and standard error, shapes' numbers with errors where there is room."""
    assert line_of('torque', parse(PATTERN), estimated(
        a=(0.031, 0.002, 'N·m'), b=(1.249, 0.001, '1/rad'), c=(3.84, 0.05, 'rad'))).text == (
            'T = 0.031(2) N·m · |load| · sin(1.249(1) θ + 3.84(5))')
    peak = line_of('torque', parse('a * peak(velocity / b) * step(position - c, d)'), estimated(
        a=(0.0079, 1e-4, 'N·m'), b=(16.4, 0.3, 'rad/s'), c=(-21.27, 0.02, 'rad'),
        d=(0.0703, 0.02, 'rad'))).text
    assert peak == 'T = 0.0079(1) N·m · peak(ω/16.4) · step(θ + 21.27, 0.07)'
    assert len(peak) <= LONGEST_LINE
    assert line_of('delay', parse('a * (abs(load) + b)'), estimated(
        a=(0.02, 0.001, 's/N·m'), b=(1.0, 0.1, 'N·m'))).text == (
            'delay = 0.020(1) s/N·m · (|load| + 1.0(1))')


def test_units():
    assert written(divided((('N·m', 1),), (('rad/s', 2),))) == 'N·m/((rad/s)²)'
    assert written(divided((('N·m', 1),), (('N·m', 1),))) == '-'
    assert written((('s', 1), ('rad', -1))) == 's/rad'


@pytest.fixture
def result(tmp_path):
    """What `engb diagnose` would have written."""
    folder = tmp_path / 'result'
    folder.mkdir()
    (folder / 'diagnosis.json').write_text(to_json(told()), encoding='utf-8')
    replace(Model(), effects=(EffectSetting(
        'law', {'a': 0.031, 'b': 1.249, 'c': 3.84}, PATTERN, 'torque',
        {'position': (0.0, 20.0), 'velocity': (-30.0, 30.0)}),)).write(folder / 'model.yaml')
    return folder


@pytest.fixture
def own(tmp_path, monkeypatch):
    """An empty folder of effects of one's own."""
    folder = tmp_path / 'own'
    monkeypatch.setenv('ENGB_EFFECTS', str(folder))
    catalogue.cache_clear()
    yield folder
    monkeypatch.undo()
    catalogue.cache_clear()


def run(*arguments: object) -> int:
    from engb_ros.commands.main import main
    return main([str(entry) for entry in arguments])


def test_adopted_it_has_a_name(result, own, capsys):
    assert run('adopt', result, '--name', 'screw_lead_error') == 0
    assert 'screw_lead_error.py' in capsys.readouterr().out
    catalogue.cache_clear()
    effect = catalogue()['screw_lead_error']
    assert [entry.name for entry in effect.parameters] == ['a', 'b', 'c']
    assert effect.parameters[1].unit == '1/rad'
    time = np.arange(0.0, 3.0, 1e-3)
    samples = sample_table(1e-3, time, 10.0 + 8.0 * np.sin(time), 8.0 * np.cos(time),
                           -8.0 * np.sin(time))
    base = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3)))
    as_law = replace(base, effects=Model.read(result / 'model.yaml').effects)
    by_name = replace(base, effects=(EffectSetting(
        'screw_lead_error', {'a': 0.031, 'b': 1.249, 'c': 3.84}),))
    efforts = [effort_of_motion(samples.copy(), 1e-3, physics_of(model))
               for model in (base, as_law, by_name)]
    assert np.array_equal(efforts[1], efforts[2])
    assert np.ptp(efforts[1] - efforts[0]) > 1e-5


def test_its_own_test_passes(result, own):
    assert run('adopt', result, '--name', 'screw_lead_error') == 0
    spec = importlib.util.spec_from_file_location('own_test', own / 'test_screw_lead_error.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.test_nothing_without_its_size()
    module.test_it_lies_within_its_bounds()


@pytest.mark.parametrize(('name', 'words'), [
    ('stribeck_friction', 'already'), ('Bad Name', '--name'), ('import', '--name'),
    ('../up', '--name'),
])
def test_a_name_that_cannot_be(result, own, capsys, name, words):
    assert run('adopt', result, '--name', name) == 2
    error = capsys.readouterr().err
    assert words in error and error.count('\n') == 1
    assert not own.exists() or not list(own.iterdir())


def test_no_law_no_effect(result, own, capsys):
    (result / 'diagnosis.json').write_text(to_json(unexplained()), encoding='utf-8')
    assert run('adopt', result, '--name', 'something') == 2
    assert 'no law was found' in capsys.readouterr().err


def test_a_file_that_somebody_wrote_is_not_replaced(result, own, capsys):
    own.mkdir()
    (own / 'mine.py').write_text('EFFECT = None\n', encoding='utf-8')
    assert run('adopt', result, '--name', 'mine') == 2
    assert (own / 'mine.py').read_text(encoding='utf-8') == 'EFFECT = None\n'
    assert 'mine.py' in capsys.readouterr().err
