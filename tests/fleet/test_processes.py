# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Processes: every task has one outcome, whatever becomes of its process."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import pytest

from engb_ros.fleet.processes import run_processes

from .workloads import act

ROOT = Path(__file__).resolve().parents[2]


def outcomes(tasks, jobs=2, seconds=60.0):
    """Run tasks; assert that each comes out once."""
    found = list(run_processes(tasks, act, jobs, seconds))
    assert sorted(index for index, _ in found) == list(range(len(tasks)))
    return dict(found)


def test_every_task_once(tmp_path):
    found = outcomes([{'do': 'work', 'number': number, 'marks': str(tmp_path)}
                      for number in range(20)])
    assert [found[number][0]['number'] for number in range(20)] == list(range(20))
    assert all(len(file.read_text().splitlines()) == 1 for file in tmp_path.iterdir())
    assert {entry[0]['process'] for entry in found.values()}.isdisjoint({os.getpid()})


def test_a_process_that_dies_or_hangs_costs_its_task_only(tmp_path):
    tasks = [{'do': what, 'number': number, 'marks': str(tmp_path)} for number, what in enumerate(
        ['work', 'die', 'work', 'die once', 'hang', 'work', 'work'])]
    found = outcomes(tasks, seconds=5.0)
    assert 'died' in found[1]
    assert 'no end after 5 s' in found[4]
    for number in (0, 2, 3, 5, 6):
        assert found[number][0]['number'] == number


def test_nothing_to_do():
    assert outcomes([]) == {}


SURVEY = '''
import sys
from engb_ros.fleet.processes import run_processes
from tests.fleet.workloads import act
if __name__ == '__main__':
    tasks = [{'do': 'work', 'number': n, 'marks': sys.argv[1]} for n in range(20000)]
    print('begins', flush=True)
    try:
        for _ in run_processes(tasks, act, 2, 60.0):
            pass
    except KeyboardInterrupt:
        sys.exit(130)
'''


@pytest.mark.parametrize('after', [0.1, 0.5, 1.0])
def test_an_interrupt_is_told_by_nobody_but_the_parent(tmp_path, after):
    """Ctrl-C reaches the whole group of processes; those just starting told
    where they were."""
    script = tmp_path / 'survey.py'
    script.write_text(SURVEY)
    parent = subprocess.Popen([sys.executable, str(script), str(tmp_path)], text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              start_new_session=True,
                              env=os.environ | {'PYTHONPATH': str(ROOT)})
    parent.stdout.readline()
    time.sleep(after)
    os.killpg(parent.pid, signal.SIGINT)
    _, told = parent.communicate(timeout=60)
    assert (parent.returncode, told) == (130, '')
