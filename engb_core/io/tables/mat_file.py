# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Looks through a MATLAB file of version 5 before SciPy reads it.

SciPy's reader follows cells in cells until the stack ends, and unpacks whatever is packed: a file
of kilobytes can end the process, or take all of its memory.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import struct
import zlib

from engb_core.errors import InputError
from engb_core.io.tables.table import damaged

__all__ = ['check_mat']

_MATRIX, _COMPRESSED = 14, 15
# Classes of a matrix that hold other matrices: cell, struct, object.
_CELL, _STRUCT, _OBJECT = 1, 2, 3
# Signals in structs in cells of a bench program go four or five deep.
_DEEPEST = 32
_STEP = 1 << 20


def check_mat(path: Path, most: int) -> None:
    """Check what a .mat file of version 5 claims; other versions pass.

    Args:
        path: the file.
        most: bytes that its variables may take when unpacked.

    Raises:
        InputError: it unpacks to more, ends too soon, or is nested without sense.
    """
    with path.open('rb') as file:
        head = file.read(128)
        if head[126:128] not in (b'IM', b'MI'):
            return
        order = '<' if head[126:128] == b'IM' else '>'
        data = memoryview(file.read(most + 1))
    left = most - len(data)
    if left < 0:
        raise InputError(f'{path}: holds more than the {most >> 20} MiB that are read at once; '
                         'save fewer variables, or with -v7.3')
    try:
        for kind, body in _elements(data, order):
            if kind == _COMPRESSED:
                body = memoryview(_unpacked(path, body, left, most))
                left -= len(body)
                for inner, matrix in _elements(body, order):
                    if inner == _MATRIX:
                        _check_matrix(matrix, order, _DEEPEST)
            elif kind == _MATRIX:
                _check_matrix(body, order, _DEEPEST)
    except (ValueError, struct.error, zlib.error) as error:
        raise damaged(path, 'not a usable .mat file', error) from error


def _unpacked(path: Path, packed: memoryview, left: int, most: int) -> bytes:
    stream = zlib.decompressobj()
    parts, data = [], bytes(packed)
    while data and not stream.eof:
        parts.append(stream.decompress(data, _STEP))
        left -= len(parts[-1])
        if left < 0:
            raise InputError(f'{path}: unpacks to more than the {most >> 20} MiB that are read at '
                             'once; save fewer variables, or with -v7.3')
        data = stream.unconsumed_tail
    return b''.join(parts)


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Yield type and content of each element; one that is cut short gives what there is."""
    place = 0
    while place + 8 <= len(data):
        kind, size = struct.unpack_from(f'{order}II', data, place)
        if kind >> 16:      # small: size, type and at most four bytes of content in eight
            yield kind & 0xffff, data[place + 4:place + 4 + min(kind >> 16, 4)]
            place += 8
            continue
        yield kind, data[place + 8:place + 8 + size]
        # All but compressed elements end at a multiple of eight bytes.
        place += 8 + size + (0 if kind == _COMPRESSED else -size % 8)


def _check_matrix(data: memoryview, order: str, deep: int) -> None:
    if deep == 0:
        raise ValueError(f'cells or structs nested more than {_DEEPEST} deep')
    flags = next(_elements(data, order), (0, b''))[1]
    if len(flags) < 4 or struct.unpack_from(f'{order}I', flags)[0] & 0xff not in (
            _CELL, _STRUCT, _OBJECT):
        return
    for kind, inner in _elements(data, order):
        if kind == _MATRIX:
            _check_matrix(inner, order, deep - 1)
