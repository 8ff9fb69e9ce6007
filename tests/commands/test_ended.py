# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""However a command ends, it is one line and a status; a signal counts for more than its wake."""

import signal
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
     'engb: a.csv: No space left on device\n'),
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
    came = []
    try:
        previous = program._catch_signals(came)
        assert signal.SIGHUP not in previous
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
        with pytest.raises(program._Stopped):
            signal.raise_signal(signal.SIGTERM)
        assert came == [signal.SIGTERM]
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize(('options', 'shown'), [([], 0), (['default'], 1)])
def test_warnings_are_shown_to_who_asks_python_for_them(monkeypatch, options, shown):
    monkeypatch.setattr(sys, 'warnoptions', options)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter('always')
        program._quiet_warnings()
        warnings.warn('divided by zero', RuntimeWarning, stacklevel=1)
    assert len(caught) == shown
