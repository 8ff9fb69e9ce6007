"""The effort that a recorded motion needs: equation (1) solved for the motor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.compiled import FUNCTIONS, INTEGERS, kernel, MATRIX, ROW, types
from engb_core.effects.base import ACCELERATION, EFFORT, SAMPLE_SIZE
from engb_core.model import Model
from engb_core.motion import Motion, motion_of
from engb_core.plant import N_DELAY, N_INERTIA, Physics, physics_of, torque_without_inertia
from engb_core.recording import Recording

__all__ = ['effort_of_motion', 'predict_effort']

Array = NDArray[np.float64]


def _run(nominal, cogging, functions, bounds, owner, parameters, state, samples, effort):
    sample = np.zeros(SAMPLE_SIZE)
    known = samples.shape[1]
    for row in range(samples.shape[0]):
        for column in range(known):
            sample[column] = samples[row, column]
        torque = torque_without_inertia(nominal, cogging, functions, bounds, owner, parameters,
                                        state, sample)
        torque += nominal[N_INERTIA] * sample[ACCELERATION]
        value = torque
        if bounds[6] > bounds[5]:
            # Effort that gives this torque: the actuation maps are near identity, so the
            # fixed point converges in a few rounds.
            for _ in range(6):
                given = value
                for index in range(bounds[5], bounds[6]):
                    sample[EFFORT] = given
                    given = functions[index](parameters[owner[index]], state[owner[index]],
                                             sample)
                value += torque - given
        effort[row] = value


_kernel = kernel(types.void(ROW, MATRIX, FUNCTIONS, INTEGERS, INTEGERS, MATRIX, MATRIX, MATRIX,
                            ROW))(_run)


def effort_of_motion(samples: Array, step: float, physics: Physics) -> Array:
    """Return the effort (n,) [N·m] that a motion needs.

    Args:
        samples: (n, 8) from `Motion.samples`.
        step: [s] between samples.
        physics: model and effects.
    """
    effort = np.empty(samples.shape[0])
    _kernel(physics.nominal, physics.cogging, physics.functions, physics.bounds, physics.owner,
            physics.parameters, physics.fresh_state(), samples, effort)
    if physics.time_constant != 0.0:
        effort += physics.time_constant * np.gradient(effort, step)
    delay = physics.delay + physics.nominal[N_DELAY]
    if delay != 0.0:
        grid = np.arange(effort.size)
        effort = np.interp(grid + delay / step, grid, effort)
    return effort


def predict_effort(recording: Recording, model: Model) -> Array:
    """Return the effort (n,) [N·m] that the model says the recorded motion needs.

    Phases that no recording carries over to the next (the disc's, for runout) are first found
    in this recording; see `diagnose.phases`.
    """
    motion = motion_of(recording)
    model = _with_phases_found(motion, model)
    effort = effort_of_motion(motion.samples(), motion.step, physics_of(model))
    return np.interp(recording.time, motion.time, effort)


def _with_phases_found(motion: Motion, model: Model) -> Model:
    from engb_core.diagnose.phases import find_phases

    return find_phases(motion, model)
