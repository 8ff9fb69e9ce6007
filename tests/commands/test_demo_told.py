# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the demo chooses, prints and compares, without its nodes."""

from dataclasses import replace

import pytest

from engb_core.errors import InputError
from engb_core.model import Cogging, LoadTorque, Model
from engb_ros.commands import demo


@pytest.fixture
def parts(monkeypatch):
    """Put notes in the place of the parts that take minutes; return which were run."""
    pytest.importorskip('rclpy')
    run = []

    def record(bag, rate):
        run.append(('record', rate))
        bag.mkdir()
        (bag / 'strokes.mcap').write_bytes(b'x')

    def identify(bag, model):
        run.append(('identify', bag.name))
        model.write_text('x')

    monkeypatch.setattr(demo, '_record', record)
    monkeypatch.setattr(demo, '_identify', identify)
    monkeypatch.setattr(demo, '_diagnose',
                        lambda chosen, out: run.append(('diagnose', chosen.name)))
    return run


def test_the_parts_come_in_their_order_and_their_places_are_told(engb, parts, tmp_path):
    outcome = engb('demo', '--out', 'out', '--bag', 'brake_2', '--rate', '250')
    assert outcome.status == 0, outcome
    assert parts == [('record', 250.0), ('identify', 'strokes'), ('diagnose', 'brake_2')]
    assert (tmp_path / 'out' / 'strokes').is_dir() and (tmp_path / 'out' / 'model.yaml').is_file()
    for name in ('out/strokes', 'out/model.yaml', 'out/diagnosis/report.html'):
        assert name in outcome.out


def test_without_recordings_beside_the_package_the_diagnosis_is_left_out(engb, parts, tmp_path,
                                                                         monkeypatch):
    monkeypatch.setattr(demo, 'BAGS', tmp_path / 'none')
    outcome = engb('demo', '--out', 'out')
    assert [name for name, _ in parts] == ['record', 'identify']
    assert 'the diagnosis part is left out' in outcome.out and 'report.html' not in outcome.out
    with pytest.raises(InputError, match='--bag brake_2: there is none'):
        demo._chosen_bag('brake_2')


def test_an_unknown_recording_is_told_with_those_there_are(refused, parts):
    refused('demo', '--out', 'out', '--bag', 'brake_0', words=['--bag brake_0', 'brake_1'])
    assert parts == []


def compared(model, true):
    return {name: (identified, truth)
            for name, _, identified, truth in demo._compared(model, true)}


def test_numbers_stand_beside_the_true_ones():
    model = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3), contact_angle=2.0),
                  cogging=(Cogging(3.0, 1e-4), Cogging(7.0, 1e-3)))
    true = replace(model, load_torque=LoadTorque(coefficients=(0.0, 2e-3), contact_angle=3.0),
                   cogging=(Cogging(7.0, 2e-3),))
    found = compared(model, true)
    assert found['contact angle'] == (2.0, 3.0)
    assert found['load torque at 12 rad'] == pytest.approx((0.010, 0.018))
    assert found['cogging order'] == (7.0, 7.0) and found['cogging amplitude'] == (1e-3, 2e-3)
    plain = compared(replace(model, cogging=()), true)
    assert 'cogging order' not in plain
    free = compared(replace(model, load_torque=LoadTorque()), true)
    assert 'contact angle' not in free and free['load torque at 36 rad'][0] == 0.0


@pytest.mark.parametrize('terminal', [True, False])
def test_progress_stays_in_its_line_on_a_terminal_and_is_rare_elsewhere(capsys, monkeypatch,
                                                                        terminal):
    monkeypatch.setattr('sys.stdout.isatty', lambda: terminal)
    with demo._line() as show:
        for part in 'abc':
            show(part)
    assert capsys.readouterr().out == ('\ra\rb\rc\n' if terminal else 'a\n')
