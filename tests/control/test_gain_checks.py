# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What gains can do is known before they are taken into use."""

from dataclasses import replace

import pytest

from control.supervised import GAINS
from engb_core.control.gain_checks import check_holding, holding_torque
from engb_core.errors import InputError

ERROR, LIMIT = 2.0, 0.75


def test_the_feedback_alone_brings_full_torque_as_shipped():
    assert holding_torque(GAINS, ERROR, LIMIT) == (0.75, 0.75)


@pytest.mark.parametrize(('changes', 'told'), [
    ({'p': 0.0, 'error_deadband': 1000.0}, 'p 0 and i 1.5 with error_deadband 1000 would not hold '
     'the brake: an error of 2 rad would bring 0 N·m'),
    ({'p': 0.0}, 'p 0 and i 1.5 would not hold the brake: an error of 2 rad would bring 0.5 N·m'),
    ({'p': 0.0, 'i': 0.0}, 'would bring 0 N·m within a second'),
    ({'p': 0.1, 'error_deadband': 2.5}, 'would bring 0.2 N·m'),
    ({'p': 0.3, 'i': 0.0}, 'would bring 0.6 N·m within a second, and brings '
     '0.75 N·m now; restart'),
    ({'p': 1e-9, 'i': 1e-9}, 'would not hold the brake'),
])
def test_gains_that_hold_no_brake_are_refused_in_one_line(changes, told):
    with pytest.raises(InputError, match=told) as caught:
        check_holding(replace(GAINS, **changes), GAINS, ERROR, LIMIT)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('changes', [
    {'i': 0.0}, {'p': 0.2}, {'p': 5.0}, {'error_deadband': 1000.0}, {'d': 0.0},
    {'p': 0.125, 'error_deadband': 2.0}])
def test_gains_that_hold_it_are_taken(changes):
    check_holding(replace(GAINS, **changes), GAINS, ERROR, LIMIT)


def test_the_integral_part_alone_may_hold_where_its_limits_let_it():
    wide = replace(GAINS, i_clamp_max=0.75, i_clamp_min=-0.75)
    check_holding(replace(wide, p=0.0), wide, ERROR, LIMIT)
    with pytest.raises(InputError, match='would bring 0.5 N'):   # it could not let go
        check_holding(replace(wide, p=0.0, i_clamp_min=-0.5), wide, ERROR, LIMIT)


def test_who_was_started_with_weak_gains_may_keep_them_and_change_them_for_stronger_ones():
    weak = replace(GAINS, p=0.1, i=0.1)
    check_holding(weak, weak, ERROR, LIMIT)
    check_holding(replace(weak, p=0.2), weak, ERROR, LIMIT)
    with pytest.raises(InputError, match='would bring 0.3'):
        check_holding(replace(weak, p=0.05), weak, ERROR, LIMIT)
