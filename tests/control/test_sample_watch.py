# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What is missing of a joint's samples is said in words."""

import math

import pytest

from engb_core.control.sample_watch import SampleWatch


def watch(longest=math.inf):
    made = SampleWatch('motor', longest)
    made.reset(10.0)
    return made


def test_silence_is_told_after_a_while():
    made = watch()
    assert made.missing(10.9) == ''
    assert made.missing(11.1) == 'no joint_states come'
    for number in range(3):
        made.take(12.0 + 0.01 * number, 0.01 * number, 1.0, 2.0, 3.0)
    assert made.missing(12.5) == ''
    assert made.missing(13.1) == 'no joint_states come'


@pytest.mark.parametrize(('spacing', 'sample', 'told'), [
    (0.01, (math.nan, 0.0, 0.0), 'no finite position of motor'),
    (0.01, (0.0, 0.0, math.nan), 'no finite effort of motor'),
    (0.01, (math.nan, math.inf, 0.0), 'no finite position and velocity of motor'),
    (0.0, (1.0, 2.0, 3.0), 'do not advance'),
    (0.2, (1.0, 2.0, 3.0), 'do not come every 0.1 s')])
def test_samples_of_no_use_are_told(spacing, sample, told):
    made = watch(longest=0.1)
    for number in range(1, 150):
        assert not made.take(10.0 + 0.01 * number, spacing * number, *sample) or number == 1
    assert told in made.missing(11.5)


def test_another_joint_is_told_once_and_only_where_the_own_one_is_not_there():
    made = watch()
    told = []
    for number in range(300):
        now = 20.0 + 0.01 * number
        told.append(made.other(now, ['wheel', 'lever']))
        made.present(now)
    assert set(told) == {''}
    told = [made.other(23.0 + 0.01 * number, ['wheel']) for number in range(300)]
    words = [words for words in told if words]
    assert len(words) == 1
    assert 'hold wheel' in words[0] and 'motor' in words[0] and 'parameter joint' in words[0]
    assert told.index(words[0]) > 50
    assert 'hold wheel' in made.missing(26.0)
