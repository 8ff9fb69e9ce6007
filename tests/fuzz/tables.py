# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Damaged tables of each format: a good file by the field's own writer, then bytes or cells wrong.

A case follows from its seed. A good file of each kind is written once a process.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
import random
import tempfile

import numpy as np

from .mutations import damage_bytes, damage_text

__all__ = ['TABLES', 'make_table']

_SIZE = 400
_IMPORT = ['--torque-constant', '0.05']


def _columns() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    time = np.arange(_SIZE) * 1e-3
    return time, 90.0 * np.sin(9.0 * time), 2.0 * np.cos(9.0 * time)


def _csv(path: Path) -> None:
    rows = [f'{t:.4f};{a:.4f};{i:.4f}' for t, a, i in zip(*_columns(), strict=True)]
    path.write_text('bench 3\n\nt [s];phi [deg];I [A]\n' + '\n'.join(rows) + '\n')


def _npz(path: Path) -> None:
    np.savez_compressed(path, **dict(zip(('t_s', 'phi_deg', 'I_A'), _columns(), strict=True)))


def _mat(path: Path) -> None:
    from scipy.io import savemat
    savemat(path, {'log': dict(zip(('t_s', 'phi_deg', 'I_A'), _columns(), strict=True))},
            do_compression=True)


def _hdf5(path: Path) -> None:
    import h5py
    with h5py.File(path, 'w') as file:
        for name, values, unit in zip(('time', 'angle', 'current'), _columns(),
                                      ('s', 'deg', 'A'), strict=True):
            made = file.create_dataset(f'run/{name}', data=values, compression='gzip')
            made.attrs['unit'] = unit


def _mat73(path: Path) -> None:
    import h5py
    with h5py.File(path, 'w', userblock_size=512) as file:
        for name, values in zip(('t_s', 'phi_deg', 'I_A'), _columns(), strict=True):
            file.create_dataset(name, data=values[None]).attrs['MATLAB_class'] = b'double'
    with path.open('r+b') as raw:
        raw.write(b'MATLAB 7.3 MAT-file'.ljust(124) + b'\x00\x02IM')


def _mdf(path: Path) -> None:
    import asammdf
    time, angle, current = _columns()
    with asammdf.MDF(version='3.30' if path.suffix == '.mdf' else '4.10') as file:
        file.append([asammdf.Signal(angle, time, unit='deg', name='MotorAngle'),
                     asammdf.Signal(current, time, unit='A', name='MotorCurrent')])
        file.save(path, overwrite=True)


def _tdms(path: Path) -> None:
    import nptdms
    _, angle, current = _columns()
    with nptdms.TdmsWriter(path) as writer:
        for name, values, unit in (('angle', angle, 'deg'), ('current', current, 'A')):
            writer.write_segment([nptdms.ChannelObject('bench', name, values, properties={
                'wf_increment': 1e-3, 'wf_start_offset': 0.0, 'unit_string': unit})])


def _parquet(path: Path) -> None:
    import pyarrow
    from pyarrow import feather, parquet
    table = pyarrow.table(dict(zip(('t [s]', 'phi [deg]', 'I [A]'), _columns(), strict=True)))
    if path.suffix == '.parquet':
        parquet.write_table(table, path)
    else:
        feather.write_feather(table, str(path))


def _ros1(path: Path) -> None:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import get_typestore, Stores
    store = get_typestore(Stores.ROS1_NOETIC)
    kinds = store.types
    with Writer(path) as writer:
        name = 'sensor_msgs/msg/JointState'
        connection = writer.add_connection('/joint_states', name, typestore=store)
        for index, (time, angle, current) in enumerate(zip(*_columns(), strict=True)):
            stamp = 1_700_000_000_000_000_000 + int(1e9 * time)
            header = kinds['std_msgs/msg/Header'](index, kinds['builtin_interfaces/msg/Time'](
                stamp // 10**9, stamp % 10**9), '')
            message = kinds[name](header, ['motor'], np.array([np.deg2rad(angle)]), np.zeros(0),
                                  np.array([0.05 * current]))
            writer.write(connection, stamp, store.serialize_ros1(message, name))


TABLES: dict[str, Callable[[Path], None]] = {
    'a.csv': _csv, 'a.npz': _npz, 'a.mat': _mat, 'b.mat': _mat73, 'a.h5': _hdf5, 'a.mf4': _mdf,
    'a.mdf': _mdf, 'a.tdms': _tdms, 'a.parquet': _parquet, 'a.arrow': _parquet, 'a.bag': _ros1}


@cache
def _good(name: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        TABLES[name](path)
        return path.read_bytes()


def make_table(seed: int, folder: Path) -> tuple[list[str], str]:
    """Write the damaged table of a seed in `folder`.

    Returns:
        What `engb` is called with, but for --out, and what was damaged, in words.
    """
    rng = random.Random(seed)
    name = rng.choice(['a.csv', *TABLES])
    data = _good(name)
    if name == 'a.csv' and rng.random() < 0.7:
        data = _odd_text(data.decode(), rng)
    else:
        data = damage_bytes(data, rng)
    path = folder / name
    path.write_bytes(data)
    if rng.random() < 0.1:
        return ['import', '--list', str(path)], f'list {name}'
    return ['import', str(path), *_IMPORT], f'import {name}'


def _odd_text(text: str, rng: random.Random) -> bytes:
    """Damage a text as people and exports do: titles, delimiters, commas, ends of lines."""
    kind = rng.randrange(9)
    if kind == 0:
        return damage_text(text, rng)
    if kind == 1:
        text = text.replace(';', rng.choice([',', '\t', '|', ' ', '  ', ';;', ':', '\0']))
    elif kind == 2:
        text = text.replace('.', ',')
    elif kind == 3:
        text = text.replace('\n', rng.choice(['\r', '\r\n', '\n\n', '\n\r', '\x0b', '\u2028']))
    elif kind == 4:
        lines = text.splitlines(keepends=True)
        place = rng.randrange(len(lines))
        lines[place] = lines[place].replace(';', rng.choice(['', ';;', ';"', '";', ';nan;',
                                                             ';1e999;', ';#REF!;', ';=1+1;']))
        text = ''.join(lines)
    elif kind == 5:
        text = text.replace('t [s];phi [deg];I [A]', rng.choice([
            '', ';;', 't;t;t', 'phi;phi;phi', 't [s];t [ms];t [ns]', '1;2;3', '"t\n[s]";phi;I',
            'a' * 200_000, ';'.join('abc' * 3000), 't [parsec];phi [furlong];I [mol]',
            '\x1b[31mt [s];phi [deg];I [A]']))
    elif kind == 6:
        return text.encode(rng.choice(['utf-16', 'utf-16-le', 'utf-32', 'utf-8-sig', 'cp037']))
    elif kind == 7:
        rows = text.splitlines(keepends=True)
        text = ''.join(rows[:3] + rows[3:] * rng.choice([0, 1, 20]))
        text = text[:rng.randrange(1, len(text) + 1)]
    else:
        column = rng.choice(['0', 'nan', '-', '12:00:00', '2026-02-31 25:61:00', '1e308', 'TRUE',
                             '9' * 400])
        text = '\n'.join(line if number < 3 else f'{column};' + line.partition(';')[2]
                         for number, line in enumerate(text.splitlines()))
    return text.encode('utf-8', 'replace')
