# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Nothing that the program did not make is deleted or overwritten; results come whole."""

import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io import outputs
from engb_core.io.bags.read import read_recording
from engb_core.io.bags.write import FloatTable, JointTable, write_bag
from engb_core.io.outputs import file_output, folder_output
from engb_core.model import Model

from .conftest import motion, ROOT

COLUMNS = ['--column', 'time=t', '--column', 'position=q', '--column', 'effort=i']


@pytest.fixture
def table(tmp_path):
    """A bench's table."""
    run = motion(400)
    path = tmp_path / 't.csv'
    np.savetxt(path, np.column_stack([run['time'], run['position'], run['effort']]), '%.17g', ',',
               header='t,q,i', comments='')
    return path


def standing(folder):
    """Return every file below a folder with what it holds."""
    return {str(entry.relative_to(folder)): entry.read_bytes() if entry.is_file() else None
            for entry in sorted(folder.rglob('*'))}


@pytest.mark.parametrize('out', ['thesis', '.', 't.csv', 'mixed', 'home', '..', 'base.db3',
                                 'text.mcap', 'link', 'nested'])
def test_import_by_force_replaces_recordings_only(refused, tmp_path, table, monkeypatch, out):
    import sqlite3
    work = tmp_path / 'work'
    work.mkdir()
    (tmp_path / 'thesis.tex').write_text('years of work')
    for name, content in (('thesis', 'chapter.tex'), ('home', '.profile'), ('.git', 'HEAD')):
        (work / name).mkdir()
        (work / name / content).write_text('mine')
    times = np.arange(50) / 100
    for name in ('mixed', 'nested'):
        write_bag(work / name, {'/joint_states': JointTable(times, times, None, times)})
    (work / 'mixed' / 'notes.txt').write_text('mine')
    (work / 'nested' / 'deeper').mkdir()
    (work / 'text.mcap').write_text('no bag')
    base = sqlite3.connect(work / 'base.db3')
    base.execute('CREATE TABLE mine (x)')
    base.commit()
    base.close()
    (work / 'link').symlink_to(work / 'thesis')
    monkeypatch.setenv('HOME', str(work / 'home'))
    monkeypatch.chdir(work)
    shutil.move(table, work / 't.csv')
    before = standing(tmp_path)
    outcome = subprocess.run(
        [sys.executable, '-m', 'engb_ros.commands.main', 'import', 't.csv', '--force', '--out',
         out, *COLUMNS], env=os.environ | {'PYTHONPATH': str(ROOT)}, capture_output=True,
        text=True, cwd=work)
    assert outcome.returncode == 2 and outcome.stderr.count('\n') == 1, outcome
    assert '--out' in outcome.stderr
    assert standing(tmp_path) == before


def test_import_by_force_replaces_a_recording(engb, table):
    for out in ('run1', 'run1.mcap'):
        assert engb('import', table, '--out', out, *COLUMNS).status == 0
        assert engb('import', table, '--out', out, '--force', *COLUMNS, '--scale',
                    'position=2').status == 0
        np.testing.assert_allclose(read_recording(out).position[200],
                                   2 * motion(400)['position'][200])
    assert not list(Path('.').glob('.engb*'))


def test_outputs_are_checked_before_the_table_is_read(refused, tmp_path, table):
    (tmp_path / 'run1').mkdir()
    table.write_text('no table')
    refused('import', table, '--out', 'run1', *COLUMNS, words=['run1', 'exists'])


@pytest.mark.parametrize('out', ['.', 'run1', 'run1/deep', 'kept', 'own'])
def test_a_diagnosis_overwrites_nothing(refused, tmp_path, bag, model_file, out):
    """Its input, a recording, somebody's model, a result that was edited."""
    (tmp_path / 'kept').mkdir()
    (tmp_path / 'kept' / 'model.yaml').write_text('mine')
    with folder_output(tmp_path / 'own', ['model.yaml']) as scratch:
        (scratch / 'model.yaml').write_text('made')
    (tmp_path / 'own' / 'model.yaml').write_text('made, then edited')
    before = standing(tmp_path)
    refused('diagnose', bag, '--model', 'model.yaml', '--out', out, words=['--out'])
    assert standing(tmp_path) == before


def test_what_a_former_diagnosis_left_goes_and_nothing_else(engb, tmp_path, table, bag, model_file,
                                                            monkeypatch):
    """A first model, tables as recordings: of another run they would speak of other inputs."""
    def found(recordings, model, **_):
        raise InputError('no diagnosis here')

    monkeypatch.setattr('engb_core.diagnose.engine.diagnose', found)
    out = tmp_path / 'out'
    names = ['first_model.yaml', 'first_model.html', 't.mcap', 'kept.mcap', 'edited.mcap',
             'of_another_command.yaml']
    with folder_output(out, names) as scratch:
        for name in names:
            (scratch / name).write_text('made')
    (out / 'edited.mcap').write_text('made, then edited')
    (out / 'mine.mcap').write_text('mine')
    engb('diagnose', bag, '--model', model_file, '--out', 'out')
    assert len(standing(out)) == len(names) + 2         # where nothing is made, nothing goes
    with folder_output(out, ['report.html'], [out / 'kept.mcap'],
                       former=['first_model.*', '*.mcap']) as scratch:
        (scratch / 'report.html').write_text('new')
    assert sorted(standing(out)) == [
        outputs.LIST, 'edited.mcap', 'kept.mcap', 'mine.mcap', 'of_another_command.yaml',
        'report.html']
    with folder_output(out, ['kept.mcap']) as scratch:
        (scratch / 'kept.mcap').write_text('it is still on the list, and may be made anew')


@pytest.mark.parametrize(('command', 'out'), [('predict', 'mine.npz'), ('identify', 'mine.yaml'),
                                              ('identify', 'model.yaml')])
def test_a_file_of_somebody_else_stays(refused, tmp_path, bag, model_file, command, out):
    np.savez(tmp_path / 'mine.npz', time=np.zeros(3))
    Model().write(tmp_path / 'mine.yaml')
    before = standing(tmp_path)
    refused(command, bag, '--model', model_file, '--out', out, words=['--out', out])
    assert standing(tmp_path) == before


@pytest.mark.parametrize('command', ['diagnose', 'predict', 'identify'])
def test_an_empty_name_is_no_place(refused, bag, model_file, command):
    """An unset variable of a script is not the working folder."""
    refused(command, bag, '--model', model_file, '--out', '', words=['--out is empty'])


def test_own_files_are_written_again(engb, tmp_path, bag, model_file):
    for _ in range(2):
        assert engb('predict', bag, '--model', model_file, '--out', 'a.npz').status == 0
    with np.load('a.npz') as arrays:
        assert arrays['time'].size == 4000
    for content in ('one', 'two'):
        with file_output(tmp_path / 'm.yaml', '.yaml') as made:
            made.write_text(f'name: {content}\n')
    assert (tmp_path / 'm.yaml').read_text().splitlines()[1] == 'name: two'
    (tmp_path / 'm.yaml').write_text((tmp_path / 'm.yaml').read_text() + 'more: 1\n')
    with pytest.raises(InputError, match='changed'), file_output(tmp_path / 'm.yaml', '.yaml'):
        pass


def test_own_results_are_written_again(tmp_path):
    for names, content in ((('a', 'b', 'bags'), 'one'), (('a',), 'two'), (('a', 'b'), 'three')):
        with folder_output(tmp_path / 'out', ['a', 'b', 'bags']) as scratch:
            for name in names:
                if name == 'bags':
                    (scratch / 'bags').mkdir()
                    (scratch / 'bags' / 'x').write_text(content)
                else:
                    (scratch / name).write_text(content)
        found = sorted(entry.name for entry in (tmp_path / 'out').iterdir())
        assert found == sorted([*names, outputs.LIST])
        assert (tmp_path / 'out' / 'a').read_text() == content
    (tmp_path / 'out' / 'bags').mkdir()
    (tmp_path / 'out' / 'bags' / 'mine').write_text('mine')
    with pytest.raises(InputError, match='bags/mine'), \
            folder_output(tmp_path / 'out', ['a', 'b', 'bags']):
        pass


def test_a_survey_overwrites_no_table(refused, tmp_path, bag, model_file):
    (tmp_path / 'fleet').mkdir()
    (tmp_path / 'fleet' / 'survey.csv').write_text('mine')
    refused('survey', bag, '--model', model_file, '--out', 'fleet', words=['survey.csv'])
    refused('survey', bag, '--model', model_file, '--out', 'run1', words=['run1'])
    assert (tmp_path / 'fleet' / 'survey.csv').read_text() == 'mine'


def test_a_proof_deletes_no_results(refused, tmp_path):
    (tmp_path / 'results').mkdir()
    (tmp_path / 'results' / 'mine').write_text('mine')
    refused('prove', '--reuse', 'proof', '--again', '--out', '.', words=['--out'])
    assert (tmp_path / 'results' / 'mine').read_text() == 'mine'


@pytest.mark.parametrize('out', ['run1', 'run1.mcap', 'result'])
def test_a_full_disk_is_told_of_the_place_that_was_named(tmp_path, table, out):
    """Not of the hidden folder that nobody knows, and that is gone by then."""
    code = ('import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (4000, 4000))\n'
            'from engb_ros.commands.main import main; sys.exit(main())')
    command = ['import', 't.csv', *COLUMNS]
    if out == 'result':
        command = ['diagnose', 't.csv', '--torque-constant', '1', '--unit', 'time=s',
                   'position=rad']
    # A measurement of coverage would want to write there, too.
    around = {name: text for name, text in os.environ.items() if not name.startswith('COVERAGE')}
    outcome = subprocess.run([sys.executable, '-c', code, *command, '--out', out], cwd=tmp_path,
                             env=around | {'PYTHONPATH': str(ROOT)}, capture_output=True,
                             text=True)
    last = outcome.stderr.splitlines()[-1]
    assert outcome.returncode == 2 and 'cannot be written to (File too large)' in last
    assert '.engb-' not in last
    assert last.startswith(f'engb: --out {"result/t.mcap" if out == "result" else out}: ')
    assert [entry.name for entry in tmp_path.iterdir()] == ['t.csv']


def test_a_folder_whose_parent_is_not_writable(tmp_path):
    """Scratch lies inside the target: its parent may be read-only or another disk."""
    code = '''
import os, sys
from pathlib import Path
from engb_core.io.outputs import folder_output
if os.geteuid() == 0:
    os.setegid(65534)
    os.seteuid(65534)
with folder_output('locked/out', ['a']) as scratch:
    (scratch / 'a').write_text('x')
for out in ('locked/new', 'locked/deep/new'):
    try:
        with folder_output(out, ['a']):
            print('computing')
    except Exception as error:
        print(type(error).__name__, error)
'''
    (tmp_path / 'locked' / 'out').mkdir(parents=True)
    (tmp_path / 'locked' / 'out').chmod(0o777)
    (tmp_path / 'locked').chmod(0o555)
    for parent in tmp_path.parents:
        if parent.stat().st_uid == os.geteuid() and parent != Path('/'):
            parent.chmod(parent.stat().st_mode | 0o055)
    tmp_path.chmod(0o755)
    outcome = subprocess.run([sys.executable, '-c', code], cwd=tmp_path, capture_output=True,
                             text=True, env={'PYTHONPATH': str(ROOT)})
    (tmp_path / 'locked').chmod(0o755)
    assert outcome.stderr == ''
    lines = outcome.stdout.splitlines()
    assert len(lines) == 2 and all(line.startswith('InputError --out locked') for line in lines)
    assert sorted(entry.name for entry in (tmp_path / 'locked').rglob('*')) == [
        outputs.LIST, 'a', 'out']


SLOW = '''
import sys, time
from engb_ros.commands import main as program
from engb_core.io.outputs import folder_output, recording_output
class Slow:
    __doc__ = 'x'
    def add_arguments(self, parser): pass
    def run(self, arguments):
        with folder_output('out', ['a']) as folder, recording_output('bag') as bag:
            (folder / 'a').write_text('half')
            bag.mkdir()
            (bag / 'bag_0.mcap').write_text('half')
            print('ready', flush=True)
            time.sleep(60)
program._load = lambda name: Slow()
sys.exit(program.main(['predict']))
'''


@pytest.mark.parametrize('number', [signal.SIGHUP, signal.SIGKILL])
@pytest.mark.parametrize('there', [False, True])
def test_a_killed_command_leaves_nothing_that_looks_like_a_result(tmp_path, number, there):
    if there:
        (tmp_path / 'out').mkdir()
    process = subprocess.Popen([sys.executable, '-c', SLOW], cwd=tmp_path, text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               env={'PYTHONPATH': str(ROOT)})
    assert process.stdout.readline() == 'ready\n'
    process.send_signal(number)
    _, err = process.communicate(timeout=30)
    left = [path for path in tmp_path.rglob('*')
            if not any(part.startswith('.') for part in path.relative_to(tmp_path).parts)]
    assert [path.name for path in left] == (['out'] if there else [])
    if number == signal.SIGHUP:
        assert (process.returncode, err) == (129, 'engb: hung up\n')
        assert list(tmp_path.rglob('.*')) == []
    from engb_ros.fleet.find import find_recordings
    with pytest.raises(InputError, match='no recording'):
        find_recordings([str(tmp_path)])


def test_what_a_killed_command_left_is_cleared_by_the_next_and_by_no_other(tmp_path):
    process = subprocess.Popen([sys.executable, '-c', SLOW], cwd=tmp_path, text=True,
                               stdout=subprocess.PIPE, env={'PYTHONPATH': str(ROOT)})
    assert process.stdout.readline() == 'ready\n'
    at_work = set(tmp_path.glob('.engb-*'))
    assert len(at_work) == 2
    with outputs.file_output(tmp_path / 'a.yaml', '.yaml') as made:
        made.write_text('a: 1')
    # What another run works in stays while it runs.
    assert set(tmp_path.glob('.engb-*')) == at_work
    process.kill()
    process.communicate(timeout=30)
    assert set(tmp_path.glob('.engb-*')) == at_work
    # Somebody's folder of such a name, one with something beside what the program makes, and one
    # that holds what was to be replaced.
    (tmp_path / '.engb-notes').mkdir()
    (tmp_path / '.engb-notes' / 'thesis.txt').write_text('mine')
    for name in ('used', 'held'):
        shutil.copytree(min(at_work), tmp_path / f'.engb-{name}')
    (tmp_path / '.engb-used' / 'thesis.txt').write_text('mine')
    (tmp_path / '.engb-held' / 'made' / '.replaced').mkdir()
    with outputs.folder_output(tmp_path / 'out', ['a']) as folder:
        (folder / 'a').write_text('whole')
    assert {path.name for path in tmp_path.glob('.engb-*')} == {
        '.engb-notes', '.engb-used', '.engb-held'}
    assert (tmp_path / 'out' / 'a').read_text() == 'whole'


def test_signals_wait_while_files_take_their_places(tmp_path):
    came = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: came.append(number))
    try:
        with outputs.undisturbed():
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.05)
            assert came == []
        assert came == [signal.SIGTERM]
    finally:
        signal.signal(signal.SIGTERM, before)


def test_a_name_that_is_no_utf_8_is_refused_for_a_bag(tmp_path):
    times = np.arange(50) / 100
    with pytest.raises(InputError, match='UTF-8'):
        write_bag(tmp_path / os.fsdecode(b'run\xff'), {'/x': FloatTable(times, times)})


WRITER = '''
import sys, time
from engb_core.errors import InputError
from engb_core.io.outputs import folder_output
names = [f'f{k}.txt' for k in range(6)] + ['sub']
end, number = time.monotonic() + 3.0, 0
while time.monotonic() < end:
    with folder_output(sys.argv[1], names) as made:
        for name in names[:-1]:
            (made / name).write_text(f'{sys.argv[2]} {number}')
        (made / 'sub').mkdir()
        (made / 'sub' / f'{sys.argv[2]}.txt').write_text(str(number))
    number += 1
print(number)
'''


@pytest.mark.parametrize('there', [False, True])
def test_two_runs_at_once_leave_the_results_of_one_of_them(tmp_path, there):
    """Files of one run had stood beside the list of the other, and neither could write again."""
    target = tmp_path / 'out'
    if there:
        target.mkdir()
        (target / 'mine.txt').write_text('mine')
    runs = [subprocess.Popen([sys.executable, '-c', WRITER, str(target), name],
                             stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=ROOT, text=True)
            for name in 'ab']
    said = [run.communicate(timeout=60) for run in runs]
    assert [run.returncode for run in runs] == [0, 0], said
    assert all(int(text) > 3 for text, _ in said)
    whose = {path.read_text() for path in target.glob('f*.txt')}
    assert len(whose) == 1
    assert [path.stem for path in (target / 'sub').iterdir()] == [whose.pop()[0]]
    assert sorted(path.name for path in target.iterdir()) == sorted(
        [outputs.LIST, *(f'f{k}.txt' for k in range(6)), 'sub', *(['mine.txt'] * there)])


def test_a_link_in_the_place_of_a_list_in_the_making_is_not_followed(tmp_path):
    precious = tmp_path / 'thesis.tex'
    precious.write_text('years of work')
    target = tmp_path / 'out'
    target.mkdir()
    (target / f'{outputs.LIST}.part').symlink_to(precious)
    with outputs.claimed_folder(target, ['a.txt']) as place:
        (place / 'a.txt').write_text('new')
    assert precious.read_text() == 'years of work'
    with outputs.claimed_folder(target, ['a.txt']) as place:
        (place / 'a.txt').write_text('newer')
