# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What an interface can do to a bus: not be there, fail while it is read, report bus-off.

The interface is one of python-can's kind, within this process; what it does next is told to it.
"""

from __future__ import annotations

from collections.abc import Iterator
import errno
from queue import Queue
import sys
import time
from types import SimpleNamespace
from typing import Any

import pytest

can = pytest.importorskip('can')

from engb_core.errors import InputError  # noqa: E402
from engb_ros.can.bus import CanBus  # noqa: E402
from engb_ros.can.libraries import without_file_formats  # noqa: E402

PAUSE = 0.05


class ToldBus(can.BusABC):
    """Gives what stands in the queue: messages are received, exceptions raised."""

    def __init__(self, channel: str, **options: Any) -> None:
        TOLD.opened.append(options)
        if TOLD.closed_doors > 0:
            TOLD.closed_doors -= 1
            raise OSError('No such device')
        super().__init__(channel=channel)
        TOLD.filters = None

    def _apply_filters(self, filters: Any) -> None:
        TOLD.filters = filters

    def _recv_internal(self, timeout: float | None) -> tuple[Any, bool]:
        if TOLD.next.empty():
            time.sleep(0.002)
            return None, False
        given = TOLD.next.get()
        if isinstance(given, Exception):
            while given is TOLD.held:
                time.sleep(0.002)
            raise given
        return given, False

    def send(self, msg: Any, timeout: float | None = None) -> None:
        if TOLD.refusal is not None:
            raise TOLD.refusal
        TOLD.sent.append(msg.arbitration_id)

    @property
    def state(self) -> Any:
        if TOLD.state is None:
            raise NotImplementedError
        return TOLD.state


TOLD = SimpleNamespace()


@pytest.fixture(autouse=True)
def interface(monkeypatch: pytest.MonkeyPatch) -> None:
    vars(TOLD).update(opened=[], closed_doors=0, held=None, refusal=None, next=Queue(), sent=[],
                      state=None)
    monkeypatch.setitem(can.interface.BACKENDS, 'virtual', (__name__, 'ToldBus'))


@pytest.fixture
def bus() -> Iterator[SimpleNamespace]:
    received: list[tuple[int, bytes]] = []
    opened = CanBus('virtual', 'one', 0, lambda name, data, *_: received.append((name, data)), {1},
                    PAUSE)
    yield SimpleNamespace(can=opened, received=received)
    opened.close()


def frame(identifier: int, **more: Any) -> Any:
    return can.Message(arbitration_id=identifier, data=b'\7',
                       **{'is_extended_id': False, **more})


def until(holds: Any) -> None:
    end = time.monotonic() + 20.0
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.002)


def test_only_what_is_wanted_is_received(bus):
    for given in (frame(2), frame(1, is_extended_id=True), frame(1)):
        TOLD.next.put(given)
    until(lambda: bus.received)
    assert bus.received == [(1, b'\7')]


def test_the_kernel_filters_on_linux(monkeypatch):
    monkeypatch.setitem(can.interface.BACKENDS, 'socketcan', (__name__, 'ToldBus'))
    CanBus('socketcan', 'can0', 0, print, {0x101, 0x102}).close()
    assert [entry['can_id'] for entry in TOLD.filters] == [0x101, 0x102]


@pytest.mark.parametrize('error', [OSError('gone'), ValueError('closed'),
                                   can.CanOperationError('lost')])
def test_a_bus_that_cannot_be_read_is_opened_anew(bus, error):
    TOLD.closed_doors = 2        # and is not back at once
    TOLD.next.put(error)
    until(lambda: bus.can.failures)
    assert not bus.can.send(1, b'\1')
    assert (bus.can.refused, TOLD.sent) == (0, []), 'a bus that is down is not asked'
    until(lambda: bus.can.is_up)
    assert len(TOLD.opened) == 4
    assert bus.can.failures == 1
    assert bus.can.send(1, b'\2')
    TOLD.next.put(frame(1))
    until(lambda: bus.received)


def test_bus_off_is_a_failure(bus):
    TOLD.state = can.BusState.ERROR
    TOLD.next.put(frame(0, is_error_frame=True))
    until(lambda: bus.can.failures)
    until(lambda: bus.can.is_up)
    assert bus.received == []


@pytest.mark.parametrize('state', [None, can.BusState.ACTIVE])
def test_an_error_frame_alone_is_none(bus, state):
    """None: an interface that cannot tell its state."""
    TOLD.state = state
    TOLD.next.put(frame(0, is_error_frame=True))
    TOLD.next.put(frame(1))
    until(lambda: bus.received)
    assert (bus.can.failures, bus.can.is_up) == (0, True)


def test_a_bus_that_is_gone_while_it_is_closed_does_not_come_back():
    bus = CanBus('virtual', 'one', 0, print, {1}, reconnect_time=60.0)
    TOLD.next.put(OSError('gone'))
    until(lambda: bus.failures)
    begin = time.monotonic()
    bus.close()
    assert time.monotonic() - begin < 1.5, 'it waited for the pause before it is opened again'
    assert len(TOLD.opened) == 1


def test_what_sending_and_reading_both_find_is_one_failure(bus):
    TOLD.held, TOLD.refusal = OSError('gone'), can.CanOperationError('No', errno.ENODEV)
    TOLD.next.put(TOLD.held)
    until(TOLD.next.empty)       # the reader waits in the interface
    assert not bus.can.send(1, b'\1')
    assert bus.can.failures == 1
    TOLD.held = TOLD.refusal = None
    until(lambda: bus.can.is_up)
    assert bus.can.failures == 1


@pytest.mark.parametrize('refusal', [can.CanOperationError('full', errno.ENOBUFS),
                                     can.CanOperationError('Transmit buffer full'),
                                     OSError(errno.EAGAIN, 'again')])
def test_a_refused_frame_is_counted_and_the_bus_stays(bus, refusal):
    TOLD.refusal = refusal
    assert not bus.can.send(1, b'\1')
    assert (bus.can.is_up, bus.can.is_refusing, bus.can.refused) == (True, True, 1)
    TOLD.refusal = None
    assert bus.can.send_surely(lambda: (1, b'\2'), 10.0)
    assert not bus.can.is_refusing


def test_only_a_bus_that_refuses_for_long_is_given_up(bus):
    TOLD.refusal = can.CanOperationError('full', errno.ENOBUFS)
    begin = time.monotonic()
    assert not bus.can.send_surely(lambda: (1, b'\1'), 60.0)
    assert time.monotonic() - begin >= PAUSE
    assert (bus.can.failures, bus.can.refused > 1) == (1, True)


def test_patience_with_a_full_queue_ends():
    TOLD.refusal = can.CanOperationError('full', errno.ENOBUFS)
    bus = CanBus('virtual', 'one', 0, print, {1}, reconnect_time=60.0)
    try:
        assert not bus.send_surely(lambda: (1, b'\1'), 0.02)
        assert bus.is_up
    finally:
        bus.close()


def test_a_port_behind_a_multicast_group(monkeypatch):
    monkeypatch.setitem(can.interface.BACKENDS, 'udp_multicast', (__name__, 'ToldBus'))
    CanBus('udp_multicast', '239.0.0.1:4711', 0, print, {1}).close()
    assert TOLD.opened[-1]['port'] == 4711
    with pytest.raises(InputError, match='after the colon stands a port'):
        CanBus('udp_multicast', '239.0.0.1:0', 0, print, {1})


def test_a_last_word_on_a_bus_that_is_down_is_not_waited_for(bus):
    TOLD.closed_doors = 1000
    TOLD.next.put(OSError('gone'))
    until(lambda: bus.can.failures)
    begin = time.monotonic()
    assert not bus.can.send_surely(lambda: (1, b'\0'), 60.0)
    assert time.monotonic() - begin < 5.0
    TOLD.closed_doors = 0


def test_the_bitrate_is_handed_on_where_one_is_given():
    for bitrate, given in ((500_000, {'bitrate': 500_000}), (0, {})):
        CanBus('virtual', 'one', bitrate, print, {1}).close()
        assert {name: value for name, value in TOLD.opened[-1].items()
                if name == 'bitrate'} == given


def test_a_bus_that_cannot_be_opened_is_told():
    TOLD.closed_doors = 1
    with pytest.raises(InputError, match=r'virtual one cannot be opened \(No such device\)'):
        CanBus('virtual', 'one', 0, print, {1})


def test_python_can_that_is_not_there_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, 'can', None)
    with pytest.raises(InputError, match='python-can is not installed; pip install'):
        CanBus('virtual', 'one', 0, print, {1})


def test_a_library_that_is_imported_already_stays(monkeypatch):
    there = SimpleNamespace()
    monkeypatch.setitem(sys.modules, 'asammdf', there)
    with without_file_formats():
        assert sys.modules['asammdf'] is there
    monkeypatch.delitem(sys.modules, 'asammdf')
    with without_file_formats(), pytest.raises(ImportError):
        import asammdf  # noqa: F401
    assert 'asammdf' not in sys.modules
