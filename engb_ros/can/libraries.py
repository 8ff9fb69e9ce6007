# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Imports of python-can and cantools that leave out what no node needs."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import sys

__all__ = ['without_file_formats']


@contextlib.contextmanager
def without_file_formats() -> Iterator[None]:
    """Within, `import can` finds no asammdf, and imports none: it takes two seconds of processor
    time, in which a bridge that was restarted says nothing of its drive, for files that no node
    reads. It can be imported as ever afterwards."""
    if 'asammdf' in sys.modules:
        yield
        return
    sys.modules['asammdf'] = None   # type: ignore[assignment]
    try:
        yield
    finally:
        del sys.modules['asammdf']
