# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Writes rows as .csv and, where pyarrow is installed, as .parquet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import contextlib
import csv
import os
from pathlib import Path
import tempfile
from typing import Any

from engb_core.text.printable import printable

__all__ = ['write_table']


def write_table(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Write `rows`, which all have the same keys, to `path`.csv and `path`.parquet, whole each.

    A .parquet of a former run goes where it can't be written anew.
    """
    with _whole(path.with_suffix('.csv')) as name, open(
            name, 'w', encoding='utf-8', newline='') as file:
        writer = csv.DictWriter(file, list(rows[0]) if rows else ['recording'])
        writer.writeheader()
        writer.writerows({name: _plain(value) for name, value in row.items()} for row in rows)
    target = path.with_suffix('.parquet')
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        target.unlink(missing_ok=True)
        return
    names = list(rows[0]) if rows else ['recording']
    table = pyarrow.table({name: _column([row[name] for row in rows]) for name in names})
    with _whole(target) as name:
        parquet.write_table(table, name)


def _plain(value: Any) -> Any:
    """Return a cell that no spreadsheet takes for a formula and that is text for all others: names
    come out of recordings, and paths may hold bytes that are no UTF-8."""
    if not isinstance(value, str):
        return value
    formula = value.startswith(('=', '+', '-', '@', '\t', '\r'))
    return f"'{printable(value)}" if formula else printable(value)


def _column(values: list[Any]) -> Any:
    """Return one column with one type: numbers as doubles, the rest as text."""
    import pyarrow
    given = [value for value in values if value is not None]
    if given and all(isinstance(value, (int, float)) for value in given):
        return pyarrow.array([None if value is None else float(value) for value in values],
                             pyarrow.float64())
    return pyarrow.array([None if value is None else printable(str(value)) for value in values],
                         pyarrow.string())


@contextlib.contextmanager
def _whole(target: Path) -> Iterator[str]:
    """Give a hidden file beside `target` that takes its place once it is written."""
    handle, name = tempfile.mkstemp(dir=target.parent, prefix='.', suffix='.part')
    os.close(handle)
    try:
        yield name
        os.chmod(name, 0o644)
        os.replace(name, target)
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(name)
