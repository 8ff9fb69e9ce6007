# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Runs tasks on an existing Dask cluster (package dask.distributed, optional)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any
import uuid

from engb_core.errors import InputError

__all__ = ['run_on_dask']

_PATIENCE = 20      # [s] for the scheduler to answer

Task = dict[str, Any]
Outcome = list[dict[str, Any]]


def run_on_dask(tasks: Sequence[Task], work: Callable[[Task], Outcome], address: str,
                ) -> Iterator[tuple[int, Outcome | str]]:
    """Run `work` on each task, on the cluster whose scheduler is at `address`.

    The workers need this package, and the recordings at the same paths; what they find out comes
    back here and is kept here. A task whose worker dies goes to another worker.

    Yields:
        The task's index, and its outcome or, where there is none, why; in order of completion.

    Raises:
        InputError: dask.distributed isn't installed, or no scheduler answers.
    """
    try:
        from distributed import as_completed, Client
    except ImportError as error:
        raise InputError('--scheduler needs the package distributed: pip install '
                         '"dask[distributed]"') from error
    try:
        client = Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f'--scheduler {address}: no scheduler answers there '
                         f'({str(error) or type(error).__name__}); start one with '
                         'dask scheduler') from error
    with client, client.as_current():
        # Names of their own: another survey on the cluster must not share our results.
        run = uuid.uuid4().hex[:8]
        futures = {client.submit(work, task, key=f'engb-{run}-{index}', pure=False): index
                   for index, task in enumerate(tasks)}
        for future in as_completed(futures):
            index = futures.pop(future)
            try:
                outcome: Outcome | str = future.result()
            except Exception as error:      # a lost worker, a lost scheduler, no such module there
                outcome = f'the cluster gave no result ({type(error).__name__}: {error})'
            future.release()
            yield index, outcome
