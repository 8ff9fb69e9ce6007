# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A real Dask cluster on this machine; one of its workers is killed in mid-run."""

from collections import Counter
import os
import signal

import pytest

from engb_core.errors import InputError
from engb_ros.fleet.dask_cluster import run_on_dask

from .workloads import act

distributed = pytest.importorskip('distributed', reason='the package distributed is missing')


@pytest.fixture(scope='module')
def cluster():
    """Three worker processes and a scheduler."""
    with distributed.LocalCluster(n_workers=3, threads_per_worker=1, processes=True,
                                  dashboard_address=None, protocol='tcp://') as made:
        yield made


def test_a_killed_worker_loses_and_doubles_nothing(cluster, tmp_path):
    tasks = [{'do': 'wait', 'seconds': 0.15, 'number': number, 'marks': str(tmp_path)}
             for number in range(40)]
    found, killed = Counter(), None
    for index, outcome in run_on_dask(tasks, act, cluster.scheduler_address):
        assert not isinstance(outcome, str), outcome
        assert outcome[0]['number'] == index
        found[index] += 1
        if killed is None and sum(found.values()) == 8:
            killed = outcome[0]['process']
            os.kill(killed, signal.SIGKILL)
    assert found == Counter(range(40))
    assert killed is not None
    # The worker was in the middle of a task: that one was begun twice.
    begun = {file.name: file.read_text().split() for file in tmp_path.iterdir()}
    assert len(begun) == 40
    assert any(str(killed) in processes for processes in begun.values())


def test_a_task_that_kills_every_worker_is_given_up(cluster):
    found = dict(run_on_dask([{'do': 'die', 'number': 0}, {'do': 'work', 'number': 1}], act,
                             cluster.scheduler_address))
    assert 'KilledWorker' in found[0]
    assert found[1][0]['number'] == 1


def test_no_scheduler_there(monkeypatch):
    monkeypatch.setattr('engb_ros.fleet.dask_cluster._PATIENCE', 1)
    for address in ('tcp://127.0.0.1:9', 'nonsense'):
        with pytest.raises(InputError, match='no scheduler answers'):
            list(run_on_dask([], act, address))
