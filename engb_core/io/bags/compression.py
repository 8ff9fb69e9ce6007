# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Zstandard and lz4, with a bound on what may come out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import functools
import os
from pathlib import Path
import tempfile
from typing import IO

from backports import zstd

from engb_core.errors import InputError

__all__ = ['ZSTD_MAGIC', 'Damaged', 'decompress', 'decompress_head',
           'decompress_message', 'unpacked']

ZSTD_MAGIC = b'\x28\xb5\x2f\xfd'

# A chunk holds about 1 MiB, with camera images some 10; more than this is a damaged length field.
# It is held in memory twice: with what is cut out of it, that stays below 1 GB.
CHUNK_LIMIT = 1 << 28
# Sensor data shrinks to a tenth, that of a drive at rest to a fiftieth; a file that grows a
# hundred times more than that is a trap.
FILE_GROWTH_LIMIT = 200
_BLOCK = 1 << 20


class Damaged(Exception):
    """A stretch of a file that can't be decoded; the reader goes on behind it or stops."""


def decompress(data: bytes | memoryview, method: str, size: int) -> bytes | memoryview:
    """Return the `size` bytes that `data` holds, compressed by `method` ('', 'zstd', 'lz4').

    Raises:
        Damaged: what comes out isn't `size` bytes, or nothing comes out.
    """
    if size > CHUNK_LIMIT:
        raise Damaged(f'a chunk claims {size} bytes')
    if method == '':
        raw: bytes | memoryview = data
    elif method == 'zstd':
        raw = _zstd_bounded(data, size)
    elif method == 'lz4':
        from lz4 import frame
        try:
            raw = frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
        except (RuntimeError, EOFError, ValueError) as error:
            raise Damaged(f'lz4: {error}') from error
    else:
        raise Damaged(f'unknown compression {method!r}')
    if len(raw) != size:
        raise Damaged(f'a chunk holds {len(raw)} bytes instead of {size}')
    return raw


def decompress_head(data: bytes | memoryview, method: str, size: int) -> bytes | memoryview:
    """Return what can be had from the beginning of a chunk that was cut off (maybe nothing)."""
    if method == '':
        return data[:size]
    if method != 'zstd':
        return b''
    with contextlib.suppress(Damaged):
        return _zstd_bounded(data, min(size, CHUNK_LIMIT))
    return b''


def decompress_message(data: bytes | memoryview, limit: int = 1 << 24) -> bytes:
    """Return one message that the recorder compressed on its own (rosbag2's message mode).

    Raises:
        Damaged: no zstd frame, or more than `limit` bytes in it.
    """
    return _message_decoder()(data, limit)


@functools.cache
def _message_decoder() -> Callable[[bytes | memoryview, int], bytes]:
    """Return the fastest way to unpack many small frames."""
    try:
        import zstandard
    except ImportError:
        return _message_plainly
    # One context serves all frames; the standard way makes one each time, which costs 10 µs.
    decoder = zstandard.ZstdDecompressor()

    def unpack(data: bytes | memoryview, limit: int) -> bytes:
        try:
            if zstandard.frame_content_size(data) > limit:
                raise Damaged(f'a message of more than {limit} bytes')
            return decoder.decompress(data, max_output_size=limit, allow_extra_data=False)
        except (zstandard.ZstdError, MemoryError) as error:
            raise Damaged(f'zstd: {error}') from error

    return unpack


def _message_plainly(data: bytes | memoryview, limit: int) -> bytes:
    raw = _zstd_bounded(data, limit)
    if len(raw) > limit:
        raise Damaged(f'a message of more than {limit} bytes')
    return raw


def _zstd_bounded(data: bytes | memoryview, size: int) -> bytes:
    try:
        # One byte more than expected tells a frame that is too long from one that fits.
        unpacked: bytes = zstd.ZstdDecompressor().decompress(data, max_length=size + 1)
        return unpacked
    except (zstd.ZstdError, EOFError, MemoryError) as error:
        raise Damaged(f'zstd: {error}') from error


@contextlib.contextmanager
def unpacked(path: Path, notes: list[str]) -> Iterator[Path]:
    """Give the plain file behind a file that is zstd as a whole, deleted again afterwards.

    A plain file is given as it is. A cut-off file is unpacked up to the cut and `notes` says so.

    Raises:
        InputError: nothing can be unpacked, the disk is full, or the file grows without end.
    """
    with path.open('rb') as file:
        packed = file.read(4) == ZSTD_MAGIC
    if not packed:
        yield path
        return
    handle, name = tempfile.mkstemp(prefix='.engb-', suffix=path.with_suffix('').suffix)
    try:
        with os.fdopen(handle, 'wb') as target:
            _unpack(path, target, notes)
        yield Path(name)
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(name)


def _unpack(path: Path, target: IO[bytes], notes: list[str]) -> None:
    limit = path.stat().st_size * FILE_GROWTH_LIMIT + (1 << 24)
    written = 0
    try:
        with zstd.open(path, 'rb') as source:
            while block := source.read(_BLOCK):
                written += len(block)
                if written > limit:
                    raise InputError(f'{path}: unpacks to more than {limit >> 20} MiB; '
                                     'not a recording')
                target.write(block)
    except (zstd.ZstdError, EOFError) as error:
        if not written:
            raise InputError(f'{path}: zstd data are damaged ({error}); '
                             'copy the recording again') from error
        notes.append(f'{path.name} ends early: read up to the cut')
    except OSError as error:
        raise InputError(f'{path}: cannot be unpacked to {target.name} ({error.strerror}); '
                         'make room or set TMPDIR') from error
