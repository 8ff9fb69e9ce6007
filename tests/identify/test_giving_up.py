# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""An identification is given up between two evaluations, wherever it is."""

import pytest

from engb_core.identify.giving_up import GivenUp, look_whether_to_give_up, may_be_given_up
from engb_core.identify.procedure import identify
from tests.identify.bench import simulate, stroke_reference


@pytest.fixture(scope='module')
def recording():
    return simulate(stroke_reference())


@pytest.fixture(scope='module')
def looks(recording):
    """How often an identification looks whether it is wanted."""
    count = [0]

    def asked():
        count[0] += 1
        return False

    assert identify([recording], give_up=asked).model
    return count[0]


@pytest.mark.parametrize('part', [0.0, 0.3, 0.6, 0.99])
def test_it_ends_at_the_next_look(recording, looks, part):
    assert looks > 100
    left = [round(part * looks)]

    def asked():
        assert left[0] >= 0, 'it went on'
        left[0] -= 1
        return left[0] < 0

    with pytest.raises(GivenUp):
        identify([recording], give_up=asked)


def test_who_is_not_asked_goes_on():
    look_whether_to_give_up()
    with may_be_given_up(lambda: True), pytest.raises(GivenUp):
        look_whether_to_give_up()
    look_whether_to_give_up()   # what was told holds within alone
    with may_be_given_up(None):
        look_whether_to_give_up()
