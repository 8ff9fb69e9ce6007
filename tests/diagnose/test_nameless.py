# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What has no name stays in the model only if it carries over to another kind of motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from engb_core.diagnose.full_bandwidth import CorrectedModels
from engb_core.diagnose.nameless import that_carries
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.unknown.flexible import best_table
from engb_core.diagnose.unknown.openset import Explanation
from engb_core.model import Friction, LoadTorque, Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.physics.sample_table import sample_table
from engb_core.recording import Recording

STEP = 2e-3
MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4)),
              friction=Friction(0.012, 0.1, 0.3))


def changing_pace(time: np.ndarray) -> np.ndarray:
    """Strokes per radian of phase that go faster and slower all the time, (n,) [rad/s]."""
    return 1.5 + 1.2 * np.sin(0.31 * time)


def slow_then_fast(time: np.ndarray) -> np.ndarray:
    """Two thirds so slow that inertia is no part of the effort, the rest fast, (n,) [rad/s]."""
    return np.where(time < 20.0, 0.1, 4.0)


def kept_of(extra, truth: Model = MODEL, pace=changing_pace, noise: float = 1e-3,
            ) -> tuple[int, int]:
    """Return how many models were told of a brake with an extra torque, and how many carry."""
    time = np.arange(0.0, 30.0, STEP)
    phase = np.cumsum(pace(time)) * STEP
    position = 12.0 + (6.0 + 4.0 * np.sin(0.173 * time)) * np.sin(phase)
    velocity = np.gradient(position, STEP)
    samples = sample_table(STEP, time, position, velocity, np.gradient(velocity, STEP))
    effort = effort_of_motion(samples, STEP, physics_of(truth))
    effort += np.random.default_rng(4).normal(0.0, noise, time.size)
    recording = Recording('run', time, position, effort + extra(time, position, velocity))
    fitter = Fitter(problem_of([recording], MODEL), 1)
    base = fitter.finish(fitter.refine(fitter.base()))
    table = best_table(fitter, base)
    explanation = Explanation(base, table)
    told = CorrectedModels(explanation, explanation.models(), fitter.problem, explanation.fit)
    return len(told.models), len(that_carries(fitter, fitter.nominal(), told).models)


def test_right_numbers_carry_over():
    truth = replace(MODEL, motor=replace(MODEL.motor, viscous_friction=2e-3))
    told, kept = kept_of(lambda time, position, velocity: 0.0, truth)
    assert kept == told >= 1


def test_a_wrong_inertia_carries_over_though_slow_motion_does_not_tell_it():
    truth = replace(MODEL, motor=replace(MODEL.motor, inertia=1.6 * MODEL.motor.inertia))
    told, kept = kept_of(lambda time, position, velocity: 0.0, truth, slow_then_fast, 3e-3)
    assert kept == told >= 1


def test_a_table_of_what_lies_on_the_stroke_carries_over():
    told, kept = kept_of(lambda time, position, velocity: 0.02 * np.exp(
        -0.5 * ((position - 14.0) / 0.8) ** 2))
    assert told == 2
    assert kept >= 1


def test_numbers_that_follow_what_no_motion_tells_do_not():
    """A slow walk of the torque: any fit takes something of it away, and is wrong elsewhere."""
    walk = np.cumsum(np.random.default_rng(3).normal(0.0, 4e-4, 15000))
    told, kept = kept_of(lambda time, position, velocity: walk - walk.mean())
    assert told >= 1
    assert kept == 0
