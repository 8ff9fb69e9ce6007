# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The kinds of tables: told by what the file holds, or by its suffix where that says more."""

from __future__ import annotations

from pathlib import Path

from engb_core.errors import InputError
from engb_core.io.tables.arrays import hdf5_table, mat_table, npz_table
from engb_core.io.tables.json_file import json_table
from engb_core.io.tables.table import Table
from engb_core.io.tables.text_file import TEXT_SUFFIXES, TextTable

__all__ = ['KINDS', 'SUFFIXES', 'kind_of', 'open_here']

# What is read, for messages and help.
KINDS = ('.csv (.txt, .tsv, .dat, .log), .json (.jsonl), .npz, .mat, .h5, '
         '.mf4 (.mdf, .dat of MDF 3), .tdms, .parquet, .arrow (.feather) or .bag (ROS 1)')
SUFFIXES = {'.npz': 'npz', '.mat': 'mat', '.h5': 'hdf5', '.hdf5': 'hdf5', '.hdf': 'hdf5',
             '.mf4': 'mdf', '.mdf': 'mdf', '.mf3': 'mdf', '.tdms': 'tdms',
             '.parquet': 'parquet', '.pq': 'parquet', '.arrow': 'arrow', '.feather': 'arrow',
             '.json': 'json', '.jsonl': 'json', '.ndjson': 'json', '.bag': 'ros1',
             **dict.fromkeys(TEXT_SUFFIXES, 'text')}
_MAGIC = ((b'MDF     ', 'mdf'), (b'UnFinMF ', 'mdf'), (b'\x89HDF\r\n\x1a\n', 'hdf5'),
          (b'PAR1', 'parquet'), (b'ARROW1', 'arrow'), (b'TDSm', 'tdms'), (b'#ROSBAG V', 'ros1'))


def kind_of(path: Path) -> str:
    """Return the kind of a file, one word, '' where nothing tells it."""
    with path.open('rb') as file:
        head = file.read(16)
    kind = SUFFIXES.get(path.suffix.lower(), '')
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
    from engb_core.io.tables import measurement
    if kind == 'text':
        return TextTable(path)
    if kind == 'json':
        return json_table(path)
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
