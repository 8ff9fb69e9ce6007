# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Reads named arrays: NumPy's .npz, MATLAB's .mat of version 5, and HDF5 with .mat of 7.3."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.io.tables.mat_file import check_mat
from engb_core.io.tables.table import Channel, damaged, MOST_BYTES, numbers_of, Samples, Table
from engb_core.io.tables.units import parse_title

__all__ = ['MOST_COLUMNS', 'ArrayTable', 'hdf5_table', 'mat_table', 'npz_table']

# An array with more columns than this is no set of signals.
MOST_COLUMNS = 256
_HDF5 = b'\x89HDF\r\n\x1a\n'
_UNIT_ATTRIBUTES = ('unit', 'units', 'Unit', 'Units', 'UNIT')
# Parts of an array of structs that are looked into.
_DEEPEST = 8

Getter = Callable[[], np.ndarray]


class ArrayTable(Table):
    """Named arrays, each of one column or of several: column k of array m is called m.k."""

    def __init__(self, path: Path, kind: str,
                 arrays: dict[str, tuple[tuple[int, ...], str, Getter]]) -> None:
        """Take `arrays`: name → shape, unit, and what reads the array."""
        self.kind = kind
        self._getters: list[tuple[Getter, int | None]] = []
        channels = []
        for name, (shape, unit, getter) in arrays.items():
            slim = tuple(length for length in shape if length != 1)
            group = name.rpartition('/')[0] if '/' in name else name.rpartition('.')[0]
            unit = unit or parse_title(name)[1]
            if len(slim) == 1:
                channels.append(Channel(name, unit, slim[0], group))
                self._getters.append((getter, None))
            elif len(slim) == 2 and min(slim) <= MOST_COLUMNS:
                # As many rows as columns is told by which is longer: samples are.
                for column in range(slim[1] if slim[1] <= MOST_COLUMNS else 0):
                    channels.append(Channel(f'{name}.{column}', unit, slim[0], group or name))
                    self._getters.append((getter, column))
        if not channels:
            raise InputError(f'{path}: holds no column of numbers; it holds '
                             + (', '.join(list(arrays)[:12]) or 'nothing'))
        super().__init__(path, channels)

    def read(self, channels: Iterable[int]) -> dict[int, Samples]:
        """Return columns of arrays."""
        found = {}
        places = list(channels)
        self.check_size(places)
        for place in places:
            getter, column = self._getters[place]
            try:
                values = np.squeeze(np.asarray(getter()))
            except Exception as error:  # zipfile, zlib and h5py raise what they like when damaged
                raise damaged(self.path, f'{self.channels[place].name} cannot be read',
                              error) from error
            if column is not None:
                values = values[:, column]
            found[place] = Samples(numbers_of(self.path, self.channels[place].name, values))
        return found


def npz_table(path: Path) -> ArrayTable:
    """Open a .npz file; only the headers are read."""
    try:
        archive = np.load(path, allow_pickle=False)
        arrays: dict[str, tuple[tuple[int, ...], str, Getter]] = {}
        for name in archive.files:
            with archive.zip.open(name + '.npy') as file:
                version = np.lib.format.read_magic(file)
                header = (np.lib.format.read_array_header_1_0 if version == (1, 0)
                          else np.lib.format.read_array_header_2_0)(file)
            arrays[name] = (header[0], '', partial(archive.__getitem__, name))
    except Exception as error:      # zipfile and numpy raise what they like on a broken file
        raise damaged(path, 'not a usable .npz file', error) from error
    return ArrayTable(path, 'npz', arrays)


def mat_table(path: Path) -> ArrayTable:
    """Open a .mat file of any version."""
    with path.open('rb') as file:
        head = file.read(520)
    if _HDF5 in (head[:8], head[512:520]):
        return hdf5_table(path, 'MATLAB 7.3')
    from scipy.io import loadmat
    check_mat(path, MOST_BYTES)
    try:
        data = loadmat(path, squeeze_me=True, struct_as_record=True)
    except Exception as error:      # scipy raises what it likes on a broken file
        raise damaged(path, 'not a usable .mat file', error) from error
    flat: dict[str, np.ndarray] = {}
    opaque = []
    for name, value in data.items():
        if name == '__function_workspace__' or type(value).__name__ == 'MatlabOpaque':
            opaque.append(name)
        elif not name.startswith('__'):
            _flatten(name, value, flat, _DEEPEST)
    arrays: dict[str, tuple[tuple[int, ...], str, Getter]] = {
        name: (value.shape, _unit_beside(name, flat), partial(np.asarray, value))
        for name, value in flat.items() if value.dtype.kind in 'fiub'}
    if not arrays and opaque:
        raise InputError(f'{path}: holds MATLAB objects (a table or timeseries), which only '
                         'MATLAB reads; save plain arrays, such as t = tt.Time')
    return ArrayTable(path, 'MATLAB', arrays)


def _flatten(name: str, value: object, into: dict[str, np.ndarray], deep: int) -> None:
    """Put a MATLAB struct's fields beside the others, as struct.field."""
    value = np.asarray(value)
    if value.dtype.names and value.size == 1 and deep:
        for field in value.dtype.names:
            _flatten(f'{name}.{field}', value[field].item() if value.ndim == 0
                     else value[field][0], into, deep - 1)
    elif value.dtype.names and value.size <= MOST_COLUMNS and deep:
        # Signals of a Simulink scope: an array of structs, each with its label.
        for number, part in enumerate(value.ravel(), 1):
            label = str(part['label']) if 'label' in value.dtype.names else ''
            for field in value.dtype.names:
                _flatten(f'{name}({number}).{field}' if field != 'values' or not label
                         else f'{name}({number}).{label}', part[field], into, deep - 1)
    else:
        into[name] = value


def _whole(item: Any, turned: bool) -> NDArray[Any]:
    """Return all of a data set."""
    values: NDArray[Any] = item[()]
    turned_back: NDArray[Any] = values.T
    return turned_back if turned else values


def _unit_beside(name: str, flat: dict[str, np.ndarray]) -> str:
    """Return the text of a field `unit` beside this one, as signals in structs have it."""
    stem = name.rpartition('.')[0]
    for field in _UNIT_ATTRIBUTES:
        value = flat.get(f'{stem}.{field}') if stem else None
        if value is not None and value.dtype.kind == 'U' and value.size == 1:
            return str(value.item())
    return ''


def hdf5_table(path: Path, kind: str = 'HDF5') -> ArrayTable:
    """Open an HDF5 file, or a .mat file of version 7.3, which is one."""
    from engb_core.io.tables.needs import needed
    h5py = needed('h5py', path, kind)
    arrays: dict[str, tuple[tuple[int, ...], str, Getter]] = {}
    try:
        file = h5py.File(path, 'r')

        def visit(name: str, item: object) -> None:
            if not isinstance(item, h5py.Dataset) or name.startswith('#'):
                return
            turned = kind == 'MATLAB 7.3'   # MATLAB stores columns first
            unit = next((_text(item.attrs[key]) for key in _UNIT_ATTRIBUTES
                         if key in item.attrs), '')
            if item.dtype.names:
                for field in item.dtype.names:
                    if item.dtype[field].kind in 'fiub' and item.dtype[field].shape == ():
                        arrays[f'{name}/{field}'] = (
                            item.shape, unit, partial(item.__getitem__, field))
            elif item.dtype.kind in 'fiub' and 'MATLAB_empty' not in item.attrs:
                shape = item.shape[::-1] if turned else item.shape
                arrays[name] = (shape, unit, partial(_whole, item, turned))

        file.visititems(visit)
    except Exception as error:      # h5py raises what it likes on a broken file
        raise damaged(path, f'not a usable {kind} file', error) from error
    return ArrayTable(path, kind, arrays)


def _text(value: object) -> str:
    if isinstance(value, np.ndarray):
        value = value.flat[0] if value.size else ''
    return value.decode('utf-8', 'replace') if isinstance(value, bytes) else str(value)
