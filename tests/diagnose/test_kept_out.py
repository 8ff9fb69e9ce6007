# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What is kept out of every fit holds what the rest holds."""

import numpy as np
import pytest

from engb_core.diagnose.kept_out import kept_out

TIME = np.arange(0.0, 24.8, 0.01)


@pytest.mark.parametrize('place', range(4))
def test_a_fifth_is_kept_out_in_four_stretches(place):
    out = kept_out(TIME, float(TIME[-1]), place)
    assert out.mean() == pytest.approx(0.2, abs=0.01)
    assert np.count_nonzero(np.diff(np.concatenate([[0], out.astype(int), [0]])) == 1) in (3, 4)


def test_a_motion_that_is_repeated_is_kept_out_in_different_parts():
    """At equal distances the stretches held the same fifth of each of four strokes."""
    period = TIME[-1] / 4.0
    phase = (20.0 * (TIME % period) / period).astype(int)
    out = kept_out(TIME, float(TIME[-1]), 0)
    assert np.unique(phase[out]).size > 12


def test_recordings_that_are_alike_are_kept_out_in_different_parts():
    one, other = (kept_out(TIME, float(TIME[-1]), place) for place in (0, 1))
    assert np.mean(one & other) < 0.1
