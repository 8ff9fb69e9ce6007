# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The load at which friction that is curved over the load is what a straight line says."""

import numpy as np
import pytest

from engb_core.diagnose.problem import problem_of
from engb_core.physics.dry_friction import friction_gain
from engb_core.physics.nominal_torque import nominal_vector
from engb_core.physics.plant import load_torques
from tests.diagnose.simulated_brake import brake_with, lively, NOMINAL


@pytest.mark.parametrize('curvature', [-0.6, 0.5])
def test_curved_friction_is_as_large_on_the_whole_as_the_straight_line(curvature):
    """Whatever the curvature, the gain that is told is that of the mean friction."""
    problem = problem_of([lively(brake_with('torque_offset', offset=0.004))], NOMINAL)
    scene, motion = problem.scene, problem.runs[0].motion
    moving = np.abs(motion.velocity) > 0.02 * motion.speed
    loads = np.abs(load_torques(nominal_vector(NOMINAL), motion.position[moving]))
    gains = np.array([friction_gain(0.07, curvature, scene.reference_load, load)
                      for load in loads])
    assert np.sum(gains * loads) == pytest.approx(0.07 * np.sum(loads), rel=0.02)
    assert 0.3 * scene.largest_load < scene.reference_load < scene.largest_load
