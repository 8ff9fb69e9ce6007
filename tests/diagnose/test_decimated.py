# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a search looks at, with fewer samples."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.decimated import decimated
from engb_core.diagnose.problem import Problem, problem_of
from engb_core.model import EffectSetting, Friction
from engb_core.physics.plant import physics_of

from .simulated_brake import NOMINAL, recorded, strokes_and_waves

SHARP = replace(NOMINAL, friction=Friction(0.012, 0.11, 0.02))


@pytest.fixture(scope='module')
def whole() -> Problem:
    duration = 8.0
    trajectory = strokes_and_waves(3)
    recording = recorded(SHARP, lambda time, _: trajectory.at(time), duration)
    return problem_of([recording], SHARP)


def left(problem, model):
    run, = problem.runs
    return run.measured - run.predicted(physics_of(model))


def test_half_of_the_samples_at_1_khz_and_all_values(whole):
    fewer, = decimated(whole).runs
    run, = whole.runs
    assert fewer.motion.step == pytest.approx(2.0 * run.motion.step)
    assert fewer.motion.time.size == pytest.approx(0.5 * run.motion.time.size, abs=1)
    np.testing.assert_allclose(fewer.time, run.time)
    assert fewer.measured.size == run.measured.size


def test_the_file_is_off_by_as_much_as_with_all_samples(whole):
    np.testing.assert_allclose(left(decimated(whole), SHARP), left(whole, SHARP), atol=1e-12)


@pytest.mark.parametrize('effect, parameters', (
    ('coulomb_friction_error', {'coulomb': 0.03}),
    ('load_hysteresis', {'hysteresis_ratio': 0.05, 'memory_distance': 1.0, 'load_exponent': 1.0}),
    ('drivetrain_resonance', {'inertia_fraction': 0.3, 'frequency': 15.0, 'damping_ratio': 0.03}),
    ('actuation_lag', {'lag': 0.003}),
))
def test_so_is_a_hypothesis_but_for_a_fraction_of_the_noise(whole, effect, parameters):
    model = replace(SHARP, effects=(EffectSetting(effect, parameters),))
    apart = left(decimated(whole), model) - left(whole, model)
    sigma = whole.runs[0].sigma
    assert np.sqrt(np.mean((apart / sigma) ** 2)) < 0.3


def test_slow_recordings_keep_their_samples():
    trajectory = strokes_and_waves(3)
    recording = recorded(SHARP, lambda time, _: trajectory.at(time), 8.0)
    every = np.arange(0, recording.time.size, 5)
    slow = problem_of([_thinned(recording, every)], SHARP)
    assert decimated(slow).runs[0].motion.step == slow.runs[0].motion.step


def _thinned(recording, rows):
    return type(recording).from_samples(recording.name, recording.time[rows],
                                        recording.position[rows], recording.effort[rows])


def test_all_samples_are_kept_where_the_file_knows_no_friction():
    """What fewer samples make of its reversals is not in what the file says; a Coulomb friction
    came out a tenth too small."""
    trajectory = strokes_and_waves(3)
    recording = recorded(SHARP, lambda time, _: trajectory.at(time), 8.0, noise=5e-4)
    none = problem_of([recording], replace(SHARP, friction=Friction(0.0, 0.0, 0.02)))
    assert decimated(none) is none


def test_all_samples_are_kept_where_a_value_had_none_left(whole):
    run, = whole.runs
    grid = run.comparison.grid[20]
    weight = np.zeros_like(run.comparison.weight)
    weight[1::2] = run.comparison.weight[1::2]
    weight[:grid - 200] = run.comparison.weight[:grid - 200]
    odd = replace(run, comparison=replace(run.comparison, weight=weight))
    assert decimated(replace(whole, runs=(odd,))).runs[0] is odd
