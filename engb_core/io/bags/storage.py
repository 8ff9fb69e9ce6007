# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the readers of the two storage formats have in common."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from engb_core.io.bags.compression import Damaged, decompress_message, ZSTD_MAGIC

__all__ = ['Batch', 'Channel', 'StorageFile', 'as_batch', 'cut_out', 'unwrapped']


@dataclass(frozen=True)
class Channel:
    """A topic of a file: its name, message type ('pkg/msg/Name') and encoding (mostly 'cdr')."""

    topic: str
    type: str
    encoding: str = 'cdr'


@dataclass(frozen=True)
class Batch:
    """Some messages of one topic, in the file's order.

    Attributes:
        topic: the topic's name.
        log_time: (k,) int64 [ns], the recorder's clock.
        rows: (k, size) uint8 where all messages have one size, else a list of k byte strings.
    """

    topic: str
    log_time: NDArray[np.int64]
    rows: NDArray[np.uint8] | list[bytes]

    def __len__(self) -> int:
        return self.log_time.size


class StorageFile(Protocol):
    """One file of a bag."""

    notes: list[str]   # what had to be repaired or left out, a sentence each

    def channels(self) -> list[Channel]:
        """Return the topics in the file."""
        ...

    def batches(self, topics: set[str]) -> Iterator[Batch]:
        """Yield all messages of `topics`, a bounded number at a time."""
        ...


def as_batch(topic: str, log_time: NDArray[np.int64], messages: list[bytes]) -> Batch:
    """Stack messages of one size into rows; keep others as they are."""
    sizes = set(map(len, messages))
    if len(sizes) == 1 and (size := sizes.pop()):
        rows = np.frombuffer(b''.join(messages), np.uint8).reshape(-1, size)
        return Batch(topic, log_time, rows)
    return Batch(topic, log_time, messages)


def cut_out(data: NDArray[np.uint8], start: NDArray[np.int64], size: NDArray[np.int64],
            ) -> NDArray[np.uint8] | list[bytes]:
    """Copy the messages that begin at `start` (k,) in `data` and are `size` (k,) long.

    Returns:
        As `Batch.rows`: (k, size) where all have one size, else a list.
    """
    one = int(size[0]) if size.size else 0
    if one and (size == one).all():
        # All windows of that size, one byte apart: indexing them copies messages as a whole.
        windows = np.ndarray((data.size - one + 1,), f'V{one}', data, strides=(1,))
        return windows[start].view(np.uint8).reshape(-1, one)
    return [data[begin:begin + count].tobytes()
            for begin, count in zip(start.tolist(), size.tolist(), strict=True)]


def unwrapped(batch: Batch) -> tuple[Batch, int]:
    """Undo rosbag2's message mode, in which each message is a zstd frame of its own.

    Returns:
        The batch with plain messages, and how many had to be left out as damaged.
    """
    rows = batch.rows
    # No CDR message starts like a zstd frame: its first byte is 0. A bag's messages are packed
    # all or none, so the first of a batch tells.
    if not len(rows) or bytes(rows[0][:4]) != ZSTD_MAGIC:
        return batch, 0
    if isinstance(rows, np.ndarray):
        rows = [row.tobytes() for row in rows]
    kept, plain = [], []
    for index, row in enumerate(rows):
        try:
            plain.append(decompress_message(row) if row.startswith(ZSTD_MAGIC) else row)
        except Damaged:
            continue
        kept.append(index)
    return as_batch(batch.topic, batch.log_time[kept], plain), len(rows) - len(kept)
