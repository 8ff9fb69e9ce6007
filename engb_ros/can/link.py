# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Both ends of the link between controller and drive: what to send, what to believe."""

from __future__ import annotations

from engb_ros.can.codec import DriveCodec, DriveCommand, DriveStatus
from engb_ros.can.end_to_end import CheckStatus, LinkState, Protector, Receiver

__all__ = ['ControllerEnd', 'DriveEnd']

Frame = tuple[int, bytes]


class ControllerEnd:
    """The controller's end: sends commands, joins status frames to samples.

    A sample is complete when both status frames with one counter have come and both links are
    valid. Repeated, corrupted, unexpected and out-of-sequence frames give no sample.

    Attributes:
        receivers: one for each status frame.
        unpaired: status frames whose partner never came.
    """

    def __init__(self, codec: DriveCodec, timeout: float = 0.05) -> None:
        self._codec = codec
        self._protector = Protector(codec.data_id(codec.command))
        self.receivers = (Receiver(codec.data_id(codec.status_1), timeout=timeout),
                          Receiver(codec.data_id(codec.status_2), timeout=timeout))
        self._first: bytes | None = None
        self.unpaired = 0

    @property
    def state(self) -> LinkState:
        """The worse of both links' states."""
        order = (LinkState.VALID, LinkState.INIT, LinkState.NO_DATA, LinkState.INVALID)
        return max((receiver.state for receiver in self.receivers), key=order.index)

    def command(self, command: DriveCommand) -> Frame:
        """Return the frame that carries `command`: identifier and bytes."""
        data = self._protector.protect(self._codec.encode_command(command))
        return self._codec.command.frame_id, bytes(data)

    def take_back(self) -> None:
        """The last command never went out: the drive shall not miss its counter."""
        self._protector.take_back()

    def receive(self, identifier: int, data: bytes, now: float) -> DriveStatus | None:
        """Take a frame that came at `now` [s]; return a sample when one is complete."""
        codec = self._codec
        if identifier == codec.status_1.frame_id:
            if self._first is not None:
                self.unpaired += 1
            self._first = self._checked(0, data, now, codec.status_1.length)
        elif identifier == codec.status_2.frame_id:
            first, self._first = self._first, None
            second = self._checked(1, data, now, codec.status_2.length)
            if first is not None and second is not None:
                if first[1] & 0x0F == second[1] & 0x0F:
                    return codec.decode_status(first, second)
                self.unpaired += 1
        return None

    def watch(self, now: float) -> bool:
        """Look at the clock; return whether a link has just been lost to silence."""
        lost = [receiver.watch(now) for receiver in self.receivers]   # each must look
        return any(lost)

    def counts(self) -> dict[str, int]:
        """Return how often each finding came up, both frames together."""
        found = {status.value: sum(receiver.counts[status] for receiver in self.receivers)
                 for status in CheckStatus}
        found['timeouts'] = sum(receiver.timeouts for receiver in self.receivers)
        found['unpaired'] = self.unpaired
        return found

    def _checked(self, index: int, data: bytes, now: float, length: int) -> bytes | None:
        receiver = self.receivers[index]
        if len(data) != length:
            data = b''   # counted as a wrong CRC
        status = receiver.check(data, now)
        return bytes(data) if receiver.usable(status) else None


class DriveEnd:
    """The drive's end: believes commands, sends samples."""

    def __init__(self, codec: DriveCodec, timeout: float = 0.1) -> None:
        self._codec = codec
        self.receiver = Receiver(codec.data_id(codec.command), timeout=timeout)
        self._protectors = (Protector(codec.data_id(codec.status_1)),
                            Protector(codec.data_id(codec.status_2)))
        self._counter = -1

    def receive(self, identifier: int, data: bytes, now: float) -> DriveCommand | None:
        """Take a frame that came at `now` [s]; return the command if it may be obeyed."""
        if identifier != self._codec.command.frame_id:
            return None
        if len(data) != self._codec.command.length:
            data = b''
        status = self.receiver.check(data, now)
        return self._codec.decode_command(data) if self.receiver.usable(status) else None

    def status(self, status: DriveStatus) -> tuple[Frame, Frame]:
        """Return both status frames of a sample."""
        self._counter = (self._counter + 1) % 15
        first, second = self._codec.encode_status(status)
        return ((self._codec.status_1.frame_id,
                 bytes(self._protectors[0].protect(first, self._counter))),
                (self._codec.status_2.frame_id,
                 bytes(self._protectors[1].protect(second, self._counter))))
