# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A reference tried on the fitted model: the closed loop's motion, ready to be compared on."""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.experiment.segments import STEP
from engb_core.diagnose.problem import Problem, problem_of
from engb_core.errors import InputError
from engb_core.model import Controller, Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.physics.sample_table import sample_table
from engb_core.physics.simulation import simulate_closed_loop
from engb_core.recording import Recording, Reference, Signal
from engb_core.signals.motion import motion_of

__all__ = ['default_controller', 'rehearsed']

Array = NDArray[np.float64]

# Natural frequency [rad/s] and damping of the loop where the model file names no controller.
LOOP_FREQUENCY = 40.0
LOOP_DAMPING = 0.8


def rehearsed(problem: Problem, model: Model, time: Array, position: Array,
              disc_speed: Array | None = None) -> Problem:
    """Return the problem that a recording of this reference would pose, free of noise.

    Args:
        problem: of the recordings there are: its sampling, counts and drive are kept.
        model: the corrected model that plays the brake.
        time, position: the reference, (n,) [s] and [rad].
        disc_speed: (n,) [rad/s], or None.

    Raises:
        InputError: the loop runs away, or moves too little.
    """
    nominal = replace(model, effects=())
    controller = model.controller or default_controller(problem, model)
    velocity = np.gradient(position, STEP)
    reference = Reference(time, position, velocity,
                          _feedforward(nominal, time, position, velocity))
    step = float(np.median([run.recording.interval for run in problem.runs]))
    grid = (np.arange(int(time[-1] / step) + 1) * step).astype(np.float64)
    signals = {}
    if disc_speed is not None:
        signals['disc_speed'] = Signal(time, disc_speed)
    warm = [run.motion.pad_temperature for run in problem.runs if run.motion.has_temperature]
    if warm:
        middle = float(np.median(np.concatenate(warm)))
        signals['pad_temperature'] = Signal(time[[0, -1]], np.array([middle, middle]))
    blank = Recording('next_experiment', grid, np.full(grid.size, position[0]),
                      np.zeros(grid.size), reference=reference, signals=signals)
    moved, _ = simulate_closed_loop(blank, replace(model, controller=controller))
    width = float(np.ptp(position))
    if not (np.isfinite(moved).all() and np.max(np.abs(moved - position[0])) < 3.0 * width):
        raise InputError('the simulated loop runs away from the reference')
    quantum = max(run.motion.quantum for run in problem.runs)
    if quantum > 0.0:
        moved = np.round(moved / quantum) * quantum
    motion = motion_of(replace(blank, position=moved))
    effort = effort_of_motion(motion.samples(), motion.step, physics_of(model))
    return problem_of([replace(blank, position=moved,
                               effort=np.interp(grid, motion.time, effort))], problem.model)


def default_controller(problem: Problem, model: Model) -> Controller:
    """Return a PID for a model file without one, by its inertia: 6 Hz, well damped."""
    inertia = model.motor.inertia
    proportional = inertia * LOOP_FREQUENCY ** 2
    return Controller(
        proportional=proportional, integral=2.0 * proportional,
        derivative=max(2.0 * LOOP_DAMPING * LOOP_FREQUENCY * inertia
                       - model.motor.viscous_friction, 0.0),
        effort_limit=1.2 * problem.scene.largest_effort,
        rate=min(1000.0, 1.0 / problem.scene.sampling) if math.isfinite(problem.scene.sampling)
        and problem.scene.sampling > 0.0 else 1000.0)


def _feedforward(nominal: Model, time: Array, position: Array, velocity: Array) -> Array:
    samples = sample_table(STEP, time, position, velocity, np.gradient(velocity, STEP))
    return effort_of_motion(samples, STEP, physics_of(nominal, ()))
