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


def test_a_file_without_friction_is_told_so_beside_what_remains():
    """Both numbers of friction are missing in the file and its others stand: what little remains
    beside them does not take their names."""
    brake = brake_with('cogging_torque', order=7.0, amplitude=0.002, phase=0.3)
    file = replace(NOMINAL, friction=replace(NOMINAL.friction, coulomb=0.0),
                   motor=replace(NOMINAL.motor, viscous_friction=0.0))
    said = diagnose([lively(brake)], file)
    named = {finding.effect: finding.parameters for finding in said.effects
             if finding.probability > 0.5}
    assert {'coulomb_friction_error', 'viscous_friction_error'} <= named.keys()
    assert named['coulomb_friction_error']['coulomb'].value == pytest.approx(
        NOMINAL.friction.coulomb, rel=0.1)
    assert named['viscous_friction_error']['viscous_friction'].value == pytest.approx(
        NOMINAL.motor.viscous_friction, rel=0.1)
