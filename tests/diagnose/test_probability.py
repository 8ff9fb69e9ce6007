# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How sure a name is: never surer than that it is one of those that the library knows."""

import pytest

from engb_core.diagnose.probability import causes, something_known
from engb_core.diagnose.problem import problem_of

from .simulated_brake import lively, NOMINAL


def test_a_cause_that_nobody_wrote_down_is_one_more():
    assert something_known(1.0, 0.0, 50.0, 24) == pytest.approx(24.0 / 25.0)
    # The more names, the less it is likely to be none of them.
    assert something_known(1.0, 0.0, 50.0, 49) > something_known(1.0, 0.0, 50.0, 24)


@pytest.mark.parametrize(('adequacy', 'after'), [(1.0, 20.0), (0.7, 5.0), (0.9, 5.0)])
def test_what_is_left_unexplained_speaks_against_a_name(adequacy, after):
    assert something_known(adequacy, after, 50.0, 24) < 24.0 / 25.0
    assert something_known(adequacy, after, 50.0, 24) > something_known(
        adequacy - 0.1, after, 50.0, 24)


def test_causes_are_those_that_a_recording_could_show():
    without_disc = causes(problem_of([lively(NOMINAL)], NOMINAL).scene)
    assert 10 < without_disc < 30
