"""Reads columns of numbers from .csv, .npz and .mat files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
import csv
import itertools
import os
from pathlib import Path
import re

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError

__all__ = ['read_table']

Array = NDArray[np.float64]

_DELIMITERS = (',', ';', '\t', '|')
_TEXT = ('.csv', '.txt', '.tsv', '.dat')
_SIZE_LIMIT = 8 << 30       # a table is held in memory
_HEAD = 50                  # lines that are looked at to find delimiter and titles


def read_table(path: str | os.PathLike, columns: Mapping[str, str]) -> dict[str, Array]:
    """Return the columns asked for, all (n,).

    Args:
        path: the file; its suffix says its kind.
        columns: name in the result → title, number (from 0) or array in the file.

    Raises:
        InputError: not readable, no such column (lists those there are), text instead of
            numbers, or columns of different length.
    """
    path = Path(path)
    try:
        if path.is_dir():
            raise InputError(f'{path}: is a folder; give a .csv, .npz or .mat file')
        size = path.stat().st_size
        if size == 0:
            raise InputError(f'{path}: the file is empty')
        if size > _SIZE_LIMIT:
            raise InputError(f'{path}: is larger than {_SIZE_LIMIT >> 30} GiB; split it')
        if path.suffix in _TEXT:
            found = _from_text(path, columns)
        elif path.suffix == '.npz':
            found = _from_npz(path, columns)
        elif path.suffix == '.mat':
            found = _from_mat(path, columns)
        else:
            raise InputError(f'{path}: kind {path.suffix or "without suffix"} is not known; give '
                             'a .csv, .npz or .mat file')
    except OSError as error:
        raise InputError(f'{path}: cannot be read ({error.strerror or error})') from error
    sizes = {name: column.size for name, column in found.items()}
    if len(set(sizes.values())) > 1:
        told = ', '.join(f'{name} {size}' for name, size in sizes.items())
        raise InputError(f'{path}: columns of different length ({told})')
    if not any(sizes.values()):
        raise InputError(f'{path}: holds no row of numbers')
    return found


def _from_text(path: Path, columns: Mapping[str, str]) -> dict[str, Array]:
    try:
        with path.open(encoding='utf-8-sig', newline='') as file:
            head = list(itertools.islice(_filled(file), _HEAD))
            delimiter, comma = _delimiter(head)
            rows = list(_rows(head, delimiter))
            start, titles = _titles(rows, comma)
            width = len(rows[start]) if start < len(rows) else len(titles)
            places = {name: _place(path, wanted, titles, width)
                      for name, wanted in columns.items()}
            file.seek(0)
            values: dict[str, list[str]] = {name: [] for name in columns}
            for row in itertools.islice(_rows(_filled(file), delimiter), start, None):
                if row[0].lstrip().startswith('#'):
                    continue
                for name, place in places.items():
                    values[name].append(row[place] if place < len(row) else '')
    except UnicodeDecodeError as error:
        raise InputError(f'{path}: not a text file; give a .csv in UTF-8') from error
    except csv.Error as error:
        raise InputError(f'{path}: not a table ({error})') from error
    return {name: _numbers(path, name, column, comma) for name, column in values.items()}


def _filled(lines: Iterable[str]) -> Iterator[str]:
    return (line for line in lines if line.strip())


def _rows(lines: Iterable[str], delimiter: str) -> Iterator[list[str]]:
    if delimiter == ' ':
        return (line.split() for line in lines)
    return csv.reader(lines, delimiter=delimiter)


def _delimiter(head: list[str]) -> tuple[str, bool]:
    """Return the delimiter, and whether numbers have a decimal comma."""
    body = [line for line in head if not line.lstrip().startswith('#')] or head

    def even(character: str) -> int:
        counts = {line.count(character) for line in body[1:] or body}
        return min(counts) if len(counts) == 1 else 0

    for character in (';', '\t', '|'):
        if even(character):
            # German spreadsheets: 1,5;2,5
            return character, not any('.' in line for line in body[1:]) and any(
                ',' in line for line in body[1:])
    if any(',' in line for line in body):
        return ',', False
    return (' ', False) if any(' ' in line.strip() for line in body) else (',', False)


def _titles(rows: list[list[str]], comma: bool) -> tuple[int, list[str]]:
    """Return the number of the first row with numbers, and the titles of the columns."""
    rows = [row[1:] if row[0].strip() == '#' else row for row in rows]
    start = next((number for number, row in enumerate(rows)
                  if any(_is_number(cell, comma) for cell in row)), len(rows))
    width = len(rows[start]) if start < len(rows) else 0
    # Below the titles there may be a row with units, above them a remark.
    fitting = [row for row in rows[:start] if len(row) == width] or rows[max(0, start - 1):start]
    return start, [cell.strip().lstrip('#').strip() for cell in fitting[0]] if fitting else []


def _place(path: Path, wanted: str, titles: list[str], width: int) -> int:
    if wanted in titles:
        if titles.count(wanted) > 1:
            raise InputError(f'{path}: several columns {wanted!r}; name it by its number')
        return titles.index(wanted)
    if wanted.isdigit() and int(wanted) < width:
        return int(wanted)
    folded = [title.casefold() for title in titles]
    if folded.count(wanted.casefold()) == 1:
        return folded.index(wanted.casefold())
    there = ', '.join(titles) if titles else f'no titles, numbers 0 to {width - 1}'
    raise InputError(f'{path}: no column {wanted!r}; there is {there}')


def _is_number(text: str, comma: bool) -> bool:
    try:
        float(text.replace(',', '.') if comma else text)
    except ValueError:
        return False
    return True


def _numbers(path: Path, name: str, column: list[str], comma: bool) -> Array:
    if comma:
        column = [text.replace(',', '.') for text in column]
    try:
        return np.array(column, float)
    except ValueError:
        pass
    values = np.full(len(column), np.nan)
    bad = 0
    for index, text in enumerate(column):
        try:
            values[index] = float(text)
        except ValueError:
            bad += bool(text.strip())
    if bad > len(column) // 2 or not np.isfinite(values).any():
        example = next(text for text in [*column, ''] if not _is_number(text, False))
        raise InputError(f'{path}: column for {name} holds no numbers but {example.strip()!r}')
    return values


def _from_npz(path: Path, columns: Mapping[str, str]) -> dict[str, Array]:
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = _Arrays(path, archive.files, archive.__getitem__)
            return {name: arrays.column(wanted) for name, wanted in columns.items()}
    except InputError:
        raise
    except Exception as error:      # zipfile and numpy raise what they like on a broken file
        raise InputError(f'{path}: not a usable .npz file ({error})') from error


def _from_mat(path: Path, columns: Mapping[str, str]) -> dict[str, Array]:
    from scipy.io import loadmat
    try:
        data = loadmat(path, squeeze_me=True, struct_as_record=True)
    except NotImplementedError as error:
        raise InputError(f'{path}: MATLAB 7.3 (HDF5); save it with -v7') from error
    except Exception as error:      # scipy raises what it likes on a broken file
        raise InputError(f'{path}: not a usable .mat file ({error})') from error
    flat: dict[str, np.ndarray] = {}
    for name, value in data.items():
        if not name.startswith('__'):
            _flatten(name, value, flat)
    arrays = _Arrays(path, list(flat), flat.__getitem__)
    return {name: arrays.column(wanted) for name, wanted in columns.items()}


def _flatten(name: str, value: np.ndarray, into: dict[str, np.ndarray]) -> None:
    """Put a MATLAB struct's fields beside the others, as struct.field."""
    value = np.asarray(value)
    if value.dtype.names and value.size == 1:
        for field in value.dtype.names:
            _flatten(f'{name}.{field}', value[field].item() if value.ndim == 0
                     else value[field][0], into)
    else:
        into[name] = value


class _Arrays:
    """Named arrays, of which one may ask for a column."""

    def __init__(self, path: Path, names: list[str], get) -> None:
        self._path, self._names, self._get = path, names, get

    def column(self, wanted: str) -> Array:
        """Return array `name`, or column k of it for 'name.k' or 'name[:,k]'."""
        name, place = wanted, None
        if wanted not in self._names:
            match = re.fullmatch(r'(.+?)(?:\.(\d+)|\[:, *(\d+)\])', wanted)
            if match and match[1] in self._names:
                name, place = match[1], int(match[2] or match[3])
            elif wanted.isdigit() and len(self._names) == 1:
                name, place = self._names[0], int(wanted)
            else:
                raise InputError(f'{self._path}: no array {wanted!r}; there is '
                                 f'{", ".join(self._names[:20]) or "none"}')
        values = np.squeeze(np.asarray(self._get(name)))
        if values.dtype.kind not in 'fiub':
            raise InputError(f'{self._path}: array {name} holds no numbers ({values.dtype})')
        if values.ndim == 2 and place is None:
            raise InputError(f'{self._path}: array {name} is {values.shape[0]} × '
                             f'{values.shape[1]}; name its column, such as {name}.0')
        if place is not None:
            if values.ndim != 2 or place >= values.shape[1]:
                raise InputError(f'{self._path}: array {name} has no column {place}; it is '
                                 + ' × '.join(map(str, values.shape)))
            values = values[:, place]
        if values.ndim != 1:
            raise InputError(f'{self._path}: array {name} is no column of numbers; it is '
                             + (' × '.join(map(str, values.shape)) or 'a single number'))
        return values.astype(float)
