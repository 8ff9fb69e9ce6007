# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A damaged file of somebody's format may end its reader, never the program."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

from fuzz.cases import make_any
import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.tables.open import open_table
from engb_core.io.tables.table import Table
from engb_ros.commands.main import main

ROOT = Path(__file__).resolve().parents[2]

# A reader that does what a damaged file once made one do.
READERS = {
    'crash': 'import os; os.abort()',
    'memory': 'import numpy; numpy.ones(1 << 28)',
    'hidden': 'import numpy\n        try: numpy.ones(1 << 28)\n'
              '        except Exception as error: raise InputError("x") from error',
    'endless': 'open(str(path) + ".begun", "w").close()\n        while True: pass',
    'print': 'print("words")\n        raise InputError(f"{path}: told")',
}


@pytest.fixture
def reader(tmp_path, monkeypatch):
    """Put a broken asammdf, which is imported by the reader's process, in front of any other."""
    def make(kind):
        (tmp_path / 'asammdf.py').write_text(
            'from engb_core.errors import InputError\nclass MDF:\n    def __init__(self, path):\n'
            f'        {READERS[kind]}\n')
        (tmp_path / 'a.mf4').write_bytes(b'MDF     4.10    ')
        monkeypatch.syspath_prepend(tmp_path)
        return tmp_path / 'a.mf4'
    return make


@pytest.mark.parametrize(('kind', 'words'), [
    ('crash', 'Abort'), ('memory', 'more memory'), ('hidden', 'more memory'), ('print', 'told')])
def test_the_end_of_a_reader_is_one_line(reader, capfd, kind, words):
    path = reader(kind)
    assert main(['import', '--list', str(path)]) == 2
    out, err = capfd.readouterr()
    assert (out, err.count('\n')) == ('', 1)
    assert words in err
    assert str(path) in err


def test_a_reader_without_end_is_ended(reader, monkeypatch):
    path = reader('endless')
    monkeypatch.setattr('engb_core.io.tables.apart._SECONDS', 1.0)
    with pytest.raises(InputError, match='not read within'):
        open_table(path)


def test_a_reader_that_is_killed_later(tmp_path):
    path = tmp_path / 'a.mat'
    from scipy.io import savemat
    savemat(path, {'t': np.arange(9.0), 'q': np.arange(9.0)})
    table = open_table(path)
    table._process.kill()
    with pytest.raises(InputError, match='Killed'):
        table.read([0])


def test_a_reader_that_does_not_end_when_it_is_asked_to_is_killed(tmp_path, monkeypatch):
    """As where the program was started with SIGTERM ignored: what it starts ignores it, too."""
    monkeypatch.setattr('engb_core.io.tables.apart._LET_END', 0.1)
    path = tmp_path / 'a.mat'
    from scipy.io import savemat
    savemat(path, {'t': np.arange(9.0), 'q': np.arange(9.0)})
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        table = open_table(path)
    finally:
        signal.signal(signal.SIGTERM, before)
    table._process.send_signal(signal.SIGSTOP)      # nor does it see that its pipe is closed
    table._end()
    assert table._process.returncode == -signal.SIGKILL


def _runs(process):
    """Tell whether a process still runs; one that nobody waited for yet has ended as well."""
    try:
        return Path(f'/proc/{process}/stat').read_text().rpartition(')')[2].split()[0] != 'Z'
    except (FileNotFoundError, ProcessLookupError):
        return False


def _until(condition, seconds=30):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


# A reader that was started and not yet asked anything ends because its pipe does.
@pytest.mark.parametrize('at_work', [True, False])
def test_a_signal_ends_the_reader_too(reader, tmp_path, at_work):
    path = reader('endless')
    code = ('import sys; sys.path.insert(0, sys.argv[1]); sys.argv[1:] = sys.argv[2:]\n'
            'from engb_ros.commands.main import main\nsys.exit(main())')
    process = subprocess.Popen(
        [sys.executable, '-c', code, str(tmp_path), 'import', '--list', str(path)], cwd=ROOT,
        stderr=subprocess.PIPE, text=True)
    children = Path(f'/proc/{process.pid}/task/{process.pid}/children')
    _until(lambda: children.read_text().split())
    child = int(children.read_text().split()[0])
    if at_work:
        _until((tmp_path / 'a.mf4.begun').exists)
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=10) == 128 + signal.SIGTERM
    assert process.stderr.read() == 'engb: terminated\n'
    _until(lambda: not _runs(child), 10)


@pytest.mark.parametrize('seed', [1005177, 1006048])
def test_what_was_found_once(tmp_path, seed):
    """asammdf crashed in malloc, and took 3.7 GB."""
    pytest.importorskip('asammdf')
    case = make_any(seed, tmp_path)
    # A process of its own: what its readers took is told apart from all other children's.
    code = ('import resource, sys\nfrom engb_ros.commands.main import main\n'
            'status = main(sys.argv[1:])\n'
            'print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)\nsys.exit(status)')
    ended = subprocess.run([sys.executable, '-c', code, *map(str, case.arguments)], cwd=ROOT,
                           capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert ended.stderr.count('\n') == 1
    assert int(ended.stdout) < 1_000_000


def test_a_reader_leaves_no_temporary_file(tmp_path):
    asammdf = pytest.importorskip('asammdf')
    with asammdf.MDF() as file:
        file.append([asammdf.Signal(np.arange(99.0), 0.01 * np.arange(99), name='angle')])
        path = file.save(tmp_path / 'a.mf4')
    scratch = tmp_path / 'scratch'
    scratch.mkdir()
    ended = subprocess.run(
        [sys.executable, '-m', 'engb_ros.commands.main', 'import', '--list', str(path)], cwd=ROOT,
        env=os.environ | {'TMPDIR': str(scratch)}, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    assert list(scratch.iterdir()) == []


def test_only_numbers_come_back(tmp_path):
    path = tmp_path / 'a.mat'
    from scipy.io import savemat
    savemat(path, {'t': np.arange(9.0), 'q': np.arange(9, dtype=np.int16)})
    table = open_table(path)
    assert isinstance(table, Table)
    read = table.read([1, 0, 1])
    assert set(read) == {0, 1}
    np.testing.assert_array_equal(read[1].value, np.arange(9.0))
    assert table.kind == 'MATLAB'
