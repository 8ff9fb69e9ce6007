# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Runs tasks in processes of this machine; one that dies or hangs costs its task only."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import contextlib
import multiprocessing
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
import os
import signal
import time
from typing import Any

from engb_core.blas_threads import ONE_THREAD

__all__ = ['run_processes']

Task = dict[str, Any]
Outcome = list[dict[str, Any]]
Work = Callable[[Task], Outcome]

# A task whose process dies is tried once more: the cause may have been another's memory.
_TRIES = 2


def run_processes(tasks: Sequence[Task], work: Work, jobs: int, seconds: float,
                  ) -> Iterator[tuple[int, Outcome | str]]:
    """Run `work` on each task.

    Args:
        tasks: plain data.
        work: a function of a module, which the processes import.
        jobs: processes at a time.
        seconds: a task that takes longer is given up, its process ended.

    Yields:
        The task's index, and its outcome or, where there is none, why; in order of completion.
    """
    waiting = list(range(len(tasks)))[::-1]
    tries = [0] * len(tasks)
    with contextlib.ExitStack() as stack:
        workers = [_Worker(work) for _ in range(max(1, min(jobs, len(tasks))))]
        for worker in workers:
            stack.callback(worker.stop)
        while True:
            for worker in workers:
                if worker.task is None and waiting:
                    index = waiting.pop()
                    tries[index] += 1
                    worker.give(index, tasks[index])
            busy = {worker.pipe: worker for worker in workers if worker.task is not None}
            if not busy:
                return
            ready = wait(list(busy), timeout=1.0)
            for pipe, worker in busy.items():
                if pipe in ready:
                    index, outcome = worker.take()
                    if outcome is None and tries[index] < _TRIES:
                        waiting.append(index)
                    else:
                        yield index, outcome if outcome is not None else (
                            'its process died, twice; is there enough memory?')
                elif time.monotonic() - worker.since > seconds and worker.task is not None:
                    yield worker.task, f'no end after {seconds:.0f} s'
                    worker.restart()


class _Worker:
    """A process that does one task after another."""

    def __init__(self, work: Work) -> None:
        self._work = work
        self.task: int | None = None
        self.since = 0.0
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context('spawn')
        self.pipe, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(other, self._work), daemon=True)
        with _single_threaded(), _uninterrupted():
            self._process.start()
        other.close()

    def give(self, index: int, task: Task) -> None:
        """Hand over a task."""
        self.task, self.since = index, time.monotonic()
        with contextlib.suppress(OSError):      # a dead process shows when its answer is taken
            self.pipe.send(task)

    def take(self) -> tuple[int, Outcome | None]:
        """Return the task's index and outcome; None where the process has died over it."""
        index, self.task = self.task, None
        assert index is not None, 'asked of those that have a task'
        try:
            return index, self.pipe.recv()
        except (EOFError, OSError):
            self.restart()
            return index, None

    def restart(self) -> None:
        """End the process and start another."""
        self.stop()
        self.task = None
        self._start()

    def stop(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()
        self.pipe.close()


@contextlib.contextmanager
def _single_threaded() -> Iterator[None]:
    # Each process works on a recording of its own; their numeric libraries must not compete.
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextlib.contextmanager
def _uninterrupted() -> Iterator[None]:
    """Start processes that Ctrl-C does not reach, from their first moment on: it is the parent's
    to handle, which gets one that comes meanwhile afterwards."""
    # Started first: it takes the block away again.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(pipe: Connection, work: Work) -> None:
    while True:
        try:
            task = pipe.recv()
        except (EOFError, OSError):
            return
        pipe.send(work(task))
