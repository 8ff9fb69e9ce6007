# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A recording in which the shaft stands throughout judges nothing, and harms nothing."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.problem import problem_of
from engb_core.errors import InputError
from engb_core.recording import Recording

from .simulated_brake import brake_with, lively, NOMINAL

BRAKE = brake_with('asymmetric_friction', asymmetry=0.4)


def standing(duration: float, like: Recording) -> Recording:
    """Return a shaft that never moves, at the place where another recording begins."""
    time = np.arange(0.0, duration, like.interval)
    noise = np.random.default_rng(5).normal(0.0, 0.005, time.size)
    return Recording.from_samples('still', time, np.full(time.size, like.position[0]), noise)


@pytest.mark.parametrize('duration', [4.0, 60.0])
def test_it_is_left_out_and_told(duration):
    moving = lively(BRAKE)
    found = diagnose([moving, standing(duration, moving)], NOMINAL)
    assert [entry.effect for entry in found.effects][:1] == ['asymmetric_friction']
    assert [(fault.fault, fault.recording) for fault in found.data_faults] == [
        ('no_motion', 'still')]


def test_what_is_held_out_may_stand_as_well():
    moving = lively(BRAKE)
    found = diagnose([moving], NOMINAL, [standing(4.0, moving)])
    assert [entry.effect for entry in found.effects][:1] == ['asymmetric_friction']
    assert 'no_motion' in [fault.fault for fault in found.data_faults]
    assert {quality.recording for quality in found.held_out} == {moving.name}


def test_nothing_but_standing_is_refused():
    still = standing(4.0, lively(NOMINAL))
    with pytest.raises(InputError, match='still: too little motion'):
        problem_of([still, replace(still, name='too')], NOMINAL)
