# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Finds the recordings below some folders, and which unit each belongs to."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import csv
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
import hashlib
import math
import os
from pathlib import Path
import re
from typing import Any

from engb_core.errors import InputError
from engb_core.io.bags.bag_files import METADATA, recording_name
from engb_core.io.outputs import LIST
from engb_core.io.tables.formats import SUFFIXES
from engb_core.text.printable import printable

__all__ = ['Found', 'LeftOut', 'find_recordings', 'read_units']

# Tables of measurements; what these may hold is more often something else.
_TABLES = tuple(SUFFIXES.keys() - {'.txt', '.dat', '.log', '.json', '.jsonl', '.ndjson'})
_SUFFIXES = ('.mcap', '.db3', '.mcap.zstd', '.db3.zstd')


@dataclass(frozen=True)
class Found:
    """A recording that is to be diagnosed.

    Attributes:
        key: its path below the folder that was given; tells it from all others.
        path: where it is.
        unit: which brake it is of.
        mileage: [km] where the table of units gives it, else None.
    """

    key: str
    path: Path
    unit: str
    mileage: float | None = None

    @property
    def slug(self) -> str:
        """A file name made of the key, different for each key."""
        digest = hashlib.sha256(self.key.encode('utf-8', 'surrogateescape')).hexdigest()[:8]
        return re.sub(r'[^\w.-]+', '_', self.key, flags=re.ASCII)[-80:].strip('._-') + '-' + digest

    def fingerprint(self) -> list[list[Any]]:
        """Return what tells whether the recording has changed: name, size, time of its files."""
        files = sorted(self.path.iterdir()) if self.path.is_dir() else [self.path]
        found = []
        for file in files:
            state = file.stat()
            found.append([file.name, state.st_size, state.st_mtime_ns])
        return found


@dataclass
class LeftOut:
    """What a search passed by: folders that could not be entered, and tables.

    Attributes:
        locked: folders that may not be read.
        tables: files that `engb import` turns into recordings.
    """

    locked: list[str] = field(default_factory=list)
    tables: list[str] = field(default_factory=list)

    def told(self) -> list[str]:
        """Return what is to be said of it, a sentence each."""
        lines = []
        if self.locked:
            lines.append(f'{_several(self.locked)} may not be read: change the rights of '
                         f'{"it" if len(self.locked) == 1 else "them"} to have what is in there '
                         'counted')
        if self.tables:
            lines.append(f'{_several(self.tables)} left out: a survey takes recordings; make one '
                         'of a table with engb import TABLE --out NAME.mcap')
        return lines


def find_recordings(folders: Sequence[str], left: LeftOut | None = None) -> list[Found]:
    """Return every recording in or below `folders`, each once, in order of its key.

    What is passed by is put into `left`.

    A recording is a folder with metadata.yaml, or a storage file outside of such folders; a
    folder or file that is a recording itself counts too. Its unit is the folder that it lies in,
    seen from the folder given; what lies directly there is all of one unit, named like the folder.

    Raises:
        InputError: a folder is missing, or there is no recording at all.
    """
    found: dict[str, Found] = {}
    left = LeftOut() if left is None else left
    for number, folder in enumerate(folders):
        root = Path(folder)
        if not os.path.exists(root):
            raise InputError(f'{folder}: no such folder; name folders that hold recordings')
        alone = len(folders) == 1
        prefix = '' if alone else f'{root.resolve().name or number}/'
        for path in _recordings(root, left):
            real = os.path.realpath(path)
            if real in found:
                continue
            relative = path.relative_to(root).as_posix() if path != root else recording_name(path)
            key = printable(prefix + relative)
            if any(entry.key == key for entry in found.values()):
                key = f'{number}/{key}'
            parent = Path(key).parent.as_posix()
            direct = recording_name(root) if path == root else root.resolve().name
            found[real] = Found(key, path, direct if parent == '.' else parent)
    if not found:
        raise InputError(f'{", ".join(folders)}: no recording in there (folders with {METADATA}, '
                         'or .mcap and .db3 files)' + ''.join(f'; {text}' for text in left.told())
                         + '; name folders that hold recordings')
    return sorted(found.values(), key=lambda entry: entry.key)


def _several(names: Sequence[str]) -> str:
    return ', '.join(map(printable, names[:3])) + (
        f' and {len(names) - 3} more' if len(names) > 3 else '')


def _recordings(root: Path, left: LeftOut) -> Iterator[Path]:
    if root.is_file():
        yield root
        return
    for folder, below, files in os.walk(root, followlinks=False, onerror=lambda error:
                                        left.locked.append(str(error.filename))):
        below.sort()
        below[:] = [name for name in below if not name.startswith('.')]
        if METADATA in files:
            below.clear()
            yield Path(folder)
            continue
        if LIST not in files:       # tables that this program itself made
            left.tables += [os.path.join(folder, name) for name in sorted(files)
                            if name.lower().endswith(_TABLES) and not name.startswith('.')]
        # Parts of one split bag belong together, though no metadata.yaml says so.
        parts: dict[str, list[str]] = {}
        for name in sorted(files):
            if name.endswith(_SUFFIXES) and not name.startswith('.'):
                parts.setdefault(re.sub(r'_\d+$', '', recording_name(name)), []).append(name)
        for stem, names in parts.items():
            whole = len(parts) == 1 and len(names) > 1 and f'{stem}_0' in map(
                recording_name, names) and Path(folder) != root
            if whole:
                yield Path(folder)
            else:
                yield from (Path(folder) / name for name in names)


def read_units(path: str, recordings: Sequence[Found]) -> list[Found]:
    """Give recordings the unit and mileage that a table tells.

    The table (.csv with titles) has a column `recording` (key, name or pattern such as
    'wheel_3/*') and `unit` or `mileage` [km] or both; the first row that fits counts.

    Raises:
        InputError: not readable, a column is missing, or a mileage is no number.
    """
    try:
        with open(path, encoding='utf-8-sig', newline='') as file:
            reader = csv.DictReader(file)
            titles = [title.strip() for title in reader.fieldnames or []]
            reader.fieldnames = titles
            rows = list(reader)
    except OSError as error:
        raise InputError(f'{path}: cannot be read ({error.strerror})') from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f'{path}: not a .csv table in UTF-8') from error
    if 'recording' not in titles or not {'unit', 'mileage'} & set(titles):
        raise InputError(f'{path}: needs a column recording, and unit or mileage; it has '
                         f'{", ".join(titles) or "no titles"}')
    entries = [((row['recording'] or '').strip(), (row.get('unit') or '').strip(),
                _mileage(path, number, (row.get('mileage') or '').strip()))
               for number, row in enumerate(rows, 2)]
    return [_completed(recording, entries) for recording in recordings]


def _completed(recording: Found, entries: list[tuple[str, str, float | None]]) -> Found:
    names = (recording.key, recording.path.name, recording_name(recording.path))
    for pattern, unit, mileage in entries:
        if pattern and (pattern in names or fnmatchcase(recording.key, pattern)):
            return replace(recording, unit=unit or recording.unit, mileage=mileage)
    return recording


def _mileage(path: str, line: int, text: str) -> float | None:
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f'{path}: line {line}: mileage is {text!r}; write a number [km]')
    return value
