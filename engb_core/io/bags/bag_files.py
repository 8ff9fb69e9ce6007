# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""From the path that a user gives to the files of a bag."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
import re
import sqlite3
from urllib.parse import quote

from engb_core.errors import InputError
from engb_core.text.printable import printable
from engb_core.text.yaml_text import load_yaml

__all__ = ['METADATA', 'bag_files', 'recording_fault', 'recording_name']

METADATA = 'metadata.yaml'
_SUFFIXES = ('.zstd', '.zst', '.mcap', '.db3')
_METADATA_LIMIT = 1 << 20    # a thousand files and a hundred topics take half of that
_MAGIC = {'.mcap': b'\x89MCAP0\r\n', '.db3': b'SQLite format 3\0', '.zstd': b'\x28\xb5\x2f\xfd',
          '.zst': b'\x28\xb5\x2f\xfd'}


def recording_name(path: str | os.PathLike[str]) -> str:
    """Return the path's last name without the suffixes that bags have (.mcap, .db3, .zstd), as
    text that any file and terminal takes."""
    name = printable(Path(os.path.abspath(path)).name)
    for suffix in _SUFFIXES:
        name = name.removesuffix(suffix)
    return name or 'recording'


def bag_files(path: str | os.PathLike[str], notes: list[str]) -> list[Path]:
    """Return the storage files of the bag at `path`, a folder or one of its files, in order.

    A folder's metadata.yaml lists its files; where it is missing or damaged, the folder's own
    files are taken and `notes` says so.

    Raises:
        InputError: nothing there, empty, or a folder that holds several bags.
    """
    path = Path(path)
    try:
        if path.is_dir():
            return _in_folder(path, notes)
        if not path.exists():
            raise InputError(f'{path}: no such file or folder; give a rosbag2 recording')
        if not path.is_file():
            raise InputError(f'{path}: neither a file nor a folder; give a rosbag2 recording')
        if path.name == METADATA:
            return _in_folder(path.parent, notes)
        if path.suffix == '.bag':
            raise InputError(f'{path}: a ROS 1 bag; convert it first (rosbags-convert '
                             f'--src {path.name} --dst {path.stem})')
        if path.stat().st_size == 0:
            raise InputError(f'{path}: the file is empty; record again')
    except (OSError, ValueError) as error:
        raise InputError(f'{path}: cannot be read '
                         f'({getattr(error, "strerror", None) or error}); give a recording that '
                         'you may read') from error
    return [path]


def recording_fault(path: Path) -> str:
    """Return why `path` is not a recording and nothing else ('' where it is one, or empty).

    A recording is a storage file by its first bytes, or a folder of such files and their
    metadata.yaml; a database must hold rosbag2's tables.
    """
    try:
        if not path.is_dir():
            return '' if _is_bag_file(path) else f'{path.name} is no recording'
        for entry in sorted(path.iterdir()):
            sound = (_listed(entry) is not None if entry.name == METADATA else
                     not entry.is_symlink() and entry.is_file() and _is_bag_file(entry))
            if not sound:
                return f'it holds {entry.name}, which is no part of a recording'
    except OSError as error:
        return f'it cannot be looked into ({error.strerror})'
    return ''


def _is_bag_file(path: Path) -> bool:
    magic = _MAGIC.get(path.suffix)
    if magic is None or not path.is_file():
        return False
    with path.open('rb') as file:
        head = file.read(len(magic))
    # A recorder that was killed at once leaves an empty file.
    if head == magic and path.suffix == '.db3':
        return _is_bag_database(path)
    return head in (magic, b'')


def _is_bag_database(path: Path) -> bool:
    with contextlib.suppress(sqlite3.Error), contextlib.closing(sqlite3.connect(
            f'file:{quote(str(path))}?mode=ro&immutable=1', uri=True)) as base:
        found = {row[0] for row in base.execute(
            'SELECT name FROM sqlite_master WHERE type = \'table\' LIMIT 1000')}
        return {'topics', 'messages'} <= found
    return False


def _in_folder(folder: Path, notes: list[str]) -> list[Path]:
    present = sorted((entry for entry in folder.iterdir() if _is_storage(entry)), key=_natural)
    listed = _listed(folder / METADATA)
    names = {entry.name for entry in present}
    files = [folder / name for name in listed or () if name in names]
    if listed is not None and len(files) < len(listed):
        notes.append(f'{len(listed) - len(files)} of the {len(listed)} files that '
                     f'{folder.name}/{METADATA} lists are missing')
    if not files:
        files = present
        # One bag's files share a name but for their number; others are bags of their own.
        if len({_stem(file) for file in files}) > 1:
            raise InputError(f'{folder}: holds {len(files)} bag files and no {METADATA} that '
                             f'says how they belong together; give one of them, such as '
                             f'{files[0].name}')
        if files and listed is None:
            notes.append(f'{METADATA} is missing or damaged: the folder\'s file was read as it '
                         'is' if len(files) == 1 else
                         f'{METADATA} is missing or damaged: all {len(files)} files were read')
    if not files:
        below = _recordings_below(folder)
        remedy = '' if not below else \
            f'; give {below[0]}' if len(below) == 1 else \
            f'; give one of the {len(below)} below it, such as {below[0]}'
        raise InputError(f'{folder}: no recording in this folder (.mcap or .db3){remedy}')
    filled = [file for file in files if file.stat().st_size]
    if not filled:
        raise InputError(f'{folder}: {files[0].name} is empty; record again')
    if len(filled) < len(files):
        notes.append(f'{len(files) - len(filled)} of {len(files)} files are empty')
    return filled


def _recordings_below(folder: Path) -> list[Path]:
    """Return the folders right below this one that hold bag files."""
    found = []
    for entry in sorted(folder.iterdir(), key=_natural):
        # Who may not look into a folder cannot be told to read from it.
        with contextlib.suppress(OSError):
            if entry.is_dir() and any(map(_is_storage, entry.iterdir())):
                found.append(entry)
    return found


def _listed(metadata: Path) -> list[str] | None:
    """Return the file names in a metadata.yaml, or None where it tells nothing."""
    try:
        if metadata.stat().st_size > _METADATA_LIMIT:
            return None
        data = load_yaml(metadata.read_text(encoding='utf-8'))
        names = data['rosbag2_bagfile_information']['relative_file_paths']
        # Old bags list paths with a folder in front; never leave the bag's own folder.
        return list(dict.fromkeys(Path(name).name for name in names)) or None
    except (OSError, InputError, KeyError, TypeError, ValueError, AttributeError):
        return None


def _is_storage(path: Path) -> bool:
    name = path.name.removesuffix('.zstd').removesuffix('.zst')
    return name.endswith(('.mcap', '.db3')) and not name.startswith('.') and path.is_file()


def _stem(path: Path) -> str:
    return re.sub(r'_\d+$', '', recording_name(path))


def _natural(path: Path) -> list[int | str]:
    """Sort key that puts bag_10 behind bag_9."""
    return [int(part) if part.isdigit() else part for part in re.split(r'(\d+)', path.name)]
