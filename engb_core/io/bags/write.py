# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Writes arrays as a rosbag2 recording, whole or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engb_core.errors import InputError
from engb_core.io.outputs import recording_output
from engb_core.io.recorded_topics import FLOAT64, JOINT_STATE

__all__ = ['FloatTable', 'JointTable', 'joint_state_rows', 'float64_rows', 'write_bag']


@dataclass(frozen=True)
class JointTable:
    """JointState messages of one joint.

    Attributes:
        time: (n,) [s] or, as int64, [ns], absolute: header.stamp.
        position, velocity, effort: (n,) [rad, rad/s, N·m]; None leaves the sequence empty.
        joint: the joint's name.
        log_time: (n,), as `time`: when the recorder got it; None: at its stamp.
    """

    time: ArrayLike
    position: ArrayLike | None
    velocity: ArrayLike | None = None
    effort: ArrayLike | None = None
    joint: str = 'motor'
    log_time: ArrayLike | None = None


@dataclass(frozen=True)
class FloatTable:
    """Float64 messages: `time` (n,), log time [s] or, as int64, [ns], absolute; `value` (n,)."""

    time: ArrayLike
    value: ArrayLike


def write_bag(path: str | os.PathLike[str], topics: Mapping[str, JointTable | FloatTable],
              storage: str = 'mcap', compression: str | None = None,
              replace: bool = False) -> None:
    """Write a recording.

    Args:
        path: the bag's folder to be made; ending in .mcap (or .db3 with sqlite3), the single
            file without metadata.
        topics: absolute topic name → its messages.
        storage: 'mcap' or 'sqlite3'.
        compression: 'none', 'chunk' (mcap only), 'message' or 'file', all zstd; None: 'chunk'
            where there are chunks.
        replace: whether a recording that is there already may be replaced.

    Raises:
        InputError: the path exists, holds anything but a recording, can't be written, or times
            can't be told in nanoseconds.
    """
    suffix = Path(path).suffix
    single = suffix in ('.mcap', '.db3')
    if single and (suffix == '.mcap') != (storage == 'mcap'):
        raise InputError(f'{path}: the name doesn\'t fit storage {storage}')
    with recording_output(path, replace) as made:
        folder = made.with_suffix('') if single else made
        _write(folder, topics, storage, compression or (
            'chunk' if storage == 'mcap' else 'none'))
        if single:
            file = next(entry for entry in folder.iterdir() if entry.name != 'metadata.yaml')
            os.replace(file, made.with_name(made.name + file.suffix)
                       if file.suffix == '.zstd' else made)


def _write(path: Path, topics: Mapping[str, JointTable | FloatTable], storage: str,
           compression: str) -> None:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import get_typestore, Stores
    modes = {'chunk': CompressionMode.STORAGE, 'message': CompressionMode.MESSAGE,
             'file': CompressionMode.FILE}
    writer = Writer(path, version=9, storage_plugin={
        'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}[storage])
    if compression in modes:
        writer.set_compression(modes[compression], CompressionFormat.ZSTD)
    typestore = get_typestore(Stores.ROS2_JAZZY)
    with writer:
        connections, stamps, rows = [], [], []
        for topic, table in topics.items():
            kind = JOINT_STATE if isinstance(table, JointTable) else FLOAT64
            connections.append(writer.add_connection(topic, kind, typestore=typestore))
            stamp, row = _rows(table)
            stamps.append(stamp)
            rows.append(row)
        if not stamps:
            return
        owner = np.repeat(np.arange(len(stamps)), [stamp.size for stamp in stamps])
        index = np.concatenate([np.arange(stamp.size) for stamp in stamps])
        stamp = np.concatenate(stamps)
        order = np.lexsort((owner, stamp))
        data = [(row.tobytes(), row.shape[1]) for row in rows]
        for topic, place, time in zip(owner[order].tolist(), index[order].tolist(),
                                      stamp[order].tolist(), strict=True):
            raw, size = data[topic]
            writer.write(connections[topic], time, raw[place * size:(place + 1) * size])


def _rows(table: JointTable | FloatTable) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return log times (n,) [ns] and serialised messages (n, size)."""
    time = _nanoseconds(table.time)
    if isinstance(table, FloatTable):
        return time, float64_rows(np.asarray(table.value, float))
    log_time = time if table.log_time is None else _nanoseconds(table.log_time)
    position, velocity, effort = (None if column is None else np.asarray(column, float)
                                  for column in (table.position, table.velocity, table.effort))
    return log_time, joint_state_rows(time, position, velocity, effort, joint=table.joint)


def _nanoseconds(time: ArrayLike) -> NDArray[np.int64]:
    time = np.asarray(time)
    if np.issubdtype(time.dtype, np.integer):
        return time.astype(np.int64)
    if not np.isfinite(time).all() or (np.abs(time) > 2**31 - 1).any():
        raise InputError('times must be finite and within ±2^31 s to be written to a bag')
    whole = np.floor(time)
    rest: NDArray[np.int64] = np.rint((time - whole) * 1e9).astype(np.int64)
    seconds: NDArray[np.int64] = whole.astype(np.int64) * 1_000_000_000
    return seconds + rest


def float64_rows(value: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Serialise (n,) numbers as Float64 messages, (n, 12) uint8, plain little-endian CDR."""
    rows = np.zeros(value.size, [('head', 'u1', 4), ('data', '<f8')])
    rows['head'] = (0, 1, 0, 0)
    rows['data'] = value
    return rows.view(np.uint8).reshape(value.size, rows.itemsize)


def joint_state_rows(stamp: NDArray[np.int64], position: NDArray[np.float64] | None,
                     velocity: NDArray[np.float64] | None, effort: NDArray[np.float64] | None,
                     joint: str = 'motor', frame: str = '') -> NDArray[np.uint8]:
    """Serialise (n,) samples as JointState messages of one joint, (n, size) uint8.

    `stamp` [ns]; a column that is None becomes an empty sequence.
    """
    fields: list[tuple[Any, ...]] = [('head', 'u1', 4), ('sec', '<i4'), ('nanosec', '<u4')]
    constants: dict[str, int | bytes] = {}
    size = 12

    def pad(to: int) -> None:
        nonlocal size
        gap = -(size - 4) % to
        if gap:
            fields.append((f'pad{size}', 'u1', (gap,)))
            size += gap

    def put(value: int | bytes) -> None:
        nonlocal size
        if isinstance(value, int):
            pad(4)
        name = f'constant{size}'
        fields.append((name, '<u4' if isinstance(value, int) else f'S{len(value)}'))
        constants[name] = value
        size += 4 if isinstance(value, int) else len(value)

    for text in (frame, None, joint):
        if text is None:
            put(1)      # one name follows
            continue
        data = text.encode() + b'\0'
        put(len(data))
        put(data)
    for name, column in (('position', position), ('velocity', velocity), ('effort', effort)):
        put(0 if column is None else 1)
        if column is not None:
            pad(8)
            fields.append((name, '<f8'))
            size += 8
    rows = np.zeros(stamp.size, fields)
    rows['head'] = (0, 1, 0, 0)
    rows['sec'], rows['nanosec'] = np.divmod(stamp, 1_000_000_000)
    for name, value in constants.items():
        rows[name] = value
    for name, column in (('position', position), ('velocity', velocity), ('effort', effort)):
        if column is not None:
            rows[name] = column
    return rows.view(np.uint8).reshape(stamp.size, rows.itemsize)
