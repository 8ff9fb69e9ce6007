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
from engb_ros.bags.storage import as_batch, Batch, Channel

__all__ = ['SQLITE_MAGIC', 'SqliteFile', 'whole_size']

SQLITE_MAGIC = b'SQLite format 3\0'
_ROWS = 20_000      # rows fetched at a time
_GROWTH = 1000      # a cut-off file claims at most that many times its size
_DAMAGE = (sqlite3.Error, OverflowError, ValueError, MemoryError)


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
        # A recorder that was killed leaves its last rows in a log beside the file; without one
        # the file is opened as unchanging, which works on read-only disks too.
        pending = path.with_name(path.name + '-wal')
        options = 'mode=ro' if pending.exists() else 'mode=ro&immutable=1'
        try:
            self._base = sqlite3.connect(f'file:{quote(str(path))}?{options}', uri=True)
        except sqlite3.Error as error:
            raise InputError(f'{self.path}: cannot be opened ({error})') from error
        self._base.text_factory = lambda text: text.decode('utf-8', 'replace')
        try:
            with contextlib.suppress(sqlite3.DatabaseError):
                self._base.execute('PRAGMA trusted_schema=OFF')
            self._topics = list(self._read_topics())
        except (sqlite3.Error, OverflowError, ValueError) as error:
            self._base.close()
            raise InputError(f'{self.path}: not a rosbag2 database ({error}); give a recording '
                             '(.mcap or .db3) or record again') from error

    def __enter__(self) -> SqliteFile:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._base.close()

    def _read_topics(self) -> Iterator[tuple[int, Channel]]:
        for row in self._base.execute(
                'SELECT id, name, type, serialization_format FROM topics ORDER BY id'):
            if isinstance(row[0], int) and isinstance(row[1], str) and isinstance(row[2], str):
                yield row[0], Channel(row[1], row[2], str(row[3]))

    def channels(self) -> list[Channel]:
        """Return the file's topics."""
        return [channel for _, channel in self._topics]

    def batches(self, topics: set[str]) -> Iterator[Batch]:
        """Yield the messages of `topics`, some ten thousand at a time."""
        names = {key: channel.topic for key, channel in self._topics if channel.topic in topics}
        if not names:
            return
        marks = ','.join('?' * len(names))
        query = (f'SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({marks})',
                 tuple(names))
        done = 0
        try:
            cursor = self._base.execute(*query)
            while rows := cursor.fetchmany(_ROWS):
                done += len(rows)
                yield from _batches(names, rows)
        except _DAMAGE as error:
            self.notes.append(f'{self.path.name} is damaged ({error}): read up to there')
            # The failed fetch took the rows before the damage with it.
            rows = []
            with contextlib.suppress(*_DAMAGE):
                for row in itertools.islice(self._base.execute(*query), done, None):
                    rows.append(row)
            if rows:
                yield from _batches(names, rows)


@contextlib.contextmanager
def whole_size(path: Path, notes: list[str]) -> Iterator[Path]:
    """Give a file that SQLite is willing to open: a cut-off one as a copy, filled up with zeros.

    SQLite refuses a file that is shorter than its header says, though the rows before the cut
    are there.
    """
    with path.open('rb') as file:
        head = file.read(100)
        page = int.from_bytes(head[16:18], 'big')
        size = os.fstat(file.fileno()).st_size
        expected = (65536 if page == 1 else page) * int.from_bytes(head[28:32], 'big')
        if not size < expected < _GROWTH * size:
            yield path
            return
        with tempfile.NamedTemporaryFile(prefix='engb-', suffix='.db3') as copy:
            file.seek(0)
            shutil.copyfileobj(file, copy)
            copy.truncate(expected)
            copy.flush()
            notes.append(f'{path.name} is cut off: read up to the cut at byte {size} of '
                         f'{expected}')
            yield Path(copy.name)


def _batches(names: dict[int, str], rows: list[tuple]) -> Iterator[Batch]:
    keys, times, data = zip(*rows, strict=True)
    topic = np.array([key if type(key) is int else -1 for key in keys], np.int64)
    for key, name in names.items():
        where = np.flatnonzero(topic == key).tolist()
        good = [index for index in where
                if type(data[index]) is bytes and type(times[index]) is int]
        if good:
            yield as_batch(name, np.array([times[index] for index in good], np.int64),
                           [data[index] for index in good])
