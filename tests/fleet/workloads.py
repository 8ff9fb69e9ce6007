# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Work that a test hands to processes and clusters; they import it from here."""

from __future__ import annotations

import os
from pathlib import Path
import signal
import time

__all__ = ['act']


def act(task: dict) -> list[dict]:
    """Do what `task['do']` says; leave a mark for every time it was begun."""
    if 'marks' in task:
        with (Path(task['marks']) / str(task['number'])).open('a', encoding='utf-8') as file:
            file.write(f'{os.getpid()}\n')
    if task['do'] == 'die':
        os.kill(os.getpid(), signal.SIGKILL)
    if task['do'] == 'die once' and _begun(task) < 2:
        os.kill(os.getpid(), signal.SIGKILL)
    if task['do'] == 'hang':
        time.sleep(600)
    if task['do'] == 'wait':
        time.sleep(task['seconds'])
    return [{'status': 'ok', 'number': task['number'], 'process': os.getpid()}]


def _begun(task: dict) -> int:
    return len((Path(task['marks']) / str(task['number'])).read_text().splitlines())
