# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reads an MCAP file by its chunks, whole ones through their message index.

A file that was cut off (a recorder killed, a disk full) is read up to the cut, one that is
damaged inside without the damaged chunks; `McapFile.notes` tells.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Generator, Iterator
import os
from pathlib import Path
from types import TracebackType
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.io.bags import mcap_records as mcap
from engb_core.io.bags.compression import (
    CHUNK_LIMIT,
    Damaged,
    decompress,
    decompress_head,
    FILE_GROWTH_LIMIT,
)
from engb_core.io.bags.storage import as_batch, Batch, Channel, cut_out

__all__ = ['McapFile']

_STRETCH = 1 << 22      # how much of a file without chunks is scanned at a time
_HEAD = 9               # opcode and length of a record
_CHUNK_INDEX = 0x08
_SUMMARY_LIMIT = 1 << 26    # a hundred bytes for each chunk: of a file of a terabyte
_FOOTER_SIZE = _HEAD + 20 + len(mcap.MAGIC)


# Channel id, log times (k,) [ns], and payloads as in `Batch.rows`.
_Stretch = tuple[int, NDArray[np.int64], NDArray[np.uint8] | list[bytes]]


class McapFile:
    """One .mcap file; a context manager.

    Args:
        path: the file.
        name: what notes and errors call it, where `path` is an unpacked copy.

    Raises:
        InputError: not readable, empty, or not MCAP.
    """

    def __init__(self, path: Path, name: str = '') -> None:
        self.path = Path(name or path)
        self.notes: list[str] = []
        try:
            self._file = os.open(path, os.O_RDONLY | getattr(os, 'O_BINARY', 0))
        except OSError as error:
            raise InputError(f'{self.path}: cannot be read ({error.strerror})') from error
        self._size = os.fstat(self._file).st_size
        if self._read(0, len(mcap.MAGIC)) != mcap.MAGIC:
            os.close(self._file)
            raise InputError(f'{self.path}: not an MCAP file (its first bytes are wrong); '
                             'give a rosbag2 recording (.mcap or .db3)')
        self._directory = mcap.Directory()
        self._chunk_starts: list[int] = []
        self._grown = 0             # bytes that came out of chunks so far
        self._complete = False      # the directory holds every channel of the file
        self._closed = self._read(self._size - len(mcap.MAGIC), len(mcap.MAGIC)) == mcap.MAGIC
        self._read_summary()

    def __enter__(self) -> McapFile:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        os.close(self._file)

    def channels(self) -> list[Channel]:
        """Return the file's topics; scans the file where it has no summary."""
        if not self._complete:
            list(self._stretches(set()))    # of no topic: what it passes are schemas and channels
            self._complete = True
        return [Channel(*entry) for entry in self._directory.channels.values()]

    def batches(self, topics: set[str]) -> Iterator[Batch]:
        """Yield the messages of `topics` chunk by chunk."""
        self.notes.clear()      # of `channels`; reading the messages tells again
        self._grown = 0
        for channel, log_time, rows in self._stretches(topics):
            topic = self._directory.channels[channel][0]
            if isinstance(rows, list):
                yield as_batch(topic, log_time, rows)
            else:
                yield Batch(topic, log_time, rows)

    def _read(self, start: int, size: int) -> bytes:
        size = min(size, self._size - start)
        if size <= 0:
            return b''
        try:
            return os.pread(self._file, size, start)
        except OSError as error:
            raise InputError(f'{self.path}: cannot be read at byte {start} '
                             f'({error.strerror}); copy the recording again') from error

    def _read_summary(self) -> None:
        """Take channels and the places of chunks from the end of the file, if it is there."""
        footer = self._read(self._size - _FOOTER_SIZE, _FOOTER_SIZE)
        if len(footer) < _FOOTER_SIZE or not self._closed:
            return
        start = int.from_bytes(footer[_HEAD:_HEAD + 8], 'little')
        if footer[0] != mcap.FOOTER or not 0 < start < self._size:
            return
        if self._size - start > _SUMMARY_LIMIT:
            return
        summary = self._read(start, self._size - start - _FOOTER_SIZE)
        position = 0
        try:
            while position + _HEAD <= len(summary):
                opcode, length = mcap.record_head(summary, position)
                body = summary[position + _HEAD:position + _HEAD + length]
                if opcode == _CHUNK_INDEX and len(body) >= 24:
                    self._chunk_starts.append(int.from_bytes(body[16:24], 'little'))
                else:
                    self._directory.add(opcode, body)
                position += _HEAD + length
        except Damaged:
            return
        finally:
            self._chunk_starts.sort()
        self._complete = bool(self._directory.channels)

    def _wanted(self, topics: set[str]) -> set[int]:
        return {key for key, entry in self._directory.channels.items() if entry[0] in topics}

    def _stretches(self, topics: set[str]) -> Iterator[_Stretch]:
        """Walk through the file; yield channel id, log times and payloads of `topics`."""
        position = len(mcap.MAGIC)
        while True:
            head = self._read(position, _HEAD)
            if len(head) < _HEAD:
                self.notes.append(f'{self.path.name} was not closed by its recorder: '
                                  f'read up to its end at byte {self._size}')
                return
            opcode, length = mcap.record_head(head)
            if opcode in (mcap.DATA_END, mcap.FOOTER):
                if not self._closed:
                    self.notes.append(f'{self.path.name} has lost its end, where the index is; '
                                      'all messages were read')
                return
            following = position + _HEAD + length
            try:
                if following > self._size and not self._later_chunk(position):
                    if opcode == mcap.CHUNK:
                        yield from self._cut_chunk(position, topics)
                    self.notes.append(f'{self.path.name} is cut off: read up to the cut at '
                                      f'byte {self._size}')
                    return
                if opcode == mcap.MESSAGE:
                    following = yield from self._loose(position, topics)
                elif opcode == mcap.CHUNK:
                    yield from self._chunk(position, length, topics)
                elif opcode in (mcap.SCHEMA, mcap.CHANNEL):
                    self._directory.add(opcode, self._read(position + _HEAD,
                                                           min(length, CHUNK_LIMIT)))
                elif opcode == 0 or mcap.DATA_END < opcode < 0x80 or following > self._size:
                    raise Damaged('no record')
            except Damaged as error:
                # Where the summary knows of a later chunk, the damage is local.
                resume = self._later_chunk(position)
                whole = opcode == mcap.CHUNK and following <= self._size
                self.notes.append(f'{self.path.name} is damaged at byte {position} ({error}): '
                                  + ('that part is left out' if resume or whole else
                                     'read up to there'))
                if not whole:
                    if not resume:
                        return
                    following = resume
            position = following

    def _later_chunk(self, position: int) -> int:
        place = bisect_right(self._chunk_starts, position)
        later = self._chunk_starts[place] if place < len(self._chunk_starts) else 0
        return later if later < self._size else 0

    def _chunk(self, position: int, length: int, topics: set[str]) -> Iterator[_Stretch]:
        if length > min(CHUNK_LIMIT, self._size - position - _HEAD):
            raise Damaged(f'a chunk claims {length} bytes')
        body = memoryview(self._read(position + _HEAD, length))
        chunk = mcap.parse_chunk_head(body)
        if chunk.start + chunk.packed > len(body):
            raise Damaged('a chunk claims more bytes than its record')
        wanted = self._wanted(topics)
        indexes = self._indexes(position + _HEAD + length, wanted) if self._complete else None
        if indexes == {}:
            return      # a chunk without any message of these topics
        self._grown += chunk.size if chunk.size <= CHUNK_LIMIT else 0
        if self._grown > FILE_GROWTH_LIMIT * self._size + CHUNK_LIMIT:
            raise InputError(f'{self.path}: unpacks to more than {self._grown >> 20} MiB; not a '
                             'recording')
        raw = decompress(body[chunk.start:chunk.start + chunk.packed], chunk.compression,
                         chunk.size)
        if chunk.checksum and crc32(raw) != chunk.checksum:
            raise Damaged('a chunk\'s checksum is wrong')
        data = np.frombuffer(raw, np.uint8)
        gathered = []
        for channel, index in (indexes or {}).items():
            found = mcap.gather(data, channel, index)
            if found is None:
                break
            gathered.append((channel, *found))
        else:
            if indexes is not None:
                yield from gathered
                return
        end = yield from self._scanned(raw, data, topics)
        if end < len(raw):
            self.notes.append(f'{self.path.name}: the chunk at byte {position} is damaged inside, '
                              f'its last {len(raw) - end} bytes are left out')

    def _indexes(self, position: int, wanted: set[int]) -> dict[int, NDArray[np.uint64]] | None:
        """Return the message indexes behind a chunk, or None where there are none to trust."""
        found: dict[int, NDArray[np.uint64]] = {}
        seen = False
        while True:
            head = self._read(position, _HEAD + 2)
            if len(head) < _HEAD + 2 or head[0] != mcap.MESSAGE_INDEX:
                return found if seen else None
            seen = True
            _, length = mcap.record_head(head)
            channel = int.from_bytes(head[_HEAD:], 'little')
            if channel not in self._directory.channels or channel in found:
                return None
            if channel in wanted:
                try:
                    _, found[channel] = mcap.parse_index(
                        self._read(position + _HEAD, min(length, CHUNK_LIMIT)))
                except Damaged:
                    return None
            position += _HEAD + length

    def _scanned(self, raw: bytes | memoryview, data: NDArray[np.uint8], topics: set[str],
                 ) -> Generator[_Stretch, None, int]:
        """Walk through unpacked records one by one; return where the walk ended."""
        result = mcap.scan(raw, self._directory, self._wanted(topics)
                           if self._complete else None)
        wanted = self._wanted(topics)
        for channel in result.log_time:
            if channel in wanted:
                yield channel, result.log_time[channel], cut_out(
                    data, result.offset[channel] + mcap.PAYLOAD, result.length[channel])
        return result.end

    def _cut_chunk(self, position: int, topics: set[str]) -> Iterator[_Stretch]:
        """Take what is whole out of the chunk in which the file ends."""
        if self._size - position > CHUNK_LIMIT:
            return
        body = memoryview(self._read(position + _HEAD, self._size))
        try:
            chunk = mcap.parse_chunk_head(body)
        except Damaged:
            return      # cut off within the head: nothing is in it
        raw = decompress_head(body[chunk.start:], chunk.compression, chunk.size)
        yield from self._scanned(raw, np.frombuffer(raw, np.uint8), topics)

    def _loose(self, position: int, topics: set[str]) -> Generator[_Stretch, None, int]:
        """Read a stretch of messages that lie in no chunk; return where it ends."""
        _, length = mcap.record_head(self._read(position, _HEAD))
        if length > CHUNK_LIMIT:
            raise Damaged(f'a message claims {length} bytes')
        raw = self._read(position, max(_STRETCH, length + _HEAD))
        end = yield from self._scanned(raw, np.frombuffer(raw, np.uint8), topics)
        if not end:
            raise Damaged('a message record is damaged')
        return position + end
