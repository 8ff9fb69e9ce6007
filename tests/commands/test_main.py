# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The program as such: help, wrong arguments, signals, pipes."""

import os
import resource
import signal
import subprocess
import sys

import numpy as np
import pytest

from engb_core.blas_threads import ONE_THREAD
from engb_core.errors import InputError
from engb_ros.commands import main as program

from .conftest import ROOT, start

COMMANDS = ('diagnose', 'predict', 'identify', 'import')


def test_help_lists_every_command_with_an_example(engb):
    for arguments in ([], ['--help'], ['-h']):
        outcome = engb(*arguments)
        assert (outcome.status, outcome.err) == (0, '')
        assert 'example' in outcome.out
        for name in COMMANDS:
            assert name in outcome.out


@pytest.mark.parametrize('name', COMMANDS)
def test_each_command_has_help_with_examples(engb, name):
    outcome = engb(name, '--help')
    assert (outcome.status, outcome.err) == (0, '')
    assert f'engb {name} ' in outcome.out.split('examples:')[1]


def test_version(engb):
    assert engb('--version').out.startswith('engb ')


@pytest.mark.parametrize(('arguments', 'words'), [
    (['diagnos'], ['did you mean diagnose']),
    (['xyzzy'], ['xyzzy', 'identify']),
    (['--nope'], ['--help']),
    (['diagnose'], ['RECORDING', '--out', 'engb diagnose --help']),
    (['diagnose', 'a', '--model', 'm', '--out', 'o', '--speed'], ['--speed']),
    (['predict', 'a', '--model'], ['--model']),
])
def test_wrong_arguments_are_told_in_one_line(refused, arguments, words):
    refused(*arguments, words=words)


def test_help_starts_fast_and_imports_nothing_heavy():
    code = ('import sys; from engb_ros.commands.main import main; main(["--help"]); '
            'print(sorted({"numpy", "scipy", "numba", "yaml", "rosbags", "rclpy"} '
            '& set(sys.modules)))')
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, cwd=ROOT,
                          check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert done.stdout.splitlines()[-1] == '[]'
    # Processor time, not the clock: 0.2 s, whatever else the machine does.
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < 2.0


@pytest.mark.parametrize('given, threads', [({}, 1), ({'OPENBLAS_NUM_THREADS': '2'}, 2)])
def test_the_numeric_libraries_leave_the_processors_to_the_fits(given, threads):
    """A diagnosis fits side by side; who wants it otherwise says so by the environment."""
    if 'openblas' not in str(np.show_config(mode='dicts')).lower():
        pytest.skip('numpy was built with another BLAS than OpenBLAS')
    code = ('import os; from engb_ros.commands.main import main; main(["--version"]); '
            'print(os.environ["OPENBLAS_NUM_THREADS"]); import numpy as np; '
            'a = np.ones((900, 900)); a @ a; print(len(os.listdir("/proc/self/task")))')
    clean = {name: value for name, value in os.environ.items() if name not in ONE_THREAD}
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, cwd=ROOT,
                          check=True, env=clean | given)
    asked, running = done.stdout.split()[-2:]
    assert asked == str(threads)
    assert threads > 1 or running == '1'


class Fake:
    """A command whose `run` does what a test wants."""

    __doc__ = 'Fake.'

    def __init__(self, action):
        self._action = action

    def add_arguments(self, parser):
        """Declare nothing."""

    def run(self, arguments):
        """Do it."""
        return self._action()


@pytest.mark.parametrize(('error', 'status', 'text'), [
    (InputError('a.yaml: broken\n  badly'), 2, 'engb: a.yaml: broken badly\n'),
    (KeyboardInterrupt(), 130, 'engb: interrupted\n'),
    (OSError(28, 'No space left on device', 'x'), 2,
     'engb: x: No space left on device; make room, or name another place\n'),
    (MemoryError(), 2, None),
    (ZeroDivisionError('oh'), 70, None),
])
def test_failures_end_in_one_line(engb, monkeypatch, error, status, text):
    def fail():
        raise error
    monkeypatch.setattr(program, '_load', lambda name: Fake(fail))
    outcome = engb('diagnose')
    assert outcome.status == status
    assert outcome.err == text or text is None
    assert outcome.err.count('\n') == 1


@pytest.mark.parametrize(('number', 'status'), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_leave_nothing_half_written(tmp_path, number, status):
    code = '''
import sys, time
from engb_ros.commands import main as program
from engb_ros.commands.common import file_output, folder_output
class Slow:
    __doc__ = 'x'
    def add_arguments(self, parser): pass
    def run(self, arguments):
        with folder_output('out/deep', ['a']) as folder, file_output('x.npz', '.npz') as file:
            (folder / 'a').write_text('half')
            print('ready', flush=True)
            time.sleep(60)
program._load = lambda name: Slow()
sys.exit(program.main(['predict']))
'''
    process = subprocess.Popen([sys.executable, '-c', code], cwd=tmp_path, text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               env={'PYTHONPATH': str(ROOT)})
    assert process.stdout.readline() == 'ready\n'
    process.send_signal(number)
    _, err = process.communicate(timeout=30)
    assert process.returncode == status
    assert err.count('\n') == 1
    assert list(tmp_path.iterdir()) == []


def test_a_reader_that_goes_away_is_no_traceback():
    process = start('diagnose', '--help')
    process.stdout.close()
    assert 'Traceback' not in process.stderr.read()
    process.wait(timeout=30)
