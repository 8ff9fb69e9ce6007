# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Starts a node, which a signal ends without a traceback from its first moment on.

    python -m engb_ros.start controller --ros-args …

Importing ROS takes up to a second, in which Python's own reaction to Ctrl-C is a traceback in the
midst of an import. Nothing has begun by then, so the process may simply end.
"""

from __future__ import annotations

from functools import partial
from importlib import import_module
import os
import signal
import sys

__all__ = ['start']


def start(node: str) -> int:
    """Import and run a node of this package, or of any module: a name with a dot."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(0))   # `run` puts its own in their place
    module = node if '.' in node else f'engb_ros.nodes.{node}'
    status: int = import_module(module).main()
    # Python gives a signal's own effect back as it ends: the second of two (Ctrl-C under launch
    # comes from the terminal and from launch) would kill what is ending well.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    return status


# What the executables are made of (setup.py).
can_bridge = partial(start, 'can_bridge')
controller = partial(start, 'controller')
disturbance_observer = partial(start, 'disturbance_observer')
drive_emulator = partial(start, 'drive_emulator')
excitation = partial(start, 'excitation')
identifier = partial(start, 'identifier')
monitor = partial(start, 'monitor')
plant = partial(start, 'plant')
recorder = partial(start, 'recorder')


if __name__ == '__main__':
    sys.exit(start(sys.argv.pop(1)))
