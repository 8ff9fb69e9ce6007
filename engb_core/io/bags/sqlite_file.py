# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reads a .db3 file, rosbag2's storage in an SQLite database."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import itertools
import os
from pathlib import Path
import shutil
import sqlite3
import tempfile
from types import TracebackType
from urllib.parse import quote

import numpy as np

from engb_core.errors import InputError
from engb_core.io.bags.sqlite_pages import PageTable, Unusual
from engb_core.io.bags.storage import as_batch, Batch, Channel

__all__ = ['SQLITE_MAGIC', 'SqliteFile']

SQLITE_MAGIC = b'SQLite format 3\0'
_ROWS = 2_000       # rows fetched at a time; more tuples alive at once cost time, not save it
_BYTES = 1 << 24    # … and bytes; no message is longer either
_TOPICS = 10_000
# SQLite's virtual machine takes some ten steps for a row, and a row some twenty bytes: who needs
# more steps than this for each byte goes round in circles.
_STEPS_OF_BYTE, _STEPS, _EVERY = 10, 10_000_000, 100_000
_GROWTH = 1000      # a cut-off file claims at most that many times its size
_DAMAGE = (sqlite3.Error, OverflowError, ValueError, MemoryError)
# The table as rosbag2 has always made it; what the pages hold is only known for this one.
_COLUMNS = ['id', 'topic_id', 'timestamp', 'data']


class SqliteFile:
    """One .db3 file; a context manager.

    Args:
        path: the file.
        name: what notes and errors call it, where `path` is an unpacked copy.

    Raises:
        InputError: no SQLite database, or none that rosbag2 wrote.
    """

    def __init__(self, path: Path, name: str = '') -> None:
        self.path = Path(name or path)
        self.notes: list[str] = []
        self._stack = contextlib.ExitStack()
        try:
            self._file = os.open(path, os.O_RDONLY)
            self._stack.callback(os.close, self._file)
            self._cut, whole = self._whole(path)
            self._base = self._connect(whole)
            self._plain_tables()
            self._topics = list(self._read_topics())
            self._root = self._find_root(path)
        except OSError as error:
            self._stack.close()
            raise InputError(f'{self.path}: cannot be read ({error.strerror})') from error
        except _DAMAGE as error:
            self._stack.close()
            raise InputError(f'{self.path}: not a rosbag2 database ({error}); give a recording '
                             '(.mcap or .db3) or record again') from error

    def __enter__(self) -> SqliteFile:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._stack.close()

    def channels(self) -> list[Channel]:
        """Return the file's topics."""
        return [channel for _, channel in self._topics]

    def batches(self, topics: set[str]) -> Iterator[Batch]:
        """Yield the messages of `topics`, some ten thousand at a time."""
        names = {key: channel.topic for key, channel in self._topics if channel.topic in topics}
        if not names:
            return
        done = 0    # the highest row id that has been read
        if self._root:
            try:
                table = PageTable(self._file, self._root)
                leaves = table.all_leaves() if self._cut else table.leaves()
                for key, row, log_time, rows in table.rows(leaves, set(names), not self._cut):
                    yield Batch(names[key], log_time, rows)
                    done = row
                return
            except (Unusual, MemoryError):
                pass    # the library takes over behind the last row
        yield from self._by_library(names, done)

    def _whole(self, path: Path) -> tuple[bool, Path]:
        """Return whether the file is cut off, and a file that SQLite is willing to open.

        SQLite refuses a file that is shorter than its header says; a copy filled up with zeros
        lets it at least name the topics.
        """
        head = os.pread(self._file, 100, 0)
        page = int.from_bytes(head[16:18], 'big')
        size = os.fstat(self._file).st_size
        expected = (65536 if page == 1 else page) * int.from_bytes(head[28:32], 'big')
        if not size < expected < _GROWTH * size:
            return False, path
        folder = self._stack.enter_context(tempfile.TemporaryDirectory(prefix='engb-'))
        copy = Path(folder) / 'whole.db3'
        shutil.copyfile(path, copy)
        os.truncate(copy, expected)
        self.notes.append(f'{self.path.name} is cut off: read up to the cut at byte {size} of '
                          f'{expected}')
        return True, copy

    def _connect(self, path: Path) -> sqlite3.Connection:
        # A recorder that was killed leaves its last rows in a log beside the file; without one
        # the file is opened as unchanging, which works on read-only disks too.
        options = 'mode=ro' if _pending(path) else 'mode=ro&immutable=1'
        base = sqlite3.connect(f'file:{quote(str(path))}?{options}', uri=True)
        self._stack.callback(base.close)
        base.text_factory = lambda text: text.decode('utf-8', 'replace')
        base.execute('PRAGMA trusted_schema=OFF')
        base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _BYTES)
        left = [_STEPS + _STEPS_OF_BYTE * os.fstat(self._file).st_size]

        def go_on() -> bool:
            left[0] -= _EVERY
            return left[0] < 0      # true: stop

        base.set_progress_handler(go_on, _EVERY)
        return base

    def _plain_tables(self) -> None:
        """Raise ValueError unless topics and messages are tables that lie in the file: a view, a
        virtual table or a generated column computes what it likes, without end."""
        found = {name: (kind, root) for name, kind, root in self._base.execute(
            'SELECT name, type, rootpage FROM sqlite_master '
            'WHERE name IN (\'topics\', \'messages\') AND type IN (\'table\', \'view\')')}
        for name in ('topics', 'messages'):
            kind, root = found.get(name, ('', 0))
            if kind != 'table' or not isinstance(root, int) or root < 1:
                raise ValueError(f'no table of {name}')
            if any(row[6] for row in self._base.execute(f'PRAGMA table_xinfo({name})')):
                raise ValueError(f'{name} has columns that are computed')

    def _read_topics(self) -> Iterator[tuple[int, Channel]]:
        for row in self._base.execute(
                'SELECT id, name, type, serialization_format FROM topics ORDER BY id '
                f'LIMIT {_TOPICS}'):
            if isinstance(row[0], int) and isinstance(row[1], str) and isinstance(row[2], str):
                yield row[0], Channel(row[1], row[2], str(row[3]))

    def _find_root(self, path: Path) -> int:
        """Return the root page of the messages, or 0 where only the library should read them."""
        columns = [row[1:3] for row in self._base.execute('PRAGMA table_info(messages)')]
        usual = [name for name, _ in columns] == _COLUMNS and columns[0][1] == 'INTEGER'
        found = self._base.execute('SELECT rootpage FROM sqlite_master WHERE type = \'table\' '
                                   'AND name = \'messages\'').fetchone()
        if not found:
            raise ValueError('no table of messages')
        return found[0] if usual and isinstance(found[0], int) and not _pending(path) else 0

    def _by_library(self, names: dict[int, str], behind: int) -> Iterator[Batch]:
        """Yield the messages with a row id above `behind`, by SQLite's own means."""
        marks = ','.join('?' * len(names))
        query = ('SELECT topic_id, timestamp, data FROM messages '
                 f'WHERE topic_id IN ({marks}) AND id > ?', (*names, behind))
        size = os.fstat(self._file).st_size
        rows: list[tuple[int, int, bytes]] = []
        held = total = 0
        try:
            for row in self._base.execute(*query):
                rows.append(row)
                held += len(row[2]) if isinstance(row[2], (bytes, str)) else 0
                if len(rows) == _ROWS or held > _BYTES:
                    total += held
                    # Rows don't overlap; those of a log beside the file come on top.
                    if total > 2 * size + _BYTES and not _pending(self.path):
                        raise ValueError('its rows overlap')
                    yield from _batches(names, rows)
                    rows, held = [], 0
        except _DAMAGE as error:
            self.notes.append(f'{self.path.name} is damaged ({error}): read up to there')
        if rows:
            yield from _batches(names, rows)


def _pending(path: Path) -> bool:
    """Return whether changes wait beside the file that aren't in it yet."""
    return any(path.with_name(path.name + suffix).exists() for suffix in ('-wal', '-journal'))


def _batches(names: dict[int, str], rows: list[tuple[int, int, bytes]]) -> Iterator[Batch]:
    keys, times, data = zip(*rows, strict=True)
    topic, log_time = np.array(keys), np.array(times)
    if topic.dtype != np.int64 or log_time.dtype != np.int64 or set(map(type, data)) != {bytes}:
        # A column of another type than rosbag2 writes: those rows are left out.
        rows = [row for row in rows if [type(value) for value in row] == [int, int, bytes]]
        if rows:
            yield from _batches(names, rows)
        return
    for key, name in names.items():
        chosen = topic == key
        if chosen.any():
            yield as_batch(name, log_time[chosen],
                           list(itertools.compress(data, chosen.tolist())))
