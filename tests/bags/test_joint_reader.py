# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""One joint out of serialised messages: the same as others' code makes of them, or nothing."""

import math
import random

import pytest
from rosbags.typesys import get_typestore, Stores

from engb_ros.nodes.joint_reader import JointReader
from tests.bags.samples import JOINT_STATE, joint_state

STAMP = 1_767_000_000_250_000_000
SEC, NANOSEC = divmod(STAMP, 1_000_000_000)


def same(read, expected):
    return read == pytest.approx(expected, nan_ok=True)


@pytest.mark.parametrize('names', [('motor',), ('a', 'motor'), ('motor', 'wheel', 'x' * 31)])
@pytest.mark.parametrize('frame', ['', 'w', 'wheel_fl'])
def test_what_others_serialised_is_read(names, frame):
    reader, index = JointReader('motor'), names.index('motor')
    for step in range(3):
        position, velocity, effort = ([step + 10.0 * number + offset
                                       for number in range(len(names))] for offset in (1, 2, 3))
        message = joint_state(STAMP, names, position, velocity, effort, frame)
        assert same(reader.read(message), (SEC, NANOSEC, position[index], velocity[index],
                                           effort[index]))


def test_what_is_not_told_is_nan_and_the_layout_may_change_from_one_to_the_next():
    reader = JointReader('motor')
    nan = math.nan
    for velocity, effort in (((2.0,), (3.0,)), ((), (3.0,)), ((2.0,), ()), ((), ()),
                             ((2.0, 7.0), (3.0, 7.0)), ((2.0,), (3.0,))):
        message = joint_state(STAMP, ('motor',), (1.0,), velocity, effort)
        assert same(reader.read(message), (SEC, NANOSEC, 1.0, velocity[0] if velocity else nan,
                                           effort[0] if effort else nan))


def test_another_joint_of_the_same_length_is_not_taken_for_this_one():
    reader = JointReader('motor')
    assert reader.read(joint_state(STAMP, ('motor',), (1.0,), (2.0,), (3.0,)))
    assert reader.read(joint_state(STAMP, ('rotor',), (1.0,), (2.0,), (3.0,))) is None
    assert reader.read(joint_state(STAMP, ('motor',), (), (2.0,), (3.0,))) is None
    assert reader.read(joint_state(STAMP, (), (1.0,), (2.0,), (3.0,))) is None
    assert reader.read(joint_state(STAMP, ('motor',), (1.0,), (2.0,), (3.0,)))


def test_the_other_byte_order_is_read():
    store = get_typestore(Stores.ROS2_JAZZY)
    message = joint_state(STAMP, ('motor',), (1.0,), (2.0,), (3.0,))
    other = bytes(store.serialize_cdr(store.deserialize_cdr(message, JOINT_STATE), JOINT_STATE,
                                      little_endian=False))
    assert other != message
    reader = JointReader('motor')
    for data in (message, other, message):
        assert same(reader.read(data), (SEC, NANOSEC, 1.0, 2.0, 3.0))


def test_no_damaged_message_raises():
    reader, chance = JointReader('motor'), random.Random(27)
    message = joint_state(STAMP, ('wheel', 'motor'), (1.0, 4.0), (2.0, 5.0), (3.0, 6.0), 'fl')
    assert reader.read(message)
    for length in range(len(message)):
        assert reader.read(message[:length]) is None
    for _ in range(3000):
        spoilt = bytearray(message)
        for _ in range(chance.randint(1, 4)):
            spoilt[chance.randrange(len(spoilt))] = chance.randrange(256)
        read = reader.read(bytes(spoilt))
        assert read is None or len(read) == 5
    assert same(reader.read(message), (SEC, NANOSEC, 4.0, 5.0, 6.0))
