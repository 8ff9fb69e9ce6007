# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""E2E profile 1A against other implementations; the receiver against lost, repeated, wrong."""

from hypothesis import given, strategies
import pytest

from engb_ros.can.end_to_end import (
    CheckStatus,
    crc8,
    frame_crc,
    LinkState,
    Protector,
    Receiver,
)

ID = 0x4501


def sound(protector, payload=bytes(6)):
    return bytes(protector.protect(bytearray(2) + payload))


def valid_link(**options):
    protector, receiver = Protector(ID), Receiver(ID, **options)
    for index in range(5):
        receiver.check(sound(protector), 0.001 * index)
    assert receiver.state is LinkState.VALID
    return protector, receiver


def test_the_crc_is_sae_j1850():
    # The check value of CRC-8/SAE-J1850 has start and final XOR 0xFF.
    assert crc8(b'123456789', 0xFF) ^ 0xFF == 0x4B


@given(strategies.binary(min_size=8, max_size=8), strategies.integers(0, 0xFFFF))
def test_it_agrees_with_the_autosar_library(data, data_id):
    p01 = pytest.importorskip('e2e.p01')
    theirs = bytearray(data)
    p01.e2e_p01_protect(theirs, data_id, data_id_mode=p01.E2E_P01_DATAID_BOTH,
                        increment_counter=False)
    assert frame_crc(data, data_id) == theirs[0]


@given(strategies.binary(min_size=6, max_size=6), strategies.integers(0, 63))
def test_every_single_bit_error_is_found(payload, bit):
    protector, receiver = valid_link()
    frame = bytearray(sound(protector, payload))
    frame[bit // 8] ^= 1 << bit % 8
    assert receiver.check(frame, 0.01) is CheckStatus.WRONG_CRC


@given(strategies.binary(max_size=64))
def test_garbage_is_practically_never_taken(data):
    _, receiver = valid_link()
    status = receiver.check(data, 0.01)
    if status is not CheckStatus.WRONG_CRC:   # one in 256 has the right CRC by chance
        assert data[0] == frame_crc(data, ID)


def test_a_frame_of_another_data_id_is_not_taken():
    _, receiver = valid_link()
    assert receiver.check(sound(Protector(ID + 1)), 0.01) is CheckStatus.WRONG_CRC


@pytest.mark.parametrize(('lost', 'status'), [
    (0, CheckStatus.OK), (1, CheckStatus.SOME_LOST), (3, CheckStatus.SOME_LOST),
    (4, CheckStatus.WRONG_SEQUENCE), (13, CheckStatus.WRONG_SEQUENCE),
    (14, CheckStatus.REPEATED)])
def test_lost_frames(lost, status):
    protector, receiver = valid_link()
    for _ in range(lost):
        sound(protector)
    assert receiver.check(sound(protector), 0.01) is status


def test_repeated_frames_make_the_link_invalid_and_sound_ones_valid_again():
    protector, receiver = valid_link()
    frame = sound(protector)
    receiver.check(frame, 0.01)
    for index in range(4):
        assert receiver.state is LinkState.VALID
        assert receiver.check(frame, 0.011 + 0.001 * index) is CheckStatus.REPEATED
    assert receiver.state is LinkState.INVALID
    assert not receiver.usable(CheckStatus.OK)
    for index in range(3):
        receiver.check(sound(protector), 0.02 + 0.001 * index)
    assert receiver.state is LinkState.VALID


def test_silence_is_noticed_and_recovered_from():
    protector, receiver = valid_link(timeout=0.05)
    assert not receiver.watch(0.05)
    assert receiver.watch(0.06)
    assert receiver.state is LinkState.INVALID
    assert not receiver.watch(0.07)
    for _ in range(7):
        sound(protector)   # whatever the counter is by then
    for index in range(3):
        receiver.check(sound(protector), 1.0 + 0.001 * index)
    assert receiver.state is LinkState.VALID
    assert receiver.timeouts == 1


@given(strategies.lists(strategies.sampled_from(['sound', 'lost', 'repeat', 'corrupt', 'wait'])))
def test_in_any_order_of_faults_only_sound_frames_are_used(events):
    protector, receiver, now = Protector(ID), Receiver(ID), 0.0
    last = sound(protector)
    for event in events:
        now += 0.001
        if event == 'sound':
            last = sound(protector)
            receiver.check(last, now)
        elif event == 'lost':
            sound(protector)
        elif event == 'repeat':
            assert not receiver.usable(receiver.check(last, now)) or (
                receiver.counts[CheckStatus.OK] > 0)
        elif event == 'corrupt':
            status = receiver.check(bytes([last[0] ^ 0x55]) + last[1:], now)
            assert status is CheckStatus.WRONG_CRC
            assert not receiver.usable(status)
        else:
            now += 0.1
            receiver.watch(now)
            assert receiver.state in (LinkState.NO_DATA, LinkState.INVALID)
    for _ in range(20):   # and it always recovers
        now += 0.001
        receiver.check(sound(protector), now)
    assert receiver.state is LinkState.VALID


def counters(protector, count):
    return [sound(protector)[1] & 0x0F for _ in range(count)]


def test_the_counter_runs_from_0_to_14():
    assert counters(Protector(ID), 17) == [*range(15), 0, 1]
    protector = Protector(ID)
    assert protector.protect(bytearray(4), 33)[1] == 3
    assert counters(protector, 1) == [4]


def test_a_frame_that_never_went_out_gives_its_counter_back():
    protector = Protector(ID)
    assert counters(protector, 1) == [0]
    protector.take_back()
    assert counters(protector, 3) == [0, 1, 2]
    protector.take_back()
    assert counters(protector, 2) == [2, 3]


def test_only_the_low_nibble_is_the_counters():
    frame = Protector(ID).protect(bytearray((0, 0xBF, 0, 0)))
    assert frame[1:] == bytes((0xB0, 0, 0))


def test_without_a_start_value_the_crc_begins_at_0():
    assert crc8(b'') == 0


def wrong(protector):
    frame = bytearray(sound(protector))
    protector.take_back()
    frame[0] ^= 0x55
    return bytes(frame)


@pytest.mark.parametrize(('between', 'state'), [(6, LinkState.INVALID), (7, LinkState.VALID)])
def test_more_than_three_wrong_ones_of_the_last_ten_end_the_link(between, state):
    protector, receiver = valid_link()
    for _ in range(3):
        receiver.check(wrong(protector), 0.01)
    for _ in range(between):
        receiver.check(sound(protector), 0.01)
    receiver.check(wrong(protector), 0.01)
    assert receiver.state is state


def test_three_sound_ones_in_a_row_make_a_link():
    protector, receiver = Protector(ID), Receiver(ID)
    for state in (LinkState.INIT, LinkState.INIT, LinkState.VALID):
        assert receiver.check(sound(protector), 0.0) is CheckStatus.OK
        assert receiver.state is state
    assert receiver.counts == {CheckStatus.OK: 3}
    assert not receiver.watch(0.05)
    assert receiver.watch(0.051)
    for _ in range(2):
        receiver.check(sound(protector), 0.1)
    assert receiver.state is LinkState.INVALID
    receiver.check(wrong(protector), 0.1)
    for _ in range(2):
        receiver.check(sound(protector), 0.1)
        assert receiver.state is LinkState.INVALID
    receiver.check(sound(protector), 0.1)
    assert receiver.state is LinkState.VALID


def test_wrong_frames_do_not_break_the_silence_and_sound_ones_do():
    for make, silent in ((wrong, True), (sound, False)):
        protector, receiver = valid_link()
        receiver.check(make(protector), 0.04)
        assert receiver.watch(0.06) is silent


def test_counter_15_is_none_and_short_frames_are_judged_whole():
    def framed(*data):
        frame = bytearray((0, *data))
        frame[0] = frame_crc(frame, ID)
        return bytes(frame)

    _, receiver = valid_link()   # the last counter was 4
    assert receiver.check(framed(0x0F, 1), 0.01) is CheckStatus.WRONG_SEQUENCE
    assert receiver.check(framed(), 0.01) is CheckStatus.WRONG_CRC
    assert receiver.check(framed(5), 0.01) is CheckStatus.OK
