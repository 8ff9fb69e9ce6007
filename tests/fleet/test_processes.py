# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Processes: every task has one outcome, whatever becomes of its process."""

import os

from engb_ros.fleet.processes import run_processes

from .workloads import act


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
