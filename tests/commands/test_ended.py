# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""However a command ends, it is one line and a status; a signal counts for more than its wake."""

import signal
import subprocess
import sys
import warnings

import pytest

from engb_core.errors import InputError
from engb_ros.commands import main as program


def ended(capsys, error, came=()):
    def action():
        raise error
    status = program._guarded(action, list(came))
    return status, capsys.readouterr().err


@pytest.mark.parametrize(('error', 'came', 'status', 'told'), [
    (InputError('a  file\nis missing'), (), 2, 'engb: a file is missing\n'),
    (KeyboardInterrupt(), (), 130, 'engb: interrupted\n'),
    (program._Stopped(signal.SIGTERM), (), 143, 'engb: terminated\n'),
    (program._Stopped(signal.SIGHUP), (), 129, 'engb: hung up\n'),
    (MemoryError(), (), 2, 'engb: not enough memory for this input; give shorter recordings\n'),
    (OSError(28, 'No space left on device', 'a.csv'), (), 2,
     'engb: a.csv: No space left on device; make room, or name another place\n'),
    (PermissionError(13, 'Permission denied', 'locked/x'), (), 2, 'engb: locked/x: Permission '
     'denied; name a place that you may read and write, or change its rights\n'),
    (OSError('odd'), (), 2, 'engb: odd\n'),
    (OSError(4, 'Interrupted system call'), (signal.SIGTERM,), 143, 'engb: terminated\n'),
    (ImportError('half of it'), (signal.SIGINT,), 130, 'engb: interrupted\n'),
    (KeyError('x'), (), 70, "engb: a fault of the program (KeyError: 'x'); ENGB_TRACEBACK=1 shows "
     'where\n'),
])
def test_what_went_wrong_is_a_line_and_a_status(capsys, monkeypatch, error, came, status, told):
    monkeypatch.delenv('ENGB_TRACEBACK', raising=False)
    assert ended(capsys, error, came) == (status, told)


def test_a_traceback_is_shown_to_who_asks_for_it(capsys, monkeypatch):
    monkeypatch.setenv('ENGB_TRACEBACK', '1')
    with pytest.raises(KeyError):
        ended(capsys, KeyError('x'))


def test_a_signal_that_is_ignored_stays_so():
    """A shell's background job ignores SIGINT, nohup SIGHUP."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    came, given_again = [], []
    try:
        previous = program._catch_signals(came, given_again)
        assert signal.SIGHUP not in previous
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
        with pytest.raises(program._Stopped):
            signal.raise_signal(signal.SIGTERM)
        assert came == [signal.SIGTERM]
    finally:
        for timer in given_again:
            timer.cancel()
        for number, handler in previous.items():
            signal.signal(number, handler)
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_within_a_finalizer_ends_the_program_all_the_same(tmp_path, number):
    """Python drops what a handler raises there; the import of a table went on for two minutes."""
    (tmp_path / 'swallows.py').write_text(
        'import os, time\n'
        'class Swallows:\n'
        '    def __del__(self):\n'
        f'        os.kill(os.getpid(), {int(number)})\n'
        '        time.sleep(0.1)\n'
        'Swallows()\n'
        'print("goes on", flush=True)\n'
        'time.sleep(600)\n')
    ended = subprocess.run(
        [sys.executable, '-m', 'engb_ros.commands.main', 'diagnose', 'nothing', '--effects',
         str(tmp_path), '--out', str(tmp_path / 'out')], capture_output=True, text=True,
        check=False, timeout=300)
    assert 'goes on' in ended.stdout
    assert ended.returncode == 128 + number
    assert ended.stderr.splitlines()[-1] == f'engb: {program._TOLD[number.name]}'


@pytest.mark.parametrize(('options', 'shown'), [([], 0), (['default'], 1)])
def test_warnings_are_shown_to_who_asks_python_for_them(monkeypatch, options, shown):
    monkeypatch.setattr(sys, 'warnoptions', options)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter('always')
        program._quiet_warnings()
        warnings.warn('divided by zero', RuntimeWarning, stacklevel=1)
    assert len(caught) == shown
