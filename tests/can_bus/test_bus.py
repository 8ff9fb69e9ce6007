# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The bus: a refused frame costs that frame; a bus that takes nothing any more is opened anew."""

import os
import threading
import time

import pytest

can = pytest.importorskip('can')
pytest.importorskip('msgpack')

from can.interfaces.udp_multicast import UdpMulticastBus  # noqa: E402

from can_bus.refusing_bus import RefusingBus  # noqa: E402
from engb_core.errors import InputError  # noqa: E402
from engb_ros.can.bus import CanBus  # noqa: E402

RECONNECT_TIME = 0.4
GROUP, PORT = '239.76.0.1', 20_000 + os.getpid() % 12_000


@pytest.fixture
def wires(tmp_path, monkeypatch):
    """A bus that refuses by the word in a file, what arrives at its other end, and the file."""
    monkeypatch.setitem(can.interface.BACKENDS, 'udp_multicast',
                        (RefusingBus.__module__, 'RefusingBus'))
    word = tmp_path / 'refuse'
    try:
        other = can.Bus(interface='udp_multicast', channel=GROUP, port=PORT)
    except OSError as error:
        pytest.skip(f'no UDP multicast on this machine: {error}')
    bus = CanBus('udp_multicast', f'{word},{GROUP}:{PORT}', 0, lambda *frame: None, {1},
                 RECONNECT_TIME)
    bus.send(1, b'\0')
    if other.recv(2.0) is None:
        pytest.skip('no UDP multicast on this machine')
    yield bus, other, word
    bus.close()
    other.shutdown()


@pytest.mark.parametrize('reason', ['ENOBUFS', 'EAGAIN', 'full'])
def test_one_refused_frame_costs_one_frame(wires, reason):
    bus, other, word = wires
    word.write_text(reason)
    assert not bus.send(1, b'\1')
    word.unlink()
    assert bus.is_up
    assert bus.is_refusing
    assert bus.send(1, b'\2')
    assert not bus.is_refusing
    assert bytes(other.recv(2.0).data) == b'\2'
    assert (bus.failures, bus.refused) == (0, 1)


def test_a_bus_that_takes_nothing_any_more_is_opened_anew(wires):
    bus, other, word = wires
    word.write_text('ENOBUFS')
    begin = time.monotonic()
    while bus.is_up and time.monotonic() - begin < 20.0:
        bus.send(1, b'\1')
        time.sleep(0.01)
    assert time.monotonic() - begin >= RECONNECT_TIME
    assert bus.failures == 1
    word.unlink()
    while not bus.send(1, b'\2') and time.monotonic() - begin < 20.0:
        time.sleep(0.01)
    assert bytes(other.recv(2.0).data) == b'\2'


def test_an_interface_that_is_gone_is_not_waited_for(wires):
    bus, _, word = wires
    word.write_text('ENETDOWN')
    assert not bus.send(1, b'\1')
    assert bus.failures == 1


def test_the_last_word_is_tried_again(wires):
    bus, other, word = wires
    word.write_text('once')
    assert bus.send_surely(lambda: (1, b'\3'), 1.0)
    assert bytes(other.recv(2.0).data) == b'\3'
    word.write_text('full')
    assert not bus.send_surely(lambda: (1, b'\4'), 0.02)


@pytest.mark.parametrize('channel', ['239.76.0.1:', '239.76.0.1:seven', '239.76.0.1:70000'])
def test_a_bad_port_is_told(channel):
    with pytest.raises(InputError, match='after the colon stands a port'):
        CanBus('udp_multicast', channel, 0, lambda *frame: None, {1})


def test_another_port_is_another_bus(wires):
    bus, _, _ = wires
    with can.Bus(interface='udp_multicast', channel='239.76.0.1',
                 port=32_000 + os.getpid() % 700) as stranger:
        for _ in range(5):
            bus.send(1, b'\5')
        assert stranger.recv(0.3) is None


@pytest.mark.parametrize('own_clock', [False, True])
def test_a_frame_that_was_not_read_at_once_tells_how_long_it_waited(wires, monkeypatch,
                                                                    own_clock):
    _, other, _ = wires
    if own_clock:   # an interface whose stamps are not of the system's clock
        def received(bus, timeout):
            message, filtered = UdpMulticastBus._recv_internal(bus, timeout)
            if message is not None:
                message.timestamp = 5.0
            return message, filtered

        monkeypatch.setattr(RefusingBus, '_recv_internal', received, raising=False)
    waits, reading, go_on = [], threading.Event(), threading.Event()

    def receive(_identifier, _data, _now, waited):
        waits.append(waited)
        reading.set()
        go_on.wait(10.0)

    bus = CanBus('udp_multicast', f'/nowhere,{GROUP}:{PORT}', 0, receive, {7})
    try:
        frame = can.Message(arbitration_id=7, data=b'\0', is_extended_id=False)
        other.send(frame)
        assert reading.wait(10.0)   # from now on nobody reads
        begin = time.monotonic()
        other.send(frame)
        sent = time.monotonic()
        time.sleep(0.2)
        before = time.monotonic()
        go_on.set()
        while len(waits) < 2:
            assert time.monotonic() - sent < 10.0
            time.sleep(0.001)
        after = time.monotonic()
    finally:
        go_on.set()
        bus.close()
    if own_clock:
        assert waits == [0.0, 0.0]
    else:
        assert before - sent - 0.01 < waits[1] < after - begin + 0.01
