# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A wrong number that makes up most of a mismatch is told, though something stays unexplained."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from engb_core.diagnose.engine import diagnose

from .simulated_brake import brake_with, lively, NOMINAL

pytestmark = pytest.mark.slow


def test_half_of_the_load_is_named_beside_what_comes_once():
    """Refitted numbers take in a wrong load as a whole, and leave what nobody knows: that this
    stays says nothing against the load."""
    true = lively(brake_with('load_stiffness_error', scale=2.0))
    wander = sosfiltfilt(butter(2, 8.0, fs=1000.0, output='sos'),
                         np.random.default_rng(3).normal(size=true.effort.size))
    disturbed = replace(true, effort=true.effort + 0.002 * wander / wander.std())
    said = diagnose([disturbed], NOMINAL)
    named = {finding.effect: finding for finding in said.effects}
    assert named['load_stiffness_error'].probability > 0.5
    assert named['load_stiffness_error'].parameters['scale'].value == pytest.approx(2.0, rel=0.05)
    assert said.effects[0].effect == 'load_stiffness_error'
