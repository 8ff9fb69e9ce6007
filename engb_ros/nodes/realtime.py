# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Real-time options of a node's process: scheduling, memory, processors; refused in one line."""

from __future__ import annotations

from collections.abc import Mapping
import ctypes
import os
from pathlib import Path
from typing import Any

from engb_core.errors import InputError
from engb_ros.nodes.parameters import ParameterSpec

__all__ = ['REALTIME', 'use_realtime']

REALTIME = (
    ParameterSpec('scheduling_priority', 0, 'SCHED_FIFO with this priority for all threads; 0: '
                  'as the system does', '', 0, 99),
    ParameterSpec('lock_memory', False, 'keep all memory in RAM (mlockall): no cycle waits for a '
                  'page'),
    ParameterSpec('processors', [-1], 'the only ones it runs on; [-1]: any', '', -1, 4095),
)

# mlockall(2): what is mapped now, and what will be.
_CURRENT, _FUTURE = 1, 2


def use_realtime(values: Mapping[str, Any]) -> None:
    """Apply the options to every thread that the process has by now.

    Raises:
        InputError: the system does not permit it; a node that was asked for real time must not
            run without.
    """
    chosen = {number for number in values['processors'] if number >= 0}
    priority = values['scheduling_priority']
    if chosen:
        for thread in _threads():
            try:
                os.sched_setaffinity(thread, chosen)
            except OSError as error:
                there = ', '.join(map(str, sorted(os.sched_getaffinity(0))))
                raise InputError(f'processors {sorted(chosen)}: not possible '
                                 f'({error.strerror}); there are {there}') from error
    if values['lock_memory'] and ctypes.CDLL(None, use_errno=True).mlockall(_CURRENT | _FUTURE):
        raise InputError(f'lock_memory: not permitted ({os.strerror(ctypes.get_errno())}); raise '
                         'memlock in /etc/security/limits.conf (LimitMEMLOCK of the service), or '
                         'leave it false')
    if priority:
        for thread in _threads():
            try:
                os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(priority))
            except OSError as error:
                raise InputError(
                    f'scheduling_priority {priority}: not permitted ({error.strerror}); raise '
                    'rtprio in /etc/security/limits.conf (LimitRTPRIO of the service; '
                    '--cap-add SYS_NICE in a container), or leave it 0') from error


def _threads() -> list[int]:
    """Return all threads: those of the middleware carry the messages."""
    return [int(path.name) for path in Path('/proc/self/task').iterdir()]
