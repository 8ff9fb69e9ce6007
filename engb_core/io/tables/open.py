# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Opens a table, in a process of its own where the reader is other people's."""

from __future__ import annotations

import os
from pathlib import Path

from engb_core.errors import InputError
from engb_core.io.tables.apart import TableApart
from engb_core.io.tables.formats import kind_of, KINDS, open_here, SUFFIXES
from engb_core.io.tables.table import Table

__all__ = ['is_table', 'open_table']

# Kinds whose readers are other people's, and die of damaged files.
_APART = ('mat', 'hdf5', 'mdf', 'tdms', 'parquet', 'arrow', 'ros1')
_SIZE_LIMIT = 8 << 30       # a table is held in memory


def is_table(path: str | os.PathLike[str]) -> bool:
    """Whether a path is that of a table rather than of a rosbag2 recording."""
    # Where a folder above it may not be entered, Path.is_dir raises.
    return Path(path).suffix.lower() in SUFFIXES and not os.path.isdir(path)


def open_table(path: str | os.PathLike[str]) -> Table:
    """Open a table; its values are read when asked for.

    Raises:
        InputError: not readable, of no known kind, or its reader is not installed.
    """
    path = Path(path)
    try:
        if path.is_dir():
            raise InputError(f'{path}: is a folder; give a table: {KINDS}')
        size = path.stat().st_size
        if size == 0:
            raise InputError(f'{path}: the file is empty; export or copy it again')
        if size > _SIZE_LIMIT:
            raise InputError(f'{path}: is larger than {_SIZE_LIMIT >> 30} GiB; split it')
        kind = kind_of(path)
        if kind in _APART:
            return TableApart(path, kind)
        return open_here(path, kind)
    except FileNotFoundError:
        raise InputError(f'{path}: there is no such file; give a recording or a table '
                         'that is there') from None
    except OSError as error:
        raise InputError(f'{path}: cannot be read ({error.strerror or error}); give a file that '
                         'you may read') from error
