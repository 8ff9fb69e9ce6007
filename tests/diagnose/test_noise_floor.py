# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A noise floor that is told lies below the error beside it, and near the noise there is."""

from dataclasses import replace

import numpy as np

from engb_core.diagnose.evidence import quality_of_fit
from engb_core.diagnose.problem import problem_of
from engb_core.model import Cogging, Friction, LoadTorque, Model
from tests.core.bench import Bench, strokes

MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6)),
              friction=Friction(0.012, 0.11, 0.03))
TEETH = (Cogging(9.0, 0.02, 0.0),)


def test_a_cogging_torque_is_no_noise():
    """Without rests the noise is looked for above the compared band, where cogging is, too."""
    recording = Bench(noise=1e-3, further=lambda position, velocity: 0.02 * np.sin(
        9.0 * position)).run(strokes(dwell=0.0))
    corrected = replace(MODEL, cogging=TEETH)
    problem = problem_of([recording], MODEL)
    (found,) = quality_of_fit(problem, corrected, {})
    (run,) = problem.runs
    there_is = 1e-3 * run.comparison.noise_gain_whole
    assert there_is < np.sqrt(np.mean(run.noise[~run.fitted] ** 2)) < 1.5 * there_is
    assert there_is < found.noise_floor <= found.rms_after < found.rms_before
