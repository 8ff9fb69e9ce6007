# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Collects one joint out of JointState messages, batch by batch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.io.bags.cdr import JointLayout, parse_joint_state
from engb_core.io.bags.compression import Damaged
from engb_core.io.bags.storage import Batch

__all__ = ['DEFAULT_JOINT', 'JointCollector', 'JointTrack']

DEFAULT_JOINT = 'motor'

# A recording has one layout, or two where the drive starts without velocity. Beyond these few,
# messages are decoded one by one, so that damaged ones can't make the search slow.
_LAYOUTS = 32

Times = NDArray[np.int64]
Values = NDArray[np.float64]


@dataclass(frozen=True)
class JointTrack:
    """One joint as recorded: `stamp`, `log_time` (n,) [ns]; the others (n,), NaN where missing."""

    joint: str
    stamp: Times
    log_time: Times
    position: Values
    velocity: Values
    effort: Values


class JointCollector:
    """Takes batches of one JointState topic and keeps one joint of them.

    Args:
        joint: the joint's name, or None: 'motor', else the only joint there is.
    """

    def __init__(self, joint: str | None = None) -> None:
        self._preferred = joint or DEFAULT_JOINT
        self._layouts: dict[int, list[JointLayout]] = {}
        self._known = 0
        self._parts: dict[str, list[tuple[Times, Times, Values]]] = {}
        self._names: dict[str, None] = {}
        self.damaged = 0        # messages that could not be decoded

    def add(self, batch: Batch) -> None:
        """Decode a batch."""
        if isinstance(batch.rows, np.ndarray):
            self._add_rows(batch.log_time, batch.rows)
            return
        by_size: dict[int, list[int]] = {}
        for index, message in enumerate(batch.rows):
            by_size.setdefault(len(message), []).append(index)
        for size, indexes in by_size.items():
            if size:
                data = b''.join(batch.rows[index] for index in indexes)
                self._add_rows(batch.log_time[indexes],
                               np.frombuffer(data, np.uint8).reshape(-1, size))

    def _add_rows(self, log_time: Times, rows: NDArray[np.uint8]) -> None:
        layouts = self._layouts.setdefault(rows.shape[1], [])
        for layout in layouts:
            good = layout.matches(rows)
            if good.all():
                self._decode(layout, log_time, rows)
                return
            if good.any():
                self._decode(layout, log_time[good], rows[good])
                log_time, rows = log_time[~good], rows[~good]
        while rows.shape[0]:
            try:
                layout = parse_joint_state(rows[0].tobytes())
            except Damaged:
                self.damaged += 1
                log_time, rows = log_time[1:], rows[1:]
                continue
            if self._known >= _LAYOUTS:
                self._decode(layout, log_time[:1], rows[:1])
                log_time, rows = log_time[1:], rows[1:]
                continue
            self._known += 1
            layouts.append(layout)
            good = layout.matches(rows)
            self._decode(layout, log_time[good], rows[good])
            log_time, rows = log_time[~good], rows[~good]

    def _decode(self, layout: JointLayout, log_time: Times, rows: NDArray[np.uint8]) -> None:
        if len(self._names) < 1000:
            self._names.update(dict.fromkeys(layout.names))
        if self._preferred in layout.names:
            name = self._preferred
        elif len(layout.names) <= 1:
            # A message without names can only mean the one joint there is.
            name = layout.names[0] if layout.names else ''
        else:
            return
        index = layout.names.index(name) if layout.names else 0
        stamp, values = layout.decode(rows, index)
        self._parts.setdefault(name, []).append((stamp, log_time, values))

    def track(self, topic: str, source: str) -> JointTrack | None:
        """Return what was collected; None where the topic held no message.

        Raises:
            InputError: the joint can't be told from others; no message could be decoded.
        """
        if not self._names and not self._parts:
            if self.damaged:
                raise InputError(f'{source}: none of the {self.damaged} messages of {topic} can '
                                 'be decoded; record again')
            return None
        name = self._preferred
        if name not in self._parts:
            if len(self._parts) != 1 or len(self._names) > 1:
                joints = ', '.join(list(self._names)[:8])
                raise InputError(f'{source}: {topic} holds no joint {self._preferred!r} but '
                                 f'{joints}; say which: --joint NAME (joint=… in Python), or '
                                 'joint.name in the model file')
            name = next(iter(self._parts))
        # Where messages without a name are mixed in, they can't be told apart from the named.
        stamp, log_time, values = zip(*self._parts[name], strict=True)
        table = np.concatenate(values, axis=1)
        return JointTrack(name, np.concatenate(stamp), np.concatenate(log_time),
                          table[0], table[1], table[2])
