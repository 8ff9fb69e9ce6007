# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The bus itself (python-can): opened by parameters, opened again after a fault."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import errno
import threading
import time
from typing import Any

from engb_core.errors import InputError
from engb_ros.can.libraries import without_file_formats

__all__ = ['CanBus']

# No frame waits so long to be read [s]: an interface that says so has a clock of its own.
_LONGEST_WAIT = 10.0

# With these the interface itself is gone or down. Everything else that a send can meet (a full
# queue above all: ENOBUFS, EAGAIN, or no number at all) may be over with the next frame.
_GONE = frozenset({errno.ENETDOWN, errno.ENODEV, errno.ENXIO, errno.EBADF, errno.ENOTCONN})


class CanBus:
    """A CAN bus that is read in a thread of its own and reopened when it fails.

    A frame that the bus refuses to take (its queue is full) is dropped and counted; the next one
    is newer anyway. Only when nothing could be sent for `reconnect_time` is the bus opened anew:
    that costs as long without a bus, so it must not be done for less.

    Args:
        interface, channel, bitrate: as python-can takes them; bitrate 0: as configured. With
            udp_multicast the channel may be GROUP:PORT (IPv4).
        receive: called in the reading thread with identifier, bytes, the steady time [s], and how
            long the frame had waited by then [s]: from when the kernel (SocketCAN, UDP) or the
            interface took it; 0 where that is not told by the system's clock.
        identifiers: which frames are wanted.
        reconnect_time: pause before a failed bus is opened again [s].

    Attributes:
        is_up: the bus is open and didn't report bus-off.
        failures: how often it went down.
        refused: how many frames it did not take.

    Raises:
        InputError: python-can isn't installed, the port is no number, or the bus cannot be
            opened at the start.
    """

    def __init__(self, interface: str, channel: str, bitrate: int,
                 receive: Callable[[int, bytes, float, float], None], identifiers: set[int],
                 reconnect_time: float = 1.0) -> None:
        try:
            with without_file_formats():
                import can
        except ImportError:
            raise InputError('python-can is not installed; pip install "engb_ros[can]", or apt '
                             'install python3-can') from None
        self._can = can
        self._options = _addressed(interface, channel)
        if bitrate:
            self._options['bitrate'] = bitrate
        self._filters: list[Any] = [{'can_id': identifier, 'can_mask': 0x7FF, 'extended': False}
                         for identifier in sorted(identifiers)]
        self._receive = receive
        self._wanted = identifiers
        self._reconnect_time = reconnect_time
        self._stopped = threading.Event()
        self.failures = self.refused = 0
        self._refusing_since: float | None = None
        try:
            self._bus = self._open()
        except Exception as error:   # each interface raises kinds of its own
            raise InputError(f'CAN bus {interface} {channel} cannot be opened '
                             f'({" ".join(str(error).split())}); check interface and channel'
                             ) from error
        self.is_up = True
        self._thread = threading.Thread(target=self._read, name='can', daemon=True)
        self._thread.start()

    def send(self, identifier: int, data: bytes) -> bool:
        """Send a frame; False where the bus is down or refuses it."""
        if not self.is_up:
            return False
        try:
            self._bus.send(self._can.Message(arbitration_id=identifier, data=data,
                                             is_extended_id=False))
        except (self._can.CanError, OSError, ValueError) as error:
            self._refuse(error)
            return False
        self._refusing_since = None
        return True

    def send_surely(self, make_frame: Callable[[], tuple[int, bytes]], patience: float) -> bool:
        """Send a frame, and anew where it is refused, for `patience` [s]; whether it went out."""
        end = time.monotonic() + patience
        while not self.send(*make_frame()):
            if not self.is_up or time.monotonic() > end:
                return False
            time.sleep(0.001)
        return True

    @property
    def is_refusing(self) -> bool:
        """Whether the last frame was refused."""
        return self._refusing_since is not None

    def close(self) -> None:
        """Stop reading and give the bus back."""
        self._stopped.set()
        self._thread.join(timeout=2.0)
        self._shut()

    def _open(self) -> Any:
        bus = self._can.Bus(**self._options)
        # Linux filters in the kernel and still gives error frames; python-can, which filters for
        # most other interfaces, drops those, and bus-off with them. The reading loop filters all.
        if self._options['interface'] == 'socketcan':
            with contextlib.suppress(Exception):
                bus.set_filters(self._filters)
        return bus

    def _read(self) -> None:
        while not self._stopped.is_set():
            if not self.is_up:
                self._reopen()
                continue
            try:
                message = self._bus.recv(timeout=0.1)
            except (self._can.CanError, OSError, ValueError):
                self._fail()
                continue
            if message is None:
                continue
            if message.is_error_frame:
                self._look_for_bus_off()
            elif message.arbitration_id in self._wanted and not message.is_extended_id:
                self._receive(message.arbitration_id, bytes(message.data), time.monotonic(),
                              _waited(message.timestamp))

    def _look_for_bus_off(self) -> None:
        with contextlib.suppress(NotImplementedError, AttributeError):
            if self._bus.state is self._can.BusState.ERROR:
                self._fail()

    def _refuse(self, error: Exception) -> None:
        """Count a refused frame; give the bus up where it is gone, or takes nothing any more."""
        now = time.monotonic()
        self.refused += 1
        if self._refusing_since is None:
            self._refusing_since = now
        number = getattr(error, 'error_code', None) or getattr(error, 'errno', None)
        if number in _GONE or isinstance(error, ValueError) or (
                now - self._refusing_since > self._reconnect_time):
            self._fail()

    def _fail(self) -> None:
        if self.is_up:
            self.is_up = False
            self.failures += 1

    def _reopen(self) -> None:
        self._shut()
        if self._stopped.wait(self._reconnect_time):
            return
        try:
            self._bus = self._open()
        except Exception:   # not back yet: the next round tries again
            return
        self._refusing_since = None
        self.is_up = True

    def _shut(self) -> None:
        with contextlib.suppress(Exception):
            self._bus.shutdown()


def _waited(timestamp: float) -> float:
    waited = time.time() - timestamp
    return waited if 0.0 < waited < _LONGEST_WAIT else 0.0


def _addressed(interface: str, channel: str) -> dict[str, Any]:
    """Return python-can's options for a channel.

    python-can binds a multicast bus's port on every address, so all groups with one port hear
    each other on one machine; a port of its own keeps a bus apart.
    """
    if interface != 'udp_multicast' or channel.count(':') != 1:
        return {'interface': interface, 'channel': channel}
    group, _, port = channel.partition(':')
    if not port.isdecimal() or not 0 < int(port) < 65536:
        raise InputError(f'parameter channel is {channel!r}; after the colon stands a port, '
                         '1 to 65535')
    return {'interface': interface, 'channel': group, 'port': int(port)}
