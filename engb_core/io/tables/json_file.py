# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reads tables of JSON: records one below another, columns side by side, or one record a line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.io.tables.arrays import ArrayTable, MOST_COLUMNS
from engb_core.io.tables.table import damaged, MOST_BYTES

__all__ = ['json_table']

Array = NDArray[np.float64]

# So many times its size a text of records takes in memory while it is read, as loggers write them
# (6.5 times, six numbers of six digits a record).
_GROWS = 8
# Objects within objects that are looked into.
_DEEPEST = 8


def json_table(path: Path) -> ArrayTable:
    """Open a .json file of records ([{"t": 0, …}, …]) or columns ({"t": [0, …], …}), at its top or
    within objects, or a file with one record a line (.jsonl).

    Raises:
        InputError: no JSON, too large, or no column of numbers in it.
    """
    size = path.stat().st_size
    if _GROWS * size > MOST_BYTES:
        raise InputError(f'{path}: is too large for JSON ({size >> 20} MiB); export it as .csv')
    try:
        text = path.read_text('utf-8-sig')
        content = _content(text)
    except (ValueError, RecursionError) as error:
        raise damaged(path, 'not usable JSON', error) from error
    columns = dict(_columns(content))
    return ArrayTable(path, 'JSON', {name: (values.shape, '', partial(np.asarray, values))
                                     for name, values in columns.items()})


def _content(text: str) -> object:
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        lines = [line for line in text.splitlines() if line.strip()]
        if error.msg != 'Extra data' or len(lines) < 2:
            raise
        return [json.loads(line) for line in lines]


def _columns(content: object) -> Iterator[tuple[str, Array]]:
    """Yield the columns (n,) of numbers within a file, by the names on the way to them; a list of
    records adds none, as what it is called says nothing of its columns."""
    for name, value in _leaves(content):
        if isinstance(value, list) and any(isinstance(entry, dict) for entry in value):
            yield from _of_records([entry if isinstance(entry, dict) else {} for entry in value])
        elif isinstance(value, list) and name:
            yield from _of_values(value, name)


def _of_records(records: list[dict[str, Any]]) -> Iterator[tuple[str, Array]]:
    flat = [dict(_leaves(record, of_lists=True)) for record in records]
    for name in dict.fromkeys(key for record in flat for key in record):
        yield from _of_values([record.get(name) for record in flat], name)


def _leaves(value: object, name: str = '', deep: int = _DEEPEST, of_lists: bool = False,
            ) -> Iterator[tuple[str, object]]:
    """Yield what no object holds any further, and `of_lists` no short list, by the names on the
    way to it."""
    inner: Iterable[tuple[object, object]] | None = None
    if isinstance(value, dict):
        inner = value.items()
    elif of_lists and isinstance(value, list) and len(value) <= MOST_COLUMNS:
        inner = enumerate(value)
    if inner is None or not deep:
        yield name, value
        return
    for key, entry in inner:
        yield from _leaves(entry, f'{name}.{key}' if name else str(key), deep - 1, of_lists)


def _of_values(values: list[Any], name: str) -> Iterator[tuple[str, Array]]:
    """Yield a column of these values, where numbers are among them; what is none is not finite."""
    numbers = np.array([float(entry) if isinstance(entry, int | float) and abs(entry) < 1e300
                        else np.nan for entry in values], float)
    if np.isfinite(numbers).any():
        yield name, numbers
