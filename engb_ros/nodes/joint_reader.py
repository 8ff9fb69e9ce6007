# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""One joint out of serialised JointState messages, without building the message.

rclpy makes some forty Python objects of a JointState, and looks up the class of each: a fifth of
what a bare subscription costs. Of what a drive sends only five numbers change.
"""

from __future__ import annotations

import math
import struct
from typing import Any, TypeAlias

from engb_core.io.bags.cdr import JointLayout, parse_joint_state
from engb_core.io.bags.compression import Damaged

__all__ = ['JointReader', 'StampedSample']

# Where the stamp lies: behind the encapsulation.
_SEC, _NANOSEC = 4, 8


# Stamp (whole seconds, and nanoseconds of the next one), position [rad], velocity [rad/s],
# effort [N·m]; NaN where the message gives none.
StampedSample: TypeAlias = tuple[int, int, float, float, float]


class JointReader:
    """Reads the joint called `joint`; it remembers the layout of the last message.

    A message of another layout (other names, another number of values, another length of the
    frame's name) is parsed anew: it takes longer, and comes to the same.
    """

    def __init__(self, joint: str) -> None:
        self._joint = joint
        self._size = -1
        self._expected: tuple[bytes, ...] = ()
        self._fixed: Any = None
        self._numbers: Any = None
        self._has_velocity = self._has_effort = self._has_all = False

    def read(self, message: bytes) -> StampedSample | None:
        """Return the sample in a message; None where it doesn't hold the joint's position, or is
        no JointState in plain CDR."""
        if ((len(message) != self._size or self._fixed(message) != self._expected)
                and not self._learn(message)):
            return None
        if self._has_all:
            numbers: StampedSample = self._numbers(message)
            return numbers
        sec, nanosec, position, *rest = self._numbers(message)
        return (sec, nanosec, position, rest[0] if self._has_velocity else math.nan,
                rest[-1] if self._has_effort else math.nan)

    def names(self, message: bytes) -> list[str]:
        """Return the joints that a message holds; none where it is no JointState."""
        try:
            return list(parse_joint_state(message).names)
        except Damaged:
            return []

    def _learn(self, message: bytes) -> bool:
        """Take up the layout of a message; return whether it holds the joint's position."""
        self._size = -1
        try:
            layout = parse_joint_state(message)
        except Damaged:
            return False
        if self._joint not in layout.names:
            return False
        index = layout.names.index(self._joint)
        places = [(offset + 8 * index, 'd') for offset, count in
                  (layout.position, layout.velocity, layout.effort) if index < count]
        if index >= layout.position[1]:
            return False
        self._has_velocity = index < layout.velocity[1]
        self._has_effort = index < layout.effort[1]
        self._has_all = self._has_velocity and self._has_effort
        self._numbers = _struct(layout, [(_SEC, 'i'), (_NANOSEC, 'I'), *places]).unpack
        self._fixed = _struct(layout, [(offset, f'{len(value)}s')
                                       for offset, value in layout.fixed]).unpack
        self._expected = tuple(value for _, value in layout.fixed)
        self._size = layout.size
        return True


def _struct(layout: JointLayout, places: list[tuple[int, str]]) -> struct.Struct:
    """Return what unpacks the fields at `places` (offset, format), in their order."""
    text, end = layout.order, 0
    for offset, kind in places:
        text += f'{offset - end}x{kind}'
        end = offset + struct.calcsize(f'{layout.order}{kind}')
    return struct.Struct(f'{text}{layout.size - end}x')
