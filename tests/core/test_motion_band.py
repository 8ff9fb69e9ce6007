# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How far up coarse position counts tell the torque of a motion."""

import numpy as np
import pytest

from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.model import Model
from engb_core.prediction import predict_effort
from engb_core.recording import Recording
from engb_core.signals.motion_band import COMPARED, told_up_to

# A pendulum on a geared drive: as light as it is, coarse counts make more torque than it needs.
INERTIA, LOAD = 0.18, 3.5
COARSE, FINE, STEP = 2.9e-3, 1e-7, 0.004
MODEL = Model.from_mapping({
    'format': 'engb-model/1',
    'motor': {'torque_constant': 0.5, 'inertia': INERTIA, 'viscous_friction': 0.02},
    'load_torque': {'form': 'sinusoid', 'amplitude': LOAD, 'phase': 0.0},
    'friction': {'coulomb': 0.15, 'load_gain': 0.0, 'saturation_velocity': 0.1}})


def _swing(quantum: float, seed: int = 1, noise: float = 0.02) -> Recording:
    """Return 16 s of a swing of two frequencies, in counts of `quantum` [rad]."""
    time = np.arange(0.0, 16.0, STEP)
    waves = ((1.2, 2.0 * np.pi * 0.4, 0.0), (0.3, 2.0 * np.pi * 1.1, 0.5))
    position, velocity, acceleration = (
        sum(size * rate ** order * np.sin(rate * time + phase + 0.5 * np.pi * order)
            for size, rate, phase in waves) for order in range(3))
    effort = (INERTIA * acceleration + 0.02 * velocity + LOAD * np.sin(position)
              + 0.15 * np.clip(velocity / 0.1, -1.0, 1.0))
    effort += noise * np.random.default_rng(seed).normal(size=time.size)
    return Recording(name='swing', time=time, effort=effort,
                     position=np.round(position / quantum) * quantum)


def test_coarse_counts_tell_torque_at_low_frequencies_only():
    assert 2.0 < told_up_to(_swing(COARSE), INERTIA) < COMPARED
    assert told_up_to(_swing(FINE), INERTIA) > COMPARED
    assert told_up_to(_swing(COARSE), INERTIA / 1000.0) > COMPARED


def test_a_quieter_effort_brings_the_band_down():
    loud, quiet = (told_up_to(_swing(COARSE, noise=noise), INERTIA) for noise in (1.0, 0.02))
    assert quiet < loud


def test_a_shaft_that_never_moves_has_no_counts():
    still = Recording(name='still', time=np.arange(0.0, 4.0, STEP), position=np.zeros(1000),
                      effort=np.random.default_rng(1).normal(size=1000))
    assert told_up_to(still, INERTIA) == np.inf


@pytest.mark.parametrize('quantum, coarse', [(COARSE, True), (FINE, False)])
def test_the_problem_is_put_in_the_band_that_the_counts_tell(quantum, coarse):
    problem = problem_of([_swing(quantum)], MODEL)
    assert problem.coarse is coarse
    assert (problem.runs[0].motion.bandwidth < COMPARED) is coarse


def test_inertia_is_found_in_spite_of_coarse_counts():
    """At 60 Hz the counts' noise was weighed as if it told of inertia."""
    fitter = Fitter(problem_of([_swing(COARSE)], MODEL))
    fit = fitter.base()
    assert fit.hypothesis.corrected(fit.vector).motor.inertia == pytest.approx(INERTIA, rel=0.03)


def test_a_prediction_is_not_drowned_by_coarse_counts():
    """As sharp as samples of fine counts tell it, the motion needed 8 N·m that nobody measured."""
    recording = _swing(COARSE)
    error = recording.effort - predict_effort(recording, MODEL)
    assert np.std(error[50:-50]) < 0.1
