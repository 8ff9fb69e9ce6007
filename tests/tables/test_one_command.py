# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""One command from somebody's table to the right name; the others are run by
benchmarks/ten_tables.py."""

import contextlib
import json
import os
from pathlib import Path
import pty
import subprocess
import sys

import numpy as np
import pytest

from engb_core.io.tables.measure import measured_of
from engb_core.io.tables.request import Request
from engb_core.model import Model
from engb_ros.commands import diagnose
from engb_ros.commands.main import main

from .other_benches import OTHER_TABLES
from .simulated_bench import sampled, TABLES, write_table

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize('table', TABLES, ids=[table.name for table in TABLES])
def test_each_table_becomes_the_same_recording(tmp_path, table, monkeypatch):
    assert table.questions <= 2
    made = sampled(None, table.every, 0)
    made = {name: values[:2000] for name, values in made.items()}
    path = tmp_path / table.name
    table.write(path, made)
    units = dict(word.split('=') for word in table.said if '=' in word)
    recording = measured_of(path, Request(torque_constant=0.05, units=units))[0].recording()
    np.testing.assert_allclose(recording.position - recording.position[0],
                               made['phi'] - made['phi'][0], atol=2e-5)
    np.testing.assert_allclose(recording.effort, 0.05 * made['i'], atol=1e-4)
    assert recording.interval == pytest.approx(1e-4 * table.every, rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize('table', TABLES[:2], ids=['clean', 'stribeck'])
def test_the_name(tmp_path, table):
    path = write_table(table, tmp_path)
    out = tmp_path / 'out'
    assert main(['diagnose', str(path), *table.said, '--out', str(out)]) == 0
    found = json.loads((out / 'diagnosis.json').read_text(encoding='utf-8'))
    names = [entry['effect'] for entry in found['effects']]
    assert names[:1] == ([] if table.effect is None else [table.effect])
    assert (out / 'first_model.yaml').exists() and (out / f'{path.stem}.mcap').exists()


@pytest.mark.slow
def test_a_table_whose_name_is_no_utf_8(tmp_path, monkeypatch, capsys):
    """A byte of a file's name that is no UTF-8 stops nothing: in a bag's name it is replaced."""
    monkeypatch.chdir(tmp_path)
    path = os.fsdecode(b'b\xffse.csv')
    os.rename(write_table(TABLES[0], tmp_path), path)
    assert main(['diagnose', path, '--torque-constant', '0.05', '--out', 'out']) == 0
    assert (tmp_path / 'out' / 'b_se.mcap').exists()
    found = json.loads((tmp_path / 'out' / 'diagnosis.json').read_text(encoding='utf-8'))
    assert {entry['recording'] for entry in found['fit']['held_out']} == {'b\\xffse'}
    told = capsys.readouterr().out
    assert 'b\\xffse.csv: time' in told and told.count('position: column') == 1


def test_recordings_come_before_between_and_behind_what_is_said_of_them(monkeypatch):
    """An option that takes several NAME=VALUE takes no recording that follows them."""
    taken = []
    monkeypatch.setattr(diagnose, 'run', taken.append)
    said = ['--column', 'time=t', 'effort=M', '--unit', 'position=deg']
    for words in (['a.csv', 'b.csv', *said], [*said, 'a.csv', 'b.csv'],
                  ['a.csv', *said, 'b.csv'], ['--column', 'time=t', 'effort=M', 'a.csv', '--unit',
                                              'position=deg', 'b.csv'],
                  ['--column=time=t', '--column', 'effort=M', 'a.csv', '--unit=position=deg',
                   'b.csv']):
        assert main(['diagnose', *words, '--out', 'x']) == 0
        found = taken.pop()
        assert found.recordings == ['a.csv', 'b.csv']
        assert (found.column, found.unit) == (['time=t', 'effort=M'], ['position=deg'])
        assert found.command_line == ('engb', 'diagnose', *words, '--out', 'x')


def test_a_recording_with_an_equals_sign_is_one(monkeypatch, tmp_path):
    taken = []
    monkeypatch.setattr(diagnose, 'run', taken.append)
    monkeypatch.chdir(tmp_path)
    Path('speed=3.csv').touch()
    assert main(['diagnose', '--column', 'time=t', 'speed=3.csv', '--out', 'x']) == 0
    assert (taken[0].recordings, taken[0].column) == (['speed=3.csv'], ['time=t'])


def test_no_recording_at_all_is_told(capsys):
    assert main(['diagnose', '--column', 'time=t', 'effort=M', '--out', 'x']) == 2
    assert 'RECORDING' in capsys.readouterr().err


def test_what_is_no_recording_of_a_machine_is_told_in_one_line(tmp_path, capsys):
    """Not below lines of which column was taken for what."""
    time = np.arange(500) / 1000.0
    path = tmp_path / 'bench.csv'
    path.write_text('t [s],phi [rad],M [Nm]\n' + ''.join(
        f'{t:.3f},{np.sin(9.0 * t):.6f},0.05\n' for t in time))
    assert main(['diagnose', str(path), '--out', str(tmp_path / 'out')]) == 2
    told = capsys.readouterr()
    assert told.out == '' and len(told.err.splitlines()) == 1
    assert 'effort is 0.05 N·m in all 500 samples' in told.err


@pytest.mark.parametrize('how', ['no model', 'model'])
def test_too_little_motion_is_told_in_one_line(tmp_path, capsys, how):
    path = tmp_path / 'bench.csv'
    path.write_text('t [s],phi [rad],M [Nm]\n' + ''.join(
        f'{n / 1000.0:.3f},3.0,{0.05 + 0.01 * np.sin(n):.5f}\n' for n in range(500)))
    Model().write(tmp_path / 'model.yaml')
    given = ['--model', str(tmp_path / 'model.yaml')] if how == 'model' else []
    assert main(['diagnose', str(path), *given, '--out', str(tmp_path / 'out')]) == 2
    told = capsys.readouterr()
    assert told.out == '' and len(told.err.splitlines()) == 1
    assert 'bench' in told.err and 'too little motion' in told.err


@pytest.mark.parametrize('table', OTHER_TABLES, ids=[table.name for table in OTHER_TABLES])
def test_each_table_of_a_drive_becomes_the_same_recording(tmp_path, table):
    """Their simulation is benchmarks/ten_tables.py's; here a motion of the same kind is read."""
    assert table.questions <= 2
    time = 1e-3 * np.arange(2000)
    made = {'t': time, 'phi': 9.0 * np.sin(4.0 * time) + 2.0, 'i': 2.0 * np.cos(11.0 * time),
            'goal': 9.0 * np.sin(4.0 * time + 0.1) + 2.0}
    path = tmp_path / table.name
    table.write(path, made)
    said = dict(zip(table.said[::2], table.said[1::2], strict=True))
    units = dict([said['--unit'].split('=')]) if '--unit' in said else {}
    constant = float(said.get('--torque-constant', '0.06'))
    recording = measured_of(path, Request(torque_constant=constant, units=units))[0].recording()
    gear = {'elbow.csv': 50.0, 'slide.tsv': 2.0 * np.pi / 0.01}.get(table.name, 1.0)
    position = np.interp(recording.time, time, made['phi']) / gear
    effort = np.interp(recording.time, time, made['i']) * 0.06 * gear
    np.testing.assert_allclose(recording.position - recording.position[0],
                               position - position[0], atol=2e-4)
    np.testing.assert_allclose(recording.effort, effort, atol=1e-3 * gear)


def at_a_terminal(arguments, answers, folder):
    """Run `engb` at a terminal of its own, answer each question; return what stood there."""
    here, there = pty.openpty()
    running = subprocess.Popen([sys.executable, '-m', 'engb_ros.commands.main', *arguments],
                               stdin=there, stdout=there, stderr=there, cwd=folder,
                               env=os.environ | {'PYTHONPATH': str(ROOT)})
    os.close(there)
    shown = ''
    for question, answer in answers:
        while question not in shown:
            shown += os.read(here, 4096).decode()
        os.write(here, f'{answer}\n'.encode())
    with contextlib.suppress(OSError):      # EIO: the other end is closed
        while part := os.read(here, 4096):
            shown += part.decode()
    os.close(here)
    assert running.wait() == 0, shown
    return shown


def test_an_answer_at_the_terminal_is_what_the_model_says(tmp_path):
    """The torque constant went into torques, and not into the model's motor."""
    rng = np.random.default_rng(1)
    time = np.arange(4000) / 1000.0
    angle = 200.0 * np.sin(7.0 * time) + 90.0 * np.sin(17.0 * time)
    current = 1e-4 * np.gradient(np.gradient(np.deg2rad(angle), time), time) / 0.07
    current += 0.3 * np.sign(np.gradient(angle)) + rng.normal(0.0, 0.01, time.size)
    (tmp_path / 'bench.csv').write_text('t [s],phi [deg],I [A]\n' + ''.join(
        f'{t:.3f},{a:.3f},{i:.4f}\n' for t, a, i in zip(time, angle, current, strict=True)))
    shown = at_a_terminal(['model', 'bench.csv', '--out', 'model.yaml'],
                          [('What is the torque constant', '0.07')], tmp_path)
    assert Model.read(tmp_path / 'model.yaml').motor.torque_constant == 0.07
    assert 'could not be told: the torque constant' not in shown
    # The question has a line of its own.
    assert '\r\033[KWhat is the torque constant' in shown


def test_a_slip_at_the_terminal_is_told_and_asked_for_again(tmp_path):
    time = np.arange(400) / 100.0
    for name, titles in (('named.csv', 't [s],position,effort'), ('bench.csv', 't [s],a,b')):
        (tmp_path / name).write_text(titles + '\n' + ''.join(
            f'{t:.2f},{np.sin(3 * t):.6f},{np.cos(3 * t):.6f}\n' for t in time))
    shown = at_a_terminal(
        ['import', 'named.csv', '--out', 'run1'],
        [('What is the unit of position', 'furlong'), ('not a known unit', 'rad'),
         ('What is the unit of effort', 'Nm')], tmp_path)
    assert shown.count('What is the unit of position') == 2
    assert (tmp_path / 'run1' / 'metadata.yaml').exists()
    shown = at_a_terminal(
        ['import', 'bench.csv', '--out', 'run2'],
        [('Which column is position', 'a'), ('Which column is effort', 'b')], tmp_path)
    assert 'What is which' not in shown and '\r\033[KWhich column' in shown
    # What is being done is told, at the terminal alone.
    assert 'reading bench.csv' in shown and 'writing 400 samples' in shown
