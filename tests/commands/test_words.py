# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the program says to a terminal, a spreadsheet and a user who lacks a package."""

import csv
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from engb_core.diagnose.diagnosis import EffectFinding, QualityOfFit
from engb_core.io.bags.write import JointTable, write_bag
from engb_core.model import Model
from engb_ros.commands.diagnose import summary
from engb_ros.fleet.row_files import write_table

from .conftest import motion, ROOT
from .test_diagnose import DIAGNOSIS


def process(*arguments, cwd, **environment):
    """Run `engb` as a process; bytes, as a terminal gets them."""
    return subprocess.run(
        [sys.executable, '-m', 'engb_ros.commands.main', *map(os.fsencode, arguments)], cwd=cwd,
        env=os.environ | {'PYTHONPATH': str(ROOT)} | environment, capture_output=True)


@pytest.fixture
def table(tmp_path):
    """A bench's table with a title that few terminals can show."""
    run = motion(400)
    path = tmp_path / 't.csv'
    np.savetxt(path, np.column_stack([run['time'], run['position'], run['effort']]), '%.17g', ',',
               header='t [s],θ→ist [rad],M [N·m]', comments='', encoding='utf-8')
    return path


@pytest.mark.parametrize('coding', ['latin-1', 'ascii', 'cp1252', 'utf-8'])
def test_a_terminal_of_any_coding(tmp_path, table, coding):
    outcome = process('import', table.name, '--out', 'run', cwd=tmp_path,
                      PYTHONIOENCODING=coding)
    assert (outcome.returncode, outcome.stderr) == (0, b'')
    assert 'ist [rad]' in outcome.stdout.decode(coding)
    refused = process('import', table.name, '--out', 'other', '--column', 'position=φ',
                      cwd=tmp_path, PYTHONIOENCODING=coding)
    assert (refused.returncode, refused.stderr.count(b'\n')) == (2, 1)
    refused.stderr.decode(coding)


def test_a_path_that_is_no_utf_8(tmp_path, table):
    """Computed, and told with the byte as an escape; the data reach their place."""
    odd = os.fsdecode(os.path.join(os.fsencode(tmp_path), b'b\xffse'))
    os.mkdir(odd)
    os.rename(table, os.path.join(odd, 't.csv'))
    Model().write(tmp_path / 'model.yaml')
    made = process('import', 't.csv', '--out', os.path.join(odd, 'run'), cwd=odd)
    assert (made.returncode, made.stderr) == (0, b''), made
    for coding in ('utf-8', 'latin-1'):
        done = process('predict', os.path.join(odd, 'run'), '--model', 'model.yaml', '--out',
                       os.path.join(odd, f'{coding}.npz'), cwd=tmp_path, PYTHONIOENCODING=coding)
        assert (done.returncode, done.stderr) == (0, b''), done
        assert b'b\\xffse' in done.stdout
        assert os.path.exists(os.path.join(odd, f'{coding}.npz'))


def test_names_out_of_a_file_do_not_steer_the_terminal(tmp_path):
    run = motion(400)
    joint = JointTable(run['time'], run['position'], None, run['effort'])
    bag = tmp_path / 'run'
    write_bag(bag, {'/a\x1b[2J/joint_states': joint, '/b\r\x9b31m\u202e/joint_states': joint})
    table = tmp_path / 't.csv'
    table.write_text('\x1b[31mt [s],\x07phi [deg],\u202eI [A]\n'
                     + ''.join(f'{n},{n % 3},1\n' for n in range(30)))
    Model().write(tmp_path / 'model.yaml')
    told = b''
    for arguments in (('predict', 'run', '--model', 'model.yaml', '--out', 'x.npz'),
                      ('import', '--list', 't.csv'), ('import', 't.csv', '--out', 'y'),
                      ('import', 't.csv', '--torque-constant', '1', '--out', 'y\x1b[31m',
                       '--joint', 'j\x07'),
                      ('export', 'model.yaml', '--to', 'json', '--out', 'z\x1b[31m\nz')):
        outcome = process(*arguments, cwd=tmp_path)
        told += outcome.stdout + outcome.stderr
    text = told.decode()
    assert 'x1b' in text
    assert {character for character in text if not character.isprintable()} == {'\n'}


def test_a_survey_holds_no_formula(tmp_path):
    names = ['=1+1', '+1', '-2+3', '@SUM(A1)', '\t=1', '\r=1', 'plain']
    write_table(tmp_path / 'survey', [{'recording': name, 'share': -0.5} for name in names])
    with open(tmp_path / 'survey.csv', encoding='utf-8', newline='') as file:
        rows = list(csv.DictReader(file))
    assert [row['recording'] for row in rows] == [
        "'=1+1", "'+1", "'-2+3", "'@SUM(A1)", "'\\x09=1", "'\\x0d=1", 'plain']
    assert {row['share'] for row in rows} == {'-0.5'}       # a number stays one


@pytest.mark.parametrize('place', ['top', 'deep'])
def test_a_key_given_twice_is_told(refused, tmp_path, bag, place):
    text = (tmp_path / 'model.yaml')
    Model().write(text)
    content = text.read_text()
    text.write_text(content + 'motor: {inertia: 1.0, viscous_friction: 0.0}\n' if place == 'top'
                    else content.replace('  inertia:', '  inertia: 1.0\n  inertia:'))
    refused('predict', bag, '--model', text, '--out', 'x.npz',
            words=['model.yaml', 'motor' if place == 'top' else 'inertia', 'twice', 'line'])


@pytest.mark.parametrize(('after', 'words'), [
    (0.0049, 'effort down to the noise floor'), (0.0129, 'effort down to 2.8 noise floors'),
    (0.023, 'down to 5.0 noise floors')])
def test_the_noise_floor_is_claimed_where_it_is_reached(after, words):
    from dataclasses import replace
    told = summary(replace(DIAGNOSIS, held_out=(
        QualityOfFit('run2', 'effort', 0.21, after, 0.0046, 'N·m'),)))
    assert told.splitlines()[0].endswith(words)


def test_a_name_that_is_rather_wrong_is_told_as_one():
    from dataclasses import replace

    from engb_core.report.wording import headline
    doubtful = replace(DIAGNOSIS, effects=(
        EffectFinding('pad_creep', 0.10, {}, 0.8, (), 'It creeps.'),))
    assert 'probability 0.10, rather not' in summary(doubtful)
    assert 'might explain' in headline(doubtful)
    sure = replace(doubtful, effects=(replace(doubtful.effects[0], probability=0.9),))
    assert 'rather not' not in summary(sure)
    assert 'might' not in headline(sure)


# What a plain install lacks: everything beyond numpy, scipy and yaml.
WITHOUT = '''
import sys
for name in ('numba', 'matplotlib', 'plotly', 'dask', 'distributed', 'pandas', 'pyarrow', 'h5py',
             'asammdf', 'nptdms', 'can', 'cantools', 'jsonschema'):
    sys.modules[name] = None
from engb_ros.commands.main import main
sys.exit(main())
'''


def test_without_numba_it_is_told_and_a_signal_ends_it(tmp_path):
    """Below a minute, or a line that says what is missing; and it ends when told to."""
    began = time.monotonic()
    running = subprocess.Popen(
        [sys.executable, '-c', WITHOUT, 'diagnose', str(ROOT / 'bags/brake_1/recording'),
         '--model', str(ROOT / 'bags/brake_1/model.yaml'), '--out', 'result', '--verbose'],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=os.environ | {'PYTHONPATH': str(ROOT)})
    first = running.stderr.readline()
    assert 'numba is not installed' in first and 'pip install numba' in first
    assert time.monotonic() - began < 60.0
    while 'refitting' not in (line := running.stderr.readline()):
        assert line, running.wait()
    time.sleep(3.0)     # in the midst of a fit
    running.send_signal(signal.SIGTERM)
    told = time.monotonic()
    _, rest = running.communicate(timeout=60)
    assert running.returncode == 128 + signal.SIGTERM
    assert rest.splitlines()[-1] == 'engb: terminated'
    assert time.monotonic() - told < 20.0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(('text', 'words'), [
    ('raise ImportError("Numba needs NumPy 2.4\\nor less")',
     'numba does not start (Numba needs NumPy 2.4 or less): this takes'),
    ('import sys\nraise ModuleNotFoundError("none", name="numba")',
     'numba is not installed: this')])
def test_a_numba_that_does_not_start_is_told(tmp_path, text, words):
    """It is found, and refuses to work beside another version of numpy."""
    (tmp_path / 'numba').mkdir()
    (tmp_path / 'numba' / '__init__.py').write_text(text)
    done = subprocess.run(
        [sys.executable, '-c', 'from engb_ros.commands.common import tell_what_is_missing\n'
         'tell_what_is_missing()'], capture_output=True, text=True, check=True,
        env=os.environ | {'PYTHONPATH': os.pathsep.join([str(tmp_path), str(ROOT)])})
    assert words in done.stderr and done.stderr.count('\n') == 1
