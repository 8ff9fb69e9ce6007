# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""AUTOSAR end-to-end protection, profile 1 variant 1A: CRC-8 and a 4 bit alive counter.

AUTOSAR, Specification of SW-C End-to-End Communication Protection Library: the CRC (SAE J1850,
polynomial 0x1D) runs over both bytes of the data ID, then over the frame without its CRC byte;
start and final XOR value 0. Byte 0 is the CRC, the low nibble of byte 1 the counter 0 to 14.
"""

from __future__ import annotations

from collections import Counter, deque
from enum import Enum

__all__ = ['CheckStatus', 'LinkState', 'Protector', 'Receiver', 'crc8', 'crc_start',
           'frame_crc']

COUNTERS = 15


def _table() -> bytes:
    entries = []
    for value in range(256):
        for _ in range(8):
            value = (value << 1) ^ 0x1D if value & 0x80 else value << 1
        entries.append(value & 0xFF)
    return bytes(entries)


_TABLE = _table()


def crc8(data: bytes | bytearray, start: int = 0) -> int:
    """Return the CRC-8 SAE J1850 of `data` with start value `start`, without a final XOR."""
    for byte in data:
        start = _TABLE[start ^ byte]
    return start


def crc_start(data_id: int) -> int:
    """Return the CRC of a data ID: 8 bits of 16, so that two data IDs may have the same."""
    return _TABLE[_TABLE[data_id & 0xFF] ^ data_id >> 8]


def frame_crc(data: bytes | bytearray, data_id: int) -> int:
    """Return the CRC of a frame whose byte 0 is the place of the CRC."""
    return crc8(data[1:], crc_start(data_id))


class Protector:
    """Writes counter and CRC into frames of one data ID."""

    def __init__(self, data_id: int) -> None:
        self._data_id = data_id
        self._counter = COUNTERS - 1

    def protect(self, frame: bytearray, counter: int | None = None) -> bytearray:
        """Fill in byte 0 and the low nibble of byte 1, in place; return the frame.

        `counter`: use this one (frames that belong together), else count on.
        """
        self._counter = (self._counter + 1) % COUNTERS if counter is None else counter % COUNTERS
        frame[1] = (frame[1] & 0xF0) | self._counter
        frame[0] = frame_crc(frame, self._data_id)
        return frame

    def take_back(self) -> None:
        """The last frame never went out: the next one bears its counter."""
        self._counter = (self._counter - 1) % COUNTERS


class CheckStatus(Enum):
    """What the check of one frame found."""

    OK = 'ok'
    SOME_LOST = 'some_lost'
    REPEATED = 'repeated'
    WRONG_SEQUENCE = 'wrong_sequence'
    WRONG_CRC = 'wrong_crc'


class LinkState(Enum):
    """The receiver's state machine: whether what comes may be believed."""

    NO_DATA = 'no_data'
    INIT = 'init'
    VALID = 'valid'
    INVALID = 'invalid'


class Receiver:
    """Checks frames of one data ID and judges the link.

    After the E2E state machine: NO_DATA → INIT with the first sound frame, INIT → VALID after
    `needed` sound ones, VALID → INVALID when more than `tolerated` of the last `window` checks
    failed or nothing came for `timeout`; INVALID → VALID after `needed` sound ones in a row.

    Args:
        data_id: of the frames.
        largest_jump: counters that may be missing between two sound frames.
        window, tolerated, needed: of the state machine, in frames.
        timeout: without a frame for so long the link is invalid [s].

    Attributes:
        state: may the data be used (VALID)?
        counts: how often each CheckStatus came up.
        timeouts: how often nothing came.
    """

    def __init__(self, data_id: int, largest_jump: int = 3, window: int = 10, tolerated: int = 3,
                 needed: int = 3, timeout: float = 0.05) -> None:
        self._data_id = data_id
        self._largest_jump = largest_jump
        self._recent: deque[bool] = deque(maxlen=window)
        self._tolerated = tolerated
        self._needed = needed
        self._timeout = timeout
        self._counter: int | None = None
        self._in_a_row = 0
        self._last = 0.0
        self.state = LinkState.NO_DATA
        self.counts: Counter[CheckStatus] = Counter()
        self.timeouts = 0

    def check(self, frame: bytes, now: float) -> CheckStatus:
        """Check one frame that came at `now` [s]; the state follows."""
        status = self._status(frame)
        self.counts[status] += 1
        sound = status in (CheckStatus.OK, CheckStatus.SOME_LOST)
        if status is not CheckStatus.WRONG_CRC:
            self._last = now
        self._recent.append(sound)
        self._in_a_row = self._in_a_row + 1 if sound else 0
        if self.state is LinkState.NO_DATA:
            if sound:
                self.state = LinkState.INIT
        elif self.state is LinkState.VALID:
            if self._recent.count(False) > self._tolerated:
                self.state = LinkState.INVALID
        elif self._in_a_row >= self._needed:
            self.state = LinkState.VALID
            self._recent.clear()
        return status

    def watch(self, now: float) -> bool:
        """Look at the clock; return whether the link has just been lost to silence."""
        if self.state in (LinkState.NO_DATA, LinkState.INVALID) or (
                now - self._last <= self._timeout):
            return False
        self.state = LinkState.INVALID
        self.timeouts += 1
        self._in_a_row = 0
        self._counter = None
        return True

    def usable(self, status: CheckStatus) -> bool:
        """Whether the data of a frame with this check's status may be used now."""
        return (self.state is LinkState.VALID
                and status in (CheckStatus.OK, CheckStatus.SOME_LOST))

    def _status(self, frame: bytes) -> CheckStatus:
        if len(frame) < 2 or frame[0] != frame_crc(frame, self._data_id):
            return CheckStatus.WRONG_CRC
        counter = frame[1] & 0x0F
        if counter >= COUNTERS:
            return CheckStatus.WRONG_SEQUENCE
        before, self._counter = self._counter, counter
        if before is None:
            return CheckStatus.OK
        step = (counter - before) % COUNTERS
        if step == 0:
            return CheckStatus.REPEATED
        if step == 1:
            return CheckStatus.OK
        return CheckStatus.SOME_LOST if step <= 1 + self._largest_jump else (
            CheckStatus.WRONG_SEQUENCE)
