# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How much of the machine others take while a test runs in real time."""

from __future__ import annotations

import os
from pathlib import Path
import time

__all__ = ['Watch', 'family_time']

# Others that take more of the machine than this, all processors together, make real time a matter
# of luck: half a processor of two. A machine that is busier than the second, whoever it is, may be
# late: two tests at a time nearly fill one with two processors.
MOST, FULL = 0.25, 0.8
TICK = os.sysconf('SC_CLK_TCK')


class Watch:
    """From now on, how much of the machine others take. Where there is no /proc: nothing."""

    def __init__(self) -> None:
        self._begin = _now()

    def used(self) -> tuple[float, float]:
        """Return the parts of all processors' time that others and all have taken since, 0 to 1.

        Others are all processes but this one's family: what pytest's first process started, so
        that a node of ours that takes the whole machine is no excuse for itself.
        """
        now = _now()
        if now is None or self._begin is None:
            return 0.0, 0.0
        passed, busy, own = (new - old for new, old in zip(now, self._begin, strict=True))
        whole = max(passed, 1.0 / TICK) * (os.cpu_count() or 1)
        return min(max(busy - own, 0.0) / whole, 1.0), min(busy / whole, 1.0)

    def may_be_late(self) -> bool:
        """Return whether a test that failed should be run again."""
        others, everybody = self.used()
        return others > MOST or everybody > FULL

    def inconclusive(self) -> bool:
        """Return whether others take so much that a test that failed has proved nothing."""
        return self.used()[0] > MOST


def family_time(root: int) -> float:
    """Return the processor time [s] of a process and all below it, also of those that ended."""
    parents: dict[int, int] = {}
    used: dict[int, float] = {}
    for entry in Path('/proc').iterdir():
        if entry.name.isdigit():
            try:
                words = (entry / 'stat').read_text().rsplit(')', 1)[1].split()
            except (OSError, IndexError):      # it has just ended
                continue
            parents[int(entry.name)] = int(words[1])
            used[int(entry.name)] = sum(map(int, words[11:15])) / TICK
    total = 0.0
    for process, seconds in used.items():
        above = process
        while above in parents and above != root:
            above = parents[above]
        if above == root:
            total += seconds
    return total


def _now() -> tuple[float, float, float] | None:
    """Return the time, what all processors have been busy for, and this family [s]."""
    try:
        words = Path('/proc/stat').read_text().split('\n', 1)[0].split()[1:]
        # user, nice, system; not idle, iowait; irq, softirq, steal.
        busy = sum(int(word) for place, word in enumerate(words[:8]) if place not in (3, 4))
        # pytest-xdist's workers are children of the process that was started.
        root = os.getppid() if 'PYTEST_XDIST_WORKER' in os.environ else os.getpid()
        return time.monotonic(), busy / TICK, family_time(root)
    except (OSError, ValueError, IndexError):
        return None
