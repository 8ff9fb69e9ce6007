# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Of several publishers of torque a drive obeys one."""

import itertools
import random

import pytest

from engb_core.control.publisher_watch import FirstPublisher, PublisherWatch

CYCLE = 0.004


TIMEOUT, LIMIT, TORQUE = 0.1, 0.75, 0.1


def watching():
    return PublisherWatch(TIMEOUT, LIMIT)


class Publisher:
    """Sends each `period` [s] from `begin` [s] on, `torque` [N·m]."""

    def __init__(self, name, period=CYCLE, begin=0.0, end=1e9, pauses=(), late=lambda: 0.0,
                 torque=TORQUE):
        self.name, self.torque = name, torque
        self.times = (begin + period * index + late() for index in itertools.count())
        self.end, self.pauses = end, pauses

    def messages(self, until):
        for now in itertools.takewhile(lambda now: now < min(until, self.end), self.times):
            if not any(begin < now < end for begin, end in self.pauses):
                yield now, self.name, self.torque


def obeyed(publishers, until, watch=None, lost=lambda index: False):
    """Return [(time, name)] of the messages that are obeyed."""
    watch = watch or watching()
    found = []
    messages = sorted(message for publisher in publishers for message in publisher.messages(until))
    for index, (now, name, torque) in enumerate(messages):
        if not lost(index) and watch.obeys(now, torque, name.encode()):
            found.append((now, name))
    return found


def count(found, name, begin=0.0, end=1e9):
    return sum(1 for now, who in found if who == name and begin <= now < end)


def test_one_publisher_is_obeyed_always():
    assert count(obeyed([Publisher('controller')], 5.0), 'controller') == 1250


def test_a_single_message_of_a_stranger_is_not_obeyed():
    controller = Publisher('controller')
    stranger = Publisher('stranger', begin=4.001, end=4.002)
    found = obeyed([controller, stranger], 8.0)
    assert count(found, 'stranger') == 0
    assert count(found, 'controller') == 2000


@pytest.mark.parametrize('period', [0.0011, 0.0003, 0.0039, CYCLE, 0.02, 0.1])
@pytest.mark.parametrize('begin', [0.5, 3.0])
def test_a_stranger_who_goes_on_is_not_obeyed(period, begin):
    controller = Publisher('controller')
    stranger = Publisher('stranger', period, begin + 0.0007)
    found = obeyed([controller, stranger], 8.0)
    assert count(found, 'stranger') == 0
    assert count(found, 'controller') == 2000


@pytest.mark.parametrize('period', [0.0005, 0.001, 0.002, 0.003])
@pytest.mark.parametrize('seed', range(5))
def test_who_is_late_now_and_then_is_obeyed_alone(period, seed):
    drawn = random.Random(seed)
    controller = Publisher('controller', late=lambda: drawn.uniform(0.0, 0.036))
    stranger = Publisher('stranger', period, 2.0 + drawn.uniform(0.0, CYCLE),
                         late=lambda: drawn.uniform(0.0, 0.9 * period))
    found = obeyed([controller, stranger], 10.0)
    assert count(found, 'stranger') == 0
    assert count(found, 'controller') >= 2490


@pytest.mark.parametrize('stall', [0.06, 0.3, 0.9, 1.2, 5.0, 30.0])
def test_a_primary_that_speaks_again_is_obeyed_once_its_standby_has_yielded(stall):
    end = 5.0 + stall
    primary = Publisher('primary', pauses=[(5.0, end)])
    standby = Publisher('standby', begin=5.05, end=end + 0.2)
    found = obeyed([primary, standby], end + 2.0)
    times = [now for now, _ in found if now > 4.9]
    assert max(later - now for now, later in itertools.pairwise(times)) < 0.06
    assert count(found, 'primary', end + 0.3) == pytest.approx(1.7 / CYCLE, abs=1)


OTHER_TORQUES = [TORQUE + 0.2 * LIMIT + 1e-6, -LIMIT, float('nan'), 1e6]


@pytest.mark.parametrize('stall', [0.03, 0.09, 0.3, 0.9])
@pytest.mark.parametrize('torque', [0.0, TORQUE, *OTHER_TORQUES])
def test_who_spoke_beside_the_first_is_not_obeyed_while_it_waits(stall, torque):
    controller = Publisher('controller', pauses=[(5.0, 5.0 + stall)])
    stranger = Publisher('stranger', 0.001, 1.0005, torque=torque)
    found = obeyed([controller, stranger], 8.0)
    assert count(found, 'stranger') == 0
    assert count(found, 'controller') == pytest.approx(2000 - stall / CYCLE, abs=1)


def test_a_standby_whose_primary_spoke_again_is_obeyed_when_that_one_falls_silent_again():
    """Both speak until the primary's next claim."""
    primary = Publisher('primary', pauses=[(5.0, 5.07), (5.2, 5.3), (5.4, 9.0)])
    standby = Publisher('standby', begin=5.05)
    found = obeyed([primary, standby], 6.0)
    assert count(found, 'standby', 5.05, 5.069) == 5
    assert count(found, 'standby', 5.071, 5.2) == 0
    assert count(found, 'standby', 5.24, 5.3) == 15
    assert count(found, 'standby', 5.44, 6.0) == pytest.approx(140, abs=1)


@pytest.mark.parametrize('torque', OTHER_TORQUES)
def test_who_comes_new_is_obeyed_once_the_drive_has_let_go(torque):
    found = obeyed([Publisher('controller', end=5.0),
                    Publisher('new', begin=5.06, torque=torque)], 8.0)
    assert next(now for now, name in found if name == 'new') == pytest.approx(
        5.0 + TIMEOUT, abs=2.0 * CYCLE)


def test_who_has_taken_over_may_ask_for_any_torque():
    watch = watching()
    obeyed([Publisher('primary')], 5.0, watch)
    for index in range(50):
        now = 5.05 + CYCLE * index
        torque = TORQUE if index == 0 else LIMIT if index % 2 else -LIMIT
        assert watch.obeys(now, torque, b'standby')


def test_a_standby_is_obeyed_when_it_takes_over_and_has_its_place_then():
    primary = Publisher('primary', end=5.0)
    standby = Publisher('standby', begin=5.05)
    stranger = Publisher('stranger', 0.02, 7.0)
    found = obeyed([primary, standby, stranger], 10.0)
    assert next(now for now, who in found if who == 'standby') == 5.05
    assert count(found, 'stranger') == 0
    assert count(found, 'standby') == pytest.approx(4.95 / CYCLE, abs=1)


@pytest.mark.parametrize('begin', [0.001, 1.0005, 28.0])
def test_a_standby_keeps_its_place_beside_a_stranger_when_the_primary_is_gone(begin):
    primary = Publisher('primary', end=30.0)
    standby = Publisher('standby', begin=30.05)
    stranger = Publisher('stranger', 0.001, begin, torque=-LIMIT)
    found = obeyed([primary, standby, stranger], 45.0)
    assert count(found, 'stranger') == 0
    assert count(found, 'standby') == pytest.approx(14.95 / CYCLE, abs=1)


@pytest.mark.parametrize('period', [0.05, 0.1, 0.5])
def test_a_slow_one_that_was_left_over_does_not_keep_a_controller_out(period):
    left_over = Publisher('left over', period)
    controller = Publisher('controller', begin=30.0)
    found = obeyed([left_over, controller], 60.0)
    assert count(found, 'left over', 40.0) == 0
    assert count(found, 'controller', 40.0) == 5000


def test_messages_that_are_lost_make_nobody_a_stranger():
    controller = Publisher('controller')
    found = obeyed([controller], 10.0, lost=lambda index: index % 7 in (1, 2, 3))
    assert count(found, 'controller') == sum(index % 7 not in (1, 2, 3) for index in range(2500))


def test_after_forgetting_whoever_speaks_next_is_obeyed():
    watch = watching()
    obeyed([Publisher('controller')], 2.0, watch)
    assert not watch.obeys(2.0, TORQUE, b'new')
    watch.forget()
    assert watch.obeys(2.0, TORQUE, b'new')


def test_a_controller_that_starts_anew_is_obeyed():
    for pause in (0.05, 0.5, 20.0):
        found = obeyed([Publisher('old', end=5.0), Publisher('new', begin=5.0 + pause)],
                       10.0 + pause)
        assert count(found, 'new') == pytest.approx(1250, abs=1)


def test_where_publishers_are_not_known_all_are_obeyed():
    watch = watching()
    assert all(watch.obeys(0.001 * index, TORQUE, None) for index in range(100))


def test_many_publishers_do_not_fill_the_memory():
    watch = watching()
    controller = Publisher('controller')
    crowd = [Publisher(f'stranger {index}', 1.0, 2.0 + 0.0101 * index)
             for index in range(200)]
    found = obeyed([controller, *crowd], 10.0, watch)
    assert {who for _, who in found} == {'controller'}
    assert len(watch._publishers) <= 8


def test_a_standby_knows_its_primary_from_a_stranger():
    watch = FirstPublisher()
    heard = [name for now, name, _ in sorted([
        *Publisher('primary', end=5.0).messages(8.0),
        *Publisher('stranger', 0.001, 1.0).messages(8.0)])
        if watch.is_first(now, name.encode()) and now < 5.9]
    assert set(heard) == {'primary'}
    assert len(heard) == 1250
