# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Independent fits in parallel: compiled code releases the interpreter while it runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
import os
import threading
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from engb_core.physics.walk import Walk

__all__ = ['OwnSamples', 'parallel_map', 'processors']

Item = TypeVar('Item')
Result = TypeVar('Result')


# More threads than that wait for the interpreter more than they compute.
MOST_THREADS = 8
# What each thread knows of itself.
_HERE = threading.local()


def processors() -> int:
    """Return how many processors this process may use, or can."""
    allowed = (len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity')
               else os.cpu_count() or 1)
    return min(allowed, MOST_THREADS)


def parallel_map(work: Callable[[Item], Result], items: Iterable[Item], threads: int,
                 ) -> Iterator[Result]:
    """Yield `work(item)` of every item in order, computed by so many threads; work that is itself
    done in parallel does its own one after another."""
    items = list(items)
    if threads < 2 or len(items) < 2 or getattr(_HERE, 'busy', False):
        yield from map(work, items)
        return
    pool = ThreadPoolExecutor(min(threads, len(items)), initializer=_begin)
    try:
        yield from pool.map(work, items)
    finally:
        # Who is interrupted waits neither for what is to come nor for what runs: nobody will read
        # it, and where nothing is compiled one piece of work takes minutes.
        pool.shutdown(wait=False, cancel_futures=True)


def _begin() -> None:
    _HERE.busy = True


class OwnSamples(threading.local):
    """A motion's samples (n, SAMPLE_SIZE), a copy for each thread: the torque balance writes its
    stages into them; and the last walk through these."""

    def __init__(self, samples: NDArray[np.float64]) -> None:
        self.table = samples.copy()
        self.walk = Walk()
