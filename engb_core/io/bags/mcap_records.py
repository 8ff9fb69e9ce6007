# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The records of an MCAP stream (https://mcap.dev/spec): parsing, no files."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
import struct

import numpy as np
from numpy.typing import NDArray

from engb_core.io.bags.compression import Damaged
from engb_core.io.bags.storage import cut_out

__all__ = ['Chunk', 'Directory', 'MAGIC', 'Scan', 'PAYLOAD', 'gather', 'parse_chunk_head',
           'parse_index', 'record_head', 'scan']

MAGIC = b'\x89MCAP0\r\n'

HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX = range(1, 8)
DATA_END = 0x0F

# A message record: opcode, length, channel, sequence, log time, publish time, then the payload.
_MESSAGE_HEAD = struct.Struct('<BQHIQQ')
_RECORD_HEAD = struct.Struct('<BQ')
_CHUNK_HEAD = struct.Struct('<QQQI')
_U16 = struct.Struct('<H')
_U32 = struct.Struct('<I')
_U64 = struct.Struct('<Q')
PAYLOAD = _MESSAGE_HEAD.size
# Later is a damaged clock (year 2096); half of int64's range, so that differences still fit.
_MAX_TIME = 4 * 10**18


@dataclass
class Directory:
    """Schemas and channels seen so far: schema id → type, channel id → (topic, type, encoding)."""

    schemas: dict[int, str] = field(default_factory=dict)
    channels: dict[int, tuple[str, str, str]] = field(default_factory=dict)

    def add(self, opcode: int, body: bytes | memoryview) -> None:
        """Note a schema or channel record; others are passed over.

        Raises:
            Damaged: the record is shorter than its own fields, or a name isn't text.
        """
        try:
            if opcode == SCHEMA:
                name, _ = _text(body, 2)
                self.schemas[_U16.unpack_from(body)[0]] = name
            elif opcode == CHANNEL:
                key, schema = struct.unpack_from('<HH', body)
                topic, end = _text(body, 4)
                encoding, _ = _text(body, end)
                self.channels[key] = (topic, self.schemas.get(schema, ''), encoding)
        except (struct.error, UnicodeDecodeError) as error:
            raise Damaged(f'a schema or channel record is damaged ({error})') from error


@dataclass(frozen=True)
class Chunk:
    """The head of a chunk record: where the (compressed) records start, and how to unpack them."""

    start: int          # offset of the data in the record's body
    packed: int         # their length there
    size: int           # their length when unpacked
    checksum: int       # crc32 of the unpacked data, 0: none
    compression: str


@dataclass(frozen=True)
class Scan:
    """Messages that a walk through the records found: channel id → arrays over its messages."""

    log_time: dict[int, NDArray[np.int64]]
    offset: dict[int, NDArray[np.int64]]    # of the message record
    length: dict[int, NDArray[np.int64]]    # of the payload
    end: int                                # where the walk stopped
    whole: bool                             # False: the last record is cut off


def record_head(data: bytes | memoryview, position: int = 0) -> tuple[int, int]:
    """Return a record's opcode and the length of its body."""
    return _RECORD_HEAD.unpack_from(data, position)


def parse_chunk_head(body: bytes | memoryview) -> Chunk:
    """Read a chunk record's head from the beginning of its body.

    Raises:
        Damaged: too short, or the compression's name isn't text.
    """
    try:
        _, _, size, checksum = _CHUNK_HEAD.unpack_from(body)
        compression, end = _text(body, _CHUNK_HEAD.size)
        packed = _U64.unpack_from(body, end)[0]
    except (struct.error, UnicodeDecodeError) as error:
        raise Damaged(f'a chunk record is damaged ({error})') from error
    return Chunk(end + 8, packed, size, checksum, compression)


def parse_index(body: bytes) -> tuple[int, NDArray[np.uint64]]:
    """Read a message index record: the channel id and (k, 2) of log time [ns], offset."""
    if len(body) < 6:
        raise Damaged('a message index record is damaged')
    channel = _U16.unpack_from(body)[0]
    size = _U32.unpack_from(body, 2)[0]
    if size % 16 or 6 + size > len(body):
        raise Damaged('a message index record is damaged')
    return channel, np.frombuffer(body, '<u8', size // 8, 6).reshape(-1, 2)


def gather(data: NDArray[np.uint8], channel: int, index: NDArray[np.uint64],
           ) -> tuple[NDArray[np.int64], NDArray[np.uint8]] | None:
    """Return log times (k,) [ns] and payloads (k, size) of one channel of an unpacked chunk.

    The index is checked against the records themselves; None where it doesn't hold, or where
    the payloads differ in size.
    """
    if not index.shape[0]:
        return None
    offset = index[:, 1].astype(np.int64)
    first = int(offset[0])
    if not 0 <= first <= data.size - PAYLOAD:
        return None
    length = _RECORD_HEAD.unpack(data[first:first + _RECORD_HEAD.size].tobytes())[1]
    total = _RECORD_HEAD.size + length
    # Messages don't overlap: an index that names more than fits is no index.
    if total <= PAYLOAD or offset.size * total > data.size:
        return None
    if offset.min() < 0 or offset.max() > data.size - total:
        return None
    records = cut_out(data, offset, np.full(offset.size, total))
    assert isinstance(records, np.ndarray), 'all are of one size'
    head = records.view(np.dtype({
        'names': ['opcode', 'length', 'channel', 'log_time'],
        'formats': ['u1', '<u8', '<u2', '<u8'], 'offsets': [0, 1, 9, 15], 'itemsize': total}))
    head = head[:, 0]
    if not ((head['opcode'] == MESSAGE).all() and (head['length'] == length).all()
            and (head['channel'] == channel).all()
            and (head['log_time'] == index[:, 0]).all()):
        return None
    return _times(index[:, 0]), records[:, PAYLOAD:]


def scan(data: bytes | memoryview, directory: Directory, wanted: set[int] | None) -> Scan:
    """Walk through the records of an unpacked chunk (or a chunkless stretch), one by one.

    Schemas and channels are added to `directory`. `wanted` channels only, or all of them (None).
    Stops at a record that isn't a schema, channel or message, and at one that is cut off.
    """
    # Per message log time, begin, end: as machine numbers, for there may be millions.
    found: dict[int, array[int]] = {}
    position, end, whole = 0, len(data), True
    while position < end:
        if position + _RECORD_HEAD.size > end:
            whole = False
            break
        opcode, length = _RECORD_HEAD.unpack_from(data, position)
        following = position + _RECORD_HEAD.size + length
        if opcode not in (MESSAGE, SCHEMA, CHANNEL):
            break
        if following > end:
            whole = False
            break
        if opcode == MESSAGE:
            if length < PAYLOAD - _RECORD_HEAD.size:
                break
            _, _, channel, _, log_time, _ = _MESSAGE_HEAD.unpack_from(data, position)
            if wanted is None or channel in wanted:
                found.setdefault(channel, array('Q')).extend((log_time, position, following))
        else:
            directory.add(opcode, data[position + _RECORD_HEAD.size:following])
        position = following
    log_time, offset, size = {}, {}, {}
    for channel, entries in found.items():
        table = np.frombuffer(entries, np.uint64).reshape(-1, 3)
        log_time[channel] = _times(table[:, 0])
        offset[channel] = table[:, 1].astype(np.int64)
        size[channel] = (table[:, 2] - table[:, 1]).astype(np.int64) - PAYLOAD
    return Scan(log_time, offset, size, position, whole)


def _times(log_time: NDArray[np.uint64]) -> NDArray[np.int64]:
    return np.minimum(log_time, np.uint64(_MAX_TIME)).astype(np.int64)


def _text(body: bytes | memoryview, start: int) -> tuple[str, int]:
    size = _U32.unpack_from(body, start)[0]
    end = start + 4 + size
    if end > len(body):
        raise struct.error('a text is longer than its record')
    return bytes(body[start + 4:end]).decode(), end
