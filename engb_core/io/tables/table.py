# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What every format of a table offers: named channels with units, read one by one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
import re

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.io.tables.units import parse_title

__all__ = ['MOST_BYTES', 'Channel', 'Samples', 'Table', 'damaged', 'numbers_of']

Array = NDArray[np.float64]

# Channels that an error message lists.
_SHOWN = 20
# What a table may take of the memory. A file of kilobytes can claim terabytes: what it claims is
# held against this before anything is read. Three signals of 16 million samples are within it.
MOST_BYTES = 400 << 20


@dataclass(frozen=True)
class Channel:
    """One signal of a table.

    Attributes:
        name: as the file has it; unique within the file but for repeated titles of a text.
        unit: as the file says it, in its title, a row of units or an attribute; '' unknown.
        size: number of samples; None where only reading would tell.
        group: what shares a clock with it: a folder of the file, or '' for all.
        clocked: whether the format itself gives the samples' times.
    """

    name: str
    unit: str = ''
    size: int | None = None
    group: str = ''
    clocked: bool = False

    @property
    def short(self) -> str:
        """The name without its unit."""
        return parse_title(self.name)[0]


@dataclass(frozen=True)
class Samples:
    """A channel's values (n,), not finite where the file holds none, and, where the format gives
    them, their times (n,) [s] on the file's one clock."""

    value: Array
    time: Array | None = None


class Table(ABC):
    """A file of channels. `kind` names its format in messages."""

    kind = ''

    def __init__(self, path: Path, channels: Iterable[Channel]) -> None:
        self.path = path
        self.channels = tuple(channels)

    @abstractmethod
    def read(self, channels: Iterable[int]) -> dict[int, Samples]:
        """Return the channels of these numbers.

        Raises:
            InputError: text instead of numbers, or a damaged file.
        """

    def check_size(self, channels: Iterable[int]) -> None:
        """Refuse channels that together would take more memory than a table may.

        Raises:
            InputError: says how much the file claims to hold.
        """
        claimed = sum(8 * (self.channels[place].size or 0)
                      * (2 if self.channels[place].clocked else 1) for place in set(channels))
        if claimed > MOST_BYTES:
            raise InputError(f'{self.path}: says that its columns hold {claimed >> 20} MiB, more '
                             f'than the {MOST_BYTES >> 20} MiB that are read at once; cut or '
                             'thin out the recording')

    def find(self, wanted: str) -> int:
        """Return the number of the channel that a user names: its name with or without the unit,
        the end of its path, or its number, counted from 0.

        Raises:
            InputError: there is none of that name, or several; lists those there are.
        """
        bare = re.sub(r'\[:, *(\d+)\]$', r'.\1', wanted)
        called = [(entry.name, entry.short, entry.name.casefold(), entry.short.casefold(),
                   re.split(r'[/.]', entry.short.casefold())[-1]) for entry in self.channels]
        for names in zip(*called, strict=True):
            for text in (wanted, bare):
                found = [place for place, name in enumerate(names)
                         if name in (text, text.casefold())]
                if len(found) > 1:
                    raise InputError(f'{self.path}: several columns {wanted!r}; name it by its '
                                     f'number ({", ".join(map(str, found[:6]))})')
                if found:
                    return found[0]
        if wanted.isdigit() and int(wanted) < len(self.channels):
            return int(wanted)
        raise InputError(f'{self.path}: no column {wanted!r}; there is {self.listing()}')

    def listing(self) -> str:
        """Return the channels' names in a line."""
        names = [entry.name or '(no title)' for entry in self.channels]
        if not names:
            return 'none'
        if not any(entry.name for entry in self.channels):
            return f'no title, only numbers 0 to {len(names) - 1}'
        more = f' and {len(names) - _SHOWN} more' if len(names) > _SHOWN else ''
        return ', '.join(names[:_SHOWN]) + more


def damaged(path: Path, what: str, error: Exception) -> InputError:
    """Return what to raise where a reader of a format fell over a file."""
    reason = ' '.join(str(error).split()) or type(error).__name__
    return InputError(f'{path}: {what} ({reason}); write or copy the file again')


def numbers_of(path: Path, name: str, values: object) -> Array:
    """Return values as (n,) numbers.

    Raises:
        InputError: they are text, or not a column.
    """
    values = np.asarray(values)
    if values.dtype.kind == 'M':
        start = values[0] if values.size else np.datetime64(0, 'ns')
        return (values - start).astype('timedelta64[ns]').astype(float) * 1e-9
    if values.dtype.kind == 'm':
        return values.astype('timedelta64[ns]').astype(float) * 1e-9
    if values.dtype.kind not in 'fiub':
        raise InputError(f'{path}: {name} holds no numbers ({values.dtype})')
    return values.astype(float).reshape(-1)
