# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Writes rosbag2 MCAP bags from messages as they came over the wire (needs no ROS)."""

from __future__ import annotations

from collections.abc import Sequence
import contextlib
import os
from pathlib import Path
from typing import Any

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.rosbag2.errors import WriterError
from rosbags.typesys import get_typestore, Stores
import yaml

from engb_core.errors import InputError

__all__ = ['BagWriter', 'offered_qos']

# No deadline, no lifespan: what rosbag2 writes for them (the longest time in nanoseconds).
_FOREVER = QosTime(9223372036, 854775807)


def offered_qos(history: int, depth: int, reliability: int, durability: int) -> Qos:
    """Return what a publisher offers, as a bag holds it; the numbers are rmw's own."""
    return Qos(QosHistory(history), depth, QosReliability(reliability),
               QosDurability(durability), _FOREVER, _FOREVER, QosLiveliness.AUTOMATIC, _FOREVER,
               False)


class BagWriter:
    """One MCAP bag, open for writing.

    Topics of a type that the type store doesn't know are left out.

    Args:
        path: the bag's folder; it must not exist.
        compressed: zstd on each chunk.
        split_size: a file of the bag is closed, and another one begun, beyond this [bytes];
            0: one file.
        split_time: likewise, by its length [s]; 0: one file.

    Raises:
        InputError: the folder exists or cannot be made.
    """

    def __init__(self, path: Path, compressed: bool = False, split_size: int = 0,
                 split_time: float = 0.0) -> None:
        self.path = path
        self._split_size, self._split_time = split_size, round(1e9 * split_time)
        try:
            self._writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
            if compressed:
                self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            self._writer.open()
            self._parts: list[dict[str, Any]] = []
            self._begin_part()
        except WriterError as error:
            raise InputError(f'{path}: exists already; name a folder that does not') from error
        except OSError as error:
            raise InputError(f'{path}: cannot be made ({error.strerror}); choose another '
                             'folder') from error
        self._types = get_typestore(Stores.ROS2_JAZZY)
        self._connections: dict[str, Connection] = {}
        self._count = 0
        self.is_open = True

    @property
    def _splits(self) -> bool:
        return self._split_size > 0 or self._split_time > 0

    def knows(self, type_name: str) -> bool:
        """Whether messages of this type can be written."""
        return type_name in self._types.fielddefs

    def add_topic(self, name: str, type_name: str, offered: Sequence[Qos] = ()) -> bool:
        """Get ready for a topic, with what its publishers offer; False where its type isn't
        known."""
        if name in self._connections:
            return True
        if not self.knows(type_name):
            return False
        self._connections[name] = self._writer.add_connection(
            name, type_name, typestore=self._types, offered_qos_profiles=offered)
        return True

    def write(self, name: str, time: int, message: bytes) -> None:
        """Write one serialised message of a topic; `time` is the log time [ns].

        Raises:
            InputError: the disk takes no more.
        """
        connection = self._connections.get(name)
        if connection is None or not self.is_open:
            return
        try:
            if self._splits and self._is_full(time):
                self._refuse_another_place()
                self._end_part()
                self._begin_part()
            self._writer.write(connection, time, message)
        except OSError as error:
            raise self._unwritable(error) from error
        self._count += 1

    def finish_chunk(self) -> None:
        """Put what was written so far into the file, whole: a kill can't take it any more.

        rosbags itself finishes a chunk only at a mebibyte.

        Raises:
            InputError: the disk takes no more, or the bag is no longer where it was made.
        """
        storage: Any = self._writer.storage
        if not self.is_open or storage is None:
            return
        self._refuse_another_place()
        try:
            if storage.chunk.msgs:
                storage.close_chunk()
            storage.bio.flush()
        except OSError as error:
            raise self._unwritable(error) from error

    def close(self) -> int:
        """Write index and metadata; return the number of messages.

        Raises:
            InputError: the disk takes no more, or the bag is no longer where it was made; what
                was written before is readable.
        """
        if not self.is_open:
            return self._count
        self._refuse_another_place()
        try:
            self._note_part()
            self._writer.close()
            if self._splits:
                self._write_metadata()
        except OSError as error:
            raise self._unwritable(error) from error
        self.is_open = False
        return self._count

    def discard(self) -> None:
        """Take away what was made, where no message has been written and nobody added anything."""
        if not self.is_open or self._count:
            return
        self.is_open = False
        storage: Any = self._writer.storage
        with contextlib.suppress(OSError):
            storage.bio.close()
            storage.path.unlink()
            self.path.rmdir()

    def _refuse_another_place(self) -> None:
        """Raise InputError where the open file does not lie at its path any more: another one's
        metadata would be overwritten there."""
        storage: Any = self._writer.storage
        with contextlib.suppress(OSError):
            if os.path.samestat(os.stat(storage.path), os.fstat(storage.bio.fileno())):
                return
        self.is_open = False
        with contextlib.suppress(OSError):
            storage.close(9, '')    # moved, it can be read from there
        raise InputError(f'{self.path}: was moved or removed while it was written; leave it where '
                         'it is until the recorder has ended')

    # Parts of a bag: rosbags writes one file, so the next one takes its place here.

    def _begin_part(self) -> None:
        writer: Any = self._writer      # an MCAP's storage, of which rosbags tells no types
        if self._parts:
            writer.storage = type(writer.storage)(self.path, writer.compression_mode)
            known = set()
            for connection in writer.connections:
                if connection.msgtype not in known:
                    known.add(connection.msgtype)
                    writer.storage.add_msgtype(connection)
                writer.storage.add_connection(
                    connection, yaml.safe_dump(_as_yaml(connection.ext.offered_qos_profiles)))
        if self._splits:
            storage = writer.storage
            named = self.path / f'{self.path.name}_{len(self._parts)}.mcap'
            os.rename(storage.path, named)
            storage.path = named

    def _is_full(self, time: int) -> bool:
        storage: Any = self._writer.storage
        begin: int = storage.message_start_time
        size: int = storage.bio.tell() + storage.chunk.bio.tell()
        return begin < time and (0 < self._split_size <= size
                                 or 0 < self._split_time <= time - begin)

    def _end_part(self) -> None:
        self._note_part()
        storage: Any = self._writer.storage
        storage.close(9, '')

    def _note_part(self) -> None:
        storage: Any = self._writer.storage
        count = sum(storage.channel_stats.values())
        begin = storage.message_start_time if count else 0
        self._parts.append({
            'path': storage.path.name, 'message_count': count,
            'starting_time': {'nanoseconds_since_epoch': begin},
            'duration': {'nanoseconds': max(0, storage.message_end_time - begin)}})

    def _write_metadata(self) -> None:
        path = self.path / 'metadata.yaml'
        metadata = yaml.safe_load(path.read_text(encoding='utf-8'))
        bag = metadata['rosbag2_bagfile_information']
        bag['relative_file_paths'] = [part['path'] for part in self._parts]
        bag['files'] = self._parts
        made = path.with_name('metadata.yaml.tmp')
        made.write_text(yaml.safe_dump(metadata, sort_keys=False), encoding='utf-8')
        os.replace(made, path)

    def _unwritable(self, error: OSError) -> InputError:
        """Give up: what is in the file so far can be read, without an index."""
        self.is_open = False
        storage: Any = self._writer.storage
        if storage is not None:
            with contextlib.suppress(OSError):
                storage.bio.close()
        return InputError(f'{self.path}: cannot be written ({error.strerror}); free space or '
                          'choose another folder')


def _as_yaml(profiles: Sequence[Qos]) -> list[dict[str, Any]]:
    from rosbags.rosbag2.metadata import dump_qos_v9
    return [dict(profile) for profile in dump_qos_v9(list(profiles))]
