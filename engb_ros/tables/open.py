# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Opens a table by what the file holds, or by its suffix where that says more."""

from __future__ import annotations

import os
from pathlib import Path

from engb_core.errors import InputError
from engb_ros.tables.apart import TableApart
from engb_ros.tables.arrays import hdf5_table, mat_table, npz_table
from engb_ros.tables.table import Table
from engb_ros.tables.text_file import TEXT_SUFFIXES, TextTable

__all__ = ['KINDS', 'is_table', 'open_here', 'open_table']

# What is read, for messages and help.
KINDS = ('.csv (.txt, .tsv, .dat, .log), .npz, .mat, .h5, .mf4 (.mdf, .dat of MDF 3), .tdms, '
         '.parquet, .arrow (.feather) or .bag (ROS 1)')
_SUFFIXES = {'.npz': 'npz', '.mat': 'mat', '.h5': 'hdf5', '.hdf5': 'hdf5', '.hdf': 'hdf5',
             '.mf4': 'mdf', '.mdf': 'mdf', '.mf3': 'mdf', '.tdms': 'tdms',
             '.parquet': 'parquet', '.pq': 'parquet', '.arrow': 'arrow', '.feather': 'arrow',
             '.bag': 'ros1', **dict.fromkeys(TEXT_SUFFIXES, 'text')}
_MAGIC = ((b'MDF     ', 'mdf'), (b'UnFinMF ', 'mdf'), (b'\x89HDF\r\n\x1a\n', 'hdf5'),
          (b'PAR1', 'parquet'), (b'ARROW1', 'arrow'), (b'TDSm', 'tdms'), (b'#ROSBAG V', 'ros1'))
# Kinds whose readers are other people's, and die of damaged files.
_APART = ('mat', 'hdf5', 'mdf', 'tdms', 'parquet', 'arrow', 'ros1')
_SIZE_LIMIT = 8 << 30       # a table is held in memory


def is_table(path: str | os.PathLike) -> bool:
    """Whether a path is that of a table rather than of a rosbag2 recording."""
    path = Path(path)
    return path.suffix.lower() in _SUFFIXES and not path.is_dir()


def open_table(path: str | os.PathLike) -> Table:
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
            raise InputError(f'{path}: the file is empty')
        if size > _SIZE_LIMIT:
            raise InputError(f'{path}: is larger than {_SIZE_LIMIT >> 30} GiB; split it')
        kind = _kind(path)
        if kind in _APART:
            return TableApart(path, kind)
        return open_here(path, kind)
    except OSError as error:
        raise InputError(f'{path}: cannot be read ({error.strerror or error})') from error


def _kind(path: Path) -> str:
    with path.open('rb') as file:
        head = file.read(16)
    kind = _SUFFIXES.get(path.suffix.lower(), '')
    if kind in ('npz', 'mat'):
        return kind
    for magic, found in _MAGIC:
        if head.startswith(magic):
            return found
    return kind


def open_here(path: Path, kind: str) -> Table:
    """Open a table of a known kind in this process.

    Raises:
        InputError: damaged, or its reader is not installed.
    """
    from engb_ros.tables import measurement
    if kind == 'text':
        return TextTable(path)
    if kind == 'npz':
        return npz_table(path)
    if kind == 'mat':
        return mat_table(path)
    if kind == 'hdf5':
        return hdf5_table(path)
    if kind == 'mdf':
        return measurement.MdfTable(path)
    if kind == 'tdms':
        return measurement.TdmsTable(path)
    if kind in ('parquet', 'arrow'):
        return measurement.ColumnarTable(path, kind.capitalize())
    if kind == 'ros1':
        return measurement.Ros1Table(path)
    raise InputError(f'{path}: kind {path.suffix or "without suffix"} is not known; give {KINDS}')
