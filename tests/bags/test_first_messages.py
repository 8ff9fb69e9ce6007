# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A topic's first messages have the times at which they were sent, as far as one can know."""

import pytest

from engb_core.io.bags.first_messages import FirstMessages, HOLD

SECOND, PERIOD = 10**9, 4_000_000
BEGIN = 1_700_000_000 * SECOND


def burst(offset=0, told=True, late=2 * SECOND, since=BEGIN):
    """A publisher of 250 Hz, whose clock is `offset` ahead, heard `late`, and then each time after
    a tenth of a millisecond; and when each was sent, by this computer's clock."""
    first, sent = FirstMessages(since), []
    for number in range((late + HOLD) // PERIOD + 2):
        now = BEGIN + number * PERIOD
        sent.append(now)
        received = max(now, BEGIN + late) + 100_000
        assert not first.are_complete(received) or number * PERIOD > late
        first.hold(now + offset if told else 0, received, bytes([number % 256]))
    assert first.are_complete(received) and first.count == len(sent)
    return first, sent


@pytest.mark.parametrize('offset', [0, 7 * SECOND, -7 * SECOND])
def test_they_were_sent_when_they_were_sent_whatever_the_publishers_clock(offset):
    first, sent = burst(offset)
    dated = first.dated(one_publisher=True)
    assert [time for time, _ in dated] == [now + 100_000 for now in sent]
    assert [message[0] for _, message in dated] == [number % 256 for number in range(len(sent))]


@pytest.mark.parametrize(('told', 'one_publisher'), [(False, True), (True, False)])
def test_where_nobody_can_know_they_came_when_they_came(told, one_publisher):
    first, sent = burst(told=told)
    times = [time for time, _ in first.dated(one_publisher)]
    assert times == [max(now, BEGIN + 2 * SECOND) + 100_000 for now in sent]


def test_nothing_was_sent_before_it_was_subscribed_to():
    first, _ = burst(since=BEGIN + SECOND)
    times = [time for time, _ in first.dated(one_publisher=True)]
    assert min(times) == BEGIN + SECOND and times == sorted(times)


def test_nothing_is_nothing():
    first = FirstMessages(BEGIN)
    assert not first.are_complete(BEGIN + 9 * SECOND)
    assert first.dated(one_publisher=True) == []
