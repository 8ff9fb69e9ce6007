# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""P and the contact, stroke by stroke, on the test bench."""

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.identify.causal_observer import drive_velocity
from engb_core.identify.online import StrokeTracker
from engb_core.model import Model

from .bench import simulate, stroke_reference

LOAD = (0.0, 3e-3, 2e-4, 2e-6)


def updates(tracker, recording, begin=0.0):
    velocity = drive_velocity(recording, recording.time)
    rows = zip((recording.time + begin).tolist(), recording.position.tolist(), velocity.tolist(),
               recording.effort.tolist(), strict=True)
    return [found for row in rows if (found := tracker.step(*row)) is not None]


def test_gain_and_shift_are_told_once_the_curve_is_learnt():
    tracker = StrokeTracker(Model(), learn=2)
    truth = {'contact': 3.0, 'load': LOAD}
    learning = simulate(stroke_reference(count=2), truth, seed=1)
    assert not updates(tracker, learning)
    worn = truth | {'contact': 4.0, 'load': tuple(0.6 * value for value in LOAD)}
    found = updates(tracker, simulate(stroke_reference(count=3), worn, seed=2),
                    learning.time[-1] + 0.001)
    assert len(found) >= 2
    for entry in found:
        assert entry.gain == pytest.approx(0.6, abs=0.06)
        assert entry.shift == pytest.approx(1.0, abs=0.4)
        assert entry.gain_std > 0.0
        assert entry.rms < 2e-3
    assert np.all(np.diff([entry.time for entry in found]) > 1.0)


def test_samples_that_are_no_samples_are_left_out():
    tracker = StrokeTracker(Model())
    assert tracker.step(0.0, float('nan'), 0.0, 0.0) is None
    assert tracker.step(1.0, 0.0, 0.0, 0.0) is None
    assert tracker.step(0.5, 1.0, 0.0, 0.0) is None


@pytest.mark.parametrize('options', [{'learn': 0}, {'excursion': 0.0}])
def test_bad_arguments_are_refused(options):
    with pytest.raises(InputError, match=next(iter(options))):
        StrokeTracker(Model(), **options)
