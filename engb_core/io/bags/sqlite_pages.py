# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reads rosbag2's table of messages straight from the pages of an SQLite file, by numpy.

The library hands out row by row, which costs a microsecond each. A recorder only appends, so the
rows lie in leaf pages, one after another, and rows of one topic have one form
(https://www.sqlite.org/fileformat2.html, sections 1.6 and 2.1). Whatever looks otherwise ends in
`Unusual`, and the caller goes on with the library.
"""

from __future__ import annotations

from collections.abc import Iterator
import os

import numpy as np
from numpy.typing import NDArray

from engb_core.io.bags.storage import cut_out

__all__ = ['PageTable', 'Unusual']

_LEAF, _INTERIOR = 13, 5
_PAGES = 512        # leaf pages decoded at a time
_FORMS = 64         # forms of rows in one go; a bag has one or two per topic
_DEPTH = 12         # of a table's tree
# Record format: serial type → bytes of an integer (8 and 9 are the constants 0 and 1).
_INTEGER = {1: 1, 2: 2, 3: 3, 4: 4, 5: 6, 6: 8, 8: 0, 9: 0}

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Rows = Bytes | list[bytes]


class Unusual(Exception):
    """The pages hold something that only SQLite itself should take apart."""


class PageTable:
    """The messages table of a database file that nobody writes to.

    Args:
        file: file descriptor.
        root: the table's root page, counted from 1.
    """

    def __init__(self, file: int, root: int) -> None:
        self._file = file
        head = os.pread(file, 100, 0)
        size = int.from_bytes(head[16:18], 'big')
        self._size = 65536 if size == 1 else size
        self._usable = self._size - head[20]
        if len(head) < 100 or self._size < 512 or self._size & (self._size - 1):
            raise Unusual('no page size')
        self._count = os.fstat(file).st_size // self._size
        self._root = root

    def leaves(self) -> Ints:
        """Return the leaf pages of the table (k,), in the order of their rows.

        Raises:
            Unusual: a page is missing or no page of a table.
        """
        level = np.array([self._root], np.int64)
        for _ in range(_DEPTH):
            if level.size > self._count or level.min() < 2 or level.max() > self._count:
                raise Unusual('the table\'s tree is damaged')
            kind = self._page(int(level[0]))[0]
            if kind == _LEAF:
                if np.unique(level).size < level.size:
                    raise Unusual('the table\'s tree is damaged')
                return level
            if np.unique(level).size < level.size:
                raise Unusual('the table\'s tree is damaged')
            level = np.concatenate([self._children(int(page)) for page in level])
        raise Unusual('the table\'s tree is too deep')

    def all_leaves(self) -> Ints:
        """Return every page of the file that looks like a leaf of some table (k,)."""
        found = []
        for start in range(2, self._count + 1, _PAGES):
            pages = self._read(np.arange(start, min(start + _PAGES, self._count + 1)))
            found.append(start + np.flatnonzero(pages[:, 0] == _LEAF))
        return np.concatenate(found) if found else np.zeros(0, np.int64)

    def rows(self, leaves: Ints, topics: set[int], strict: bool = True) -> Iterator[
            tuple[int, int, Ints, Rows]]:
        """Decode leaf pages.

        Args:
            leaves: page numbers.
            topics: the topic ids that are wanted.
            strict: False passes over what isn't a message instead of raising.

        Yields:
            topic id, highest row id so far, times (k,) [ns], messages as `Batch.rows`.

        Raises:
            Unusual: a row isn't in rosbag2's form. All rows of earlier pages have been yielded.
        """
        for start in range(0, leaves.size, _PAGES):
            # As a list: either all rows of these pages come out, or none.
            yield from list(self._decode(self._read(leaves[start:start + _PAGES]), topics, strict))

    def _page(self, number: int) -> bytes:
        page = os.pread(self._file, self._size, (number - 1) * self._size)
        if len(page) < self._size:
            raise Unusual('a page is missing')
        return page

    def _children(self, number: int) -> Ints:
        page = self._page(number)
        count = int.from_bytes(page[3:5], 'big')
        if page[0] != _INTERIOR or 12 + 2 * count > self._size:
            raise Unusual('the table\'s tree is damaged')
        data = np.frombuffer(page, np.uint8)
        cells = np.frombuffer(page, '>u2', count, 12).astype(np.int64)
        if count and cells.max() > self._size - 4:
            raise Unusual('the table\'s tree is damaged')
        children = _big_endian(data, cells, 4)
        return np.append(children, int.from_bytes(page[8:12], 'big'))

    def _read(self, numbers: Ints) -> Bytes:
        """Read pages (k, size); in one go where they lie close together."""
        first, last = int(numbers.min()), int(numbers.max())
        if last - first < 4 * _PAGES:
            data = os.pread(self._file, (last - first + 1) * self._size, (first - 1) * self._size)
            if len(data) == (last - first + 1) * self._size:
                span = np.frombuffer(data, np.uint8).reshape(-1, self._size)
                return span if numbers.size == span.shape[0] and (
                    np.diff(numbers) == 1).all() else span[numbers - first]
        return np.frombuffer(b''.join(self._page(int(number)) for number in numbers),
                             np.uint8).reshape(-1, self._size)

    def _decode(self, pages: Bytes, topics: set[int], strict: bool) -> Iterator[
            tuple[int, int, Ints, Rows]]:
        count = pages[:, 3].astype(np.int64) << 8 | pages[:, 4]
        good = (pages[:, 0] == _LEAF) & (8 + 2 * count <= self._usable)
        if not good.all():
            if strict:
                raise Unusual('a page is no leaf of a table')
            pages, count = np.ascontiguousarray(pages[good]), count[good]
        data = pages.reshape(-1)
        page = np.repeat(np.arange(count.size), count)
        within = np.arange(page.size) - np.repeat(np.cumsum(count) - count, count)
        base = page * self._size
        cell = _big_endian(data, base + 8 + 2 * within, 2)
        # A cell: length and row id as varints, then the record; 24 bytes hold all of its heads.
        sound = cell <= self._usable - 24
        cell, base = cell[sound] + base[sound], base[sound]
        length, cell = _varint(data, cell)
        row, start = _varint(data, cell)
        blob, body = _varint(data, np.minimum(start + 4, data.size - 16))
        head = data[start].astype(np.int64)
        form = np.stack([head, data[start + 1], data[start + 2], data[start + 3]])
        fits = ((start + length <= base + self._usable) & (start + head == body)
                & (form[1] == 0) & (blob >= 12) & (blob % 2 == 0))
        # Long messages (images, point clouds) go on in pages of their own.
        long = (length > self._usable - 35) & (start + head == body) & (form[1] == 0)
        if strict and (not sound.all() or not (fits | long).all() or _any_of(
                data, body[long], form[2, long], topics)):
            raise Unusual('a row is not in rosbag2\'s form')
        highest = int(row.max(initial=0))
        left = np.flatnonzero(fits & ~long)
        for _ in range(_FORMS):
            if not left.size:
                return
            one = form[2:4, left[0]]
            same = (form[2:4, left] == one[:, None]).all(axis=0)
            chosen = left[same]
            for entry in _of_one_form(data, body[chosen], length[chosen] - head[chosen],
                                      (blob[chosen] - 12) // 2, one, topics, strict):
                yield entry[0], highest, *entry[1:]
            left = left[~same]
        if strict:
            raise Unusual('too many forms of rows')


def _any_of(data: Bytes, body: Ints, kind: Ints, topics: set[int]) -> bool:
    """Return whether one of the rows that begin at `body` (k,) belongs to `topics`."""
    return any(one not in _INTEGER or np.isin(
        _integer(data, body[kind == one], int(one)), list(topics)).any()
        for one in np.unique(kind).tolist())


def _of_one_form(data: Bytes, body: Ints, length: Ints, size: Ints, form: Ints,
                 topics: set[int], strict: bool) -> Iterator[tuple[int, Ints, Rows]]:
    """Decode rows whose topic and time are stored alike.

    `body`, `length` (k,) say where each row's fields begin and how long they are, `size` (k,) how
    long the message in them is.
    """
    kind, clock = form.tolist()
    if kind not in _INTEGER or clock not in _INTEGER or (
            length != _INTEGER[kind] + _INTEGER[clock] + size).any():
        if strict:
            raise Unusual('a row is not in rosbag2\'s form')
        return
    topic = _integer(data, body, kind)
    time = body + _INTEGER[kind]
    message = time + _INTEGER[clock]
    for key in topics:
        chosen = topic == key
        if chosen.any():
            yield key, _integer(data, time[chosen], clock), cut_out(data, message[chosen],
                                                                    size[chosen])


def _integer(data: Bytes, place: Ints, kind: int) -> Ints:
    if kind in (8, 9):
        return np.full(place.size, kind - 8, np.int64)
    size = _INTEGER[kind]
    value = _big_endian(data, place, size)
    return value if size == 8 else np.where(value >> (8 * size - 1), value - (1 << 8 * size),
                                            value)


def _big_endian(data: Bytes, place: Ints, size: int) -> Ints:
    """Return the unsigned integers of `size` bytes at `place` (k,) (8 bytes: signed)."""
    if size == 8:
        windows = np.ndarray((data.size - 7,), 'V8', data, strides=(1,))
        return windows[place].view('>i8').astype(np.int64)
    value = np.zeros(place.size, np.int64)
    for index in range(size):
        value = value << 8 | data[place + index]
    return value


def _varint(data: Bytes, place: Ints) -> tuple[Ints, Ints]:
    """Return the variable-length integers at `place` (k,) and the places behind them.

    Up to five bytes (35 bits); longer ones give what is never a sound length or row.
    """
    byte = data[place]
    value = (byte & 0x7f).astype(np.int64)
    place = place + 1
    for _ in range(4):
        more = byte > 0x7f
        if not more.any():
            break
        byte = np.where(more, data[np.minimum(place, data.size - 1)], 0)
        value = np.where(more, value << 7 | (byte & 0x7f), value)
        place = place + more
    return value, place
