# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Decodes JointState and Float64 messages, a whole batch at once where their layout is the same.

CDR (OMG CORBA 3.3, part 2, 9.3): 4 bytes of encapsulation, then the fields, each aligned to its
own size, counted from behind the encapsulation. Where frame, names and counts are the same, every
value of a JointState lies at the same place in each message; `JointLayout.matches` checks it.
"""

from __future__ import annotations

from dataclasses import dataclass
import struct

import numpy as np
from numpy.typing import NDArray

from engb_core.io.bags.compression import Damaged

__all__ = ['JointLayout', 'float64_values', 'parse_joint_state']

_BASE = 4                   # bytes of encapsulation, from which alignment counts
_NAMES_LIMIT = 10_000       # joints; more is a damaged count
_NO_OFFSET = -1


@dataclass(frozen=True)
class JointLayout:
    """Where the fields of a JointState message lie.

    Attributes:
        size: length of the message in bytes.
        order: '<' or '>', the byte order.
        names: the joints' names.
        fixed: (offset, bytes) of everything that decides the layout.
        position, velocity, effort: (offset, count) of the three sequences' numbers.
    """

    size: int
    order: str
    names: tuple[str, ...]
    fixed: tuple[tuple[int, bytes], ...]
    position: tuple[int, int]
    velocity: tuple[int, int]
    effort: tuple[int, int]

    def matches(self, rows: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Return which of `rows` (k, size) have this layout (k,)."""
        view = rows.view(np.dtype({
            'names': [f'f{index}' for index in range(len(self.fixed))],
            'formats': [f'V{len(value)}' if len(value) not in (1, 2, 4, 8)
                        else f'u{len(value)}' for _, value in self.fixed],
            'offsets': [offset for offset, _ in self.fixed], 'itemsize': self.size}))[:, 0]
        good = np.ones(rows.shape[0], bool)
        for index, (_, value) in enumerate(self.fixed):
            column = view[f'f{index}']
            good &= column == np.frombuffer(value, column.dtype)[0]
        return good

    def decode(self, rows: NDArray[np.uint8], joint: int) -> tuple[NDArray[np.int64],
                                                                   NDArray[np.float64]]:
        """Return stamps (k,) [ns] and (3, k) position, velocity, effort of joint number `joint`.

        A sequence that is too short for the joint gives NaN.
        """
        formats = {'sec': (f'{self.order}i4', _BASE), 'nanosec': (f'{self.order}u4', _BASE + 4)}
        for name in ('position', 'velocity', 'effort'):
            offset, count = getattr(self, name)
            if joint < count:
                formats[name] = (f'{self.order}f8', offset + 8 * joint)
        view = rows.view(np.dtype({
            'names': list(formats), 'formats': [kind for kind, _ in formats.values()],
            'offsets': [offset for _, offset in formats.values()], 'itemsize': self.size}))[:, 0]
        stamp = view['sec'].astype(np.int64) * 1_000_000_000 + view['nanosec']
        values = np.full((3, rows.shape[0]), np.nan)
        for index, name in enumerate(('position', 'velocity', 'effort')):
            if name in formats:
                values[index] = view[name]
        return stamp, values


def parse_joint_state(message: bytes) -> JointLayout:
    """Find the fields of one JointState message.

    Raises:
        Damaged: the message is not a JointState in plain CDR.
    """
    if len(message) < _BASE or message[0] != 0 or message[1] > 1:
        raise Damaged('not plain CDR')
    order = '<' if message[1] else '>'
    fixed: list[tuple[int, bytes]] = [(0, message[:2])]
    number = struct.Struct(f'{order}I')

    def count(position: int) -> tuple[int, int]:
        """Read an aligned uint32, on which the layout hangs; return it and the place behind."""
        position += -(position - _BASE) % 4
        value = number.unpack_from(message, position)[0]
        fixed.append((position, message[position:position + 4]))
        return value, position + 4

    def numbers(position: int) -> tuple[tuple[int, int], int]:
        size, position = count(position)
        if not size:
            return (_NO_OFFSET, 0), position
        position += -(position - _BASE) % 8
        if position + 8 * size > len(message):
            raise Damaged('a sequence is longer than its message')
        return (position, size), position + 8 * size

    try:
        size, position = count(_BASE + 8)       # the frame's name: any text of that length
        position += size
        joints, position = count(position)
        if joints > min(_NAMES_LIMIT, len(message)):
            raise Damaged(f'a message claims {joints} joints')
        names = []
        for _ in range(joints):
            size, position = count(position)
            text = message[position:position + size]
            if len(text) < size:
                raise Damaged('a joint\'s name is longer than its message')
            if size:
                fixed.append((position, text))
            names.append(text.rstrip(b'\0').decode('utf-8', 'replace'))
            position += size
        where, position = numbers(position)
        speed, position = numbers(position)
        effort, position = numbers(position)
    except struct.error as error:
        raise Damaged('a message ends early') from error
    return JointLayout(len(message), order, tuple(names), tuple(fixed), where, speed, effort)


def float64_values(rows: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Decode (k, size) Float64 messages of one size; NaN where a message is none."""
    values = np.full(rows.shape[0], np.nan)
    if rows.shape[1] < _BASE + 8:
        return values
    for code, order in ((1, '<'), (0, '>')):
        good = (rows[:, 0] == 0) & (rows[:, 1] == code)
        if good.all():
            return _float64(rows, order)
        if good.any():
            values[good] = _float64(rows[good], order)
    return values


def _float64(rows: NDArray[np.uint8], order: str) -> NDArray[np.float64]:
    view = rows.view(np.dtype({'names': ['data'], 'formats': [f'{order}f8'], 'offsets': [_BASE],
                               'itemsize': rows.shape[1]}))
    return view['data'][:, 0].astype(np.float64)
