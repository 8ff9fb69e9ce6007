"""Writes rosbag2 MCAP bags from messages as they came over the wire (needs no ROS)."""

from __future__ import annotations

from pathlib import Path

from rosbags.interfaces import Connection
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.rosbag2.errors import WriterError
from rosbags.typesys import get_typestore, Stores

from engb_core.errors import InputError

__all__ = ['BagWriter']


class BagWriter:
    """One MCAP bag, open for writing.

    Topics of a type that the type store doesn't know are left out.

    Args:
        path: the bag's folder; it must not exist.
        compressed: zstd on each chunk.

    Raises:
        InputError: the folder exists or cannot be made.
    """

    def __init__(self, path: Path, compressed: bool = False) -> None:
        self.path = path
        try:
            self._writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
            if compressed:
                self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            self._writer.open()
        except WriterError as error:
            raise InputError(f'{path}: exists already; name a folder that does not') from error
        except OSError as error:
            raise InputError(f'{path}: cannot be made ({error.strerror}); choose another '
                             'folder') from error
        self._types = get_typestore(Stores.ROS2_JAZZY)
        self._connections: dict[str, Connection] = {}
        self._count = self._since_chunk = 0
        self.is_open = True

    def add_topic(self, name: str, type_name: str) -> bool:
        """Get ready for a topic; False where its type isn't known."""
        if name in self._connections:
            return True
        if type_name not in self._types.fielddefs:
            return False
        self._connections[name] = self._writer.add_connection(
            name, type_name, typestore=self._types)
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
            self._writer.write(connection, time, message)
        except OSError as error:
            raise self._unwritable(error) from error
        self._count += 1
        self._since_chunk += 1

    def finish_chunk(self) -> None:
        """Put what was written so far into the file, whole: a kill can't take it any more.

        rosbags itself finishes a chunk only at a mebibyte.

        Raises:
            InputError: the disk takes no more.
        """
        storage = self._writer.storage
        if not self.is_open or storage is None:
            return
        try:
            if storage.chunk.msgs:
                storage.close_chunk()
            storage.bio.flush()
        except OSError as error:
            raise self._unwritable(error) from error

    def close(self) -> int:
        """Write index and metadata; return the number of messages."""
        if self.is_open:
            self.is_open = False
            self._writer.close()
        return self._count

    def _unwritable(self, error: OSError) -> InputError:
        return InputError(f'{self.path}: cannot be written ({error.strerror}); free space or '
                          'choose another folder')
