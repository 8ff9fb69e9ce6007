# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Damages to files and to what is in them; every one follows from its random generator alone."""

from __future__ import annotations

from collections.abc import Callable
import random
import struct

__all__ = ['damage_bytes', 'damage_text', 'NUMBERS']

# Numbers at the edges of what floats and integers hold, and some that are merely absurd.
NUMBERS = [0.0, -0.0, 1.0, -1.0, float('nan'), float('inf'), -float('inf'), 1e308, -1e308, 5e-324,
           1e-300, 1e300, 1e12, -1e12, 1e-12, 2.0**31, 2.0**53, 1e6, 1e3, 3.0, 0.5]
_COUNTS = [0, 1, 2, 0x7f, 0x80, 0xff, 0xffff, 0x7fffffff, 0x80000000, 0xffffffff]
_LONG = [0, 1, 2**31, 2**32, 2**53, 2**62, 2**63 - 1, 2**63, 2**64 - 1]


def damage_bytes(data: bytes, rng: random.Random) -> bytes:
    """Return `data` with one to four damages."""
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        if not data:
            break
        data = rng.choice(_BYTES)(data, rng)
    return data


def damage_text(text: str, rng: random.Random) -> bytes:
    """Return a text file with one to four damages, by line or by byte."""
    lines = text.splitlines(keepends=True)
    for _ in range(rng.choice([1, 1, 2, 4])):
        place = rng.randrange(len(lines)) if lines else 0
        kind = rng.randrange(7)
        if not lines:
            break
        if kind == 0:
            del lines[place]
        elif kind == 1:
            lines.insert(place, rng.choice(lines))
        elif kind == 2:
            lines[place] = rng.choice([' ', '\t', '- ', 'x: ', '&a ', '*a', '!!python/object:os ',
                                       '? ', '{', '[', '"']) + lines[place]
        elif kind == 3:
            head = lines[place].split(':')[0]
            lines[place] = f'{head}: {rng.choice(_SCALARS)}\n'
        elif kind == 4:
            lines[place] = lines[place].rstrip('\n')
        elif kind == 5:
            return damage_bytes(''.join(lines).encode(), rng)
        else:
            other = rng.randrange(len(lines))
            lines[place], lines[other] = lines[other], lines[place]
    return ''.join(lines).encode()


_SCALARS = ['', 'null', 'true', '~', '[]', '{}', '[1, [2, [3]]]', '0', '-1', '.nan', '.inf',
            '-.inf', '1e400', '1e-320', '1e300', '12 N·m', '5,3', '0x1F', '2024-01-01',
            '!!binary x', '"' + 'x' * 5000 + '"', '1:30', '1_000', 'yes', '9' * 400, "'", '>', '|',
            '[' * 500 + ']' * 500]


def _truncate(data: bytes, rng: random.Random) -> bytes:
    return data[:rng.randrange(len(data))]


def _flip_bits(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 8, 64])):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _overwrite(data: bytes, rng: random.Random) -> bytes:
    size = min(len(data), rng.choice([1, 4, 16, 256, 4096]))
    place = rng.randrange(len(data) - size + 1)
    filling = rng.choice([bytes(size), b'\xff' * size, rng.randbytes(size)])
    return data[:place] + filling + data[place + size:]


def _put_number(data: bytes, rng: random.Random) -> bytes:
    number = rng.choice([struct.pack('<I', rng.choice(_COUNTS)),
                         struct.pack('>I', rng.choice(_COUNTS)),
                         struct.pack('<Q', rng.choice(_LONG)),
                         struct.pack('<d', rng.choice(NUMBERS))])
    place = rng.randrange(max(1, len(data) - len(number) + 1))
    return data[:place] + number + data[place + len(number):]


def _delete(data: bytes, rng: random.Random) -> bytes:
    size = rng.choice([1, 3, 8, 100, 5000])
    place = rng.randrange(len(data))
    return data[:place] + data[place + size:]


def _double(data: bytes, rng: random.Random) -> bytes:
    size = rng.choice([1, 8, 100, 5000])
    place = rng.randrange(len(data))
    return data[:place] + data[place:place + size] + data[place:]


def _swap(data: bytes, rng: random.Random) -> bytes:
    size = min(len(data) // 2, rng.choice([1, 8, 100, 5000]))
    if not size:
        return data
    first = rng.randrange(len(data) - 2 * size + 1)
    second = rng.randrange(first + size, len(data) - size + 1)
    return (data[:first] + data[second:second + size] + data[first + size:second]
            + data[first:first + size] + data[second + size:])


def _garbage_behind(data: bytes, rng: random.Random) -> bytes:
    return data + rng.randbytes(rng.choice([1, 100, 5000]))


_BYTES: list[Callable[[bytes, random.Random], bytes]] = [
    _truncate, _flip_bits, _flip_bits, _overwrite, _put_number, _put_number, _delete, _double,
    _swap, _garbage_behind]
