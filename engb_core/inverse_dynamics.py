"""The effort that a recorded motion needs: equation (1) solved for the motor.

Stage by stage over the whole motion, each effect in its own compiled loop; only where one effect
acts at several stages with a state of its own do the stages alternate sample by sample.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from engb_core.compiled import FUNCTIONS, INTEGERS, kernel, MATRIX, ROW, types
from engb_core.effects.base import (
    ACCELERATION,
    COULOMB,
    DIRECTION,
    EFFORT,
    INERTIA,
    LEVEL,
    LOAD,
    LOAD_GAIN,
    POSITION,
    SAMPLE_SIZE,
    SHIFT,
    TORQUE,
    VELOCITY,
    VISCOUS,
)
from engb_core.model import Model
from engb_core.motion import Motion, motion_of
from engb_core.plant import (
    load_torque,
    N_COULOMB,
    N_DELAY,
    N_INERTIA,
    N_LOAD_GAIN,
    N_SATURATION,
    N_VISCOUS,
    Physics,
    physics_of,
    torque_without_inertia,
)
from engb_core.recording import Recording

__all__ = ['effort_of_motion', 'predict_effort']

Array = NDArray[np.float64]

# The actuation maps are near identity: the fixed point for their inverse converges fast.
_INVERSE_ROUNDS = 6


def _load(nominal, samples, shifted):
    for row in range(samples.shape[0]):
        position = samples[row, POSITION]
        if shifted:
            position += samples[row, SHIFT]
        samples[row, LOAD] = load_torque(nominal, position)
        samples[row, INERTIA] = nominal[N_INERTIA]
        samples[row, VISCOUS] = nominal[N_VISCOUS]
        samples[row, COULOMB] = nominal[N_COULOMB]
        samples[row, LOAD_GAIN] = nominal[N_LOAD_GAIN]


def _friction(nominal, samples):
    for row in range(samples.shape[0]):
        samples[row, DIRECTION] = min(1.0, max(-1.0, samples[row, VELOCITY]
                                               / nominal[N_SATURATION]))
        samples[row, LEVEL] = nominal[N_COULOMB] + nominal[N_LOAD_GAIN] * abs(samples[row, LOAD])


def _sum(nominal, cogging, samples, effort):
    for row in range(samples.shape[0]):
        total = (nominal[N_INERTIA] * samples[row, ACCELERATION]
                 + nominal[N_VISCOUS] * samples[row, VELOCITY] + samples[row, LOAD]
                 + samples[row, LEVEL] * samples[row, DIRECTION])
        for index in range(cogging.shape[0]):
            total += cogging[index, 1] * math.sin(cogging[index, 0] * samples[row, POSITION]
                                                  + cogging[index, 2])
        effort[row] = total


def _interleaved(nominal, cogging, functions, bounds, owner, parameters, state, samples, effort):
    sample = np.zeros(SAMPLE_SIZE)
    for row in range(samples.shape[0]):
        sample[:] = samples[row]
        effort[row] = nominal[N_INERTIA] * sample[ACCELERATION] + torque_without_inertia(
            nominal, cogging, functions, bounds, owner, parameters, state, sample)
        samples[row] = sample


_load_kernel = kernel(types.void(ROW, MATRIX, types.boolean))(_load)
_friction_kernel = kernel(types.void(ROW, MATRIX))(_friction)
_sum_kernel = kernel(types.void(ROW, MATRIX, MATRIX, ROW))(_sum)
_interleaved_kernel = kernel(types.void(ROW, MATRIX, FUNCTIONS, INTEGERS, INTEGERS, MATRIX,
                                        MATRIX, MATRIX, ROW))(_interleaved)


def effort_of_motion(samples: Array, step: float, physics: Physics) -> Array:
    """Return the effort (n,) [N·m] that a motion needs.

    Args:
        samples: (n, SAMPLE_SIZE) from `Motion.samples`; the columns of the stages are filled in.
        step: [s] between samples.
        physics: model and effects.
    """
    effort = np.empty(samples.shape[0])
    state = physics.fresh_state()
    if physics.interleaved:
        _interleaved_kernel(physics.nominal, physics.cogging, physics.functions, physics.bounds,
                            physics.owner, physics.parameters, state, samples, effort)
    else:
        _by_stages(samples, physics, state, effort)
    if physics.stages['actuation']:
        effort = _inverse_actuation(samples, physics, state, effort)
    if physics.time_constant != 0.0:
        effort += physics.time_constant * np.gradient(effort, step)
    delay = physics.delay + physics.nominal[N_DELAY]
    if delay != 0.0:
        grid = np.arange(effort.size)
        effort = np.interp(grid + delay / step, grid, effort)
    return effort


def _by_stages(samples: Array, physics: Physics, state: Array, effort: Array) -> None:
    def run(stage: str, place: int) -> None:
        for function, effect in physics.stages[stage]:
            function.loop(physics.parameters[effect], state[effect], samples, place)

    run('shift', SHIFT)
    _load_kernel(physics.nominal, samples, bool(physics.stages['shift']))
    run('load', LOAD)
    _friction_kernel(physics.nominal, samples)
    run('level', LEVEL)
    run('direction', DIRECTION)
    _sum_kernel(physics.nominal, physics.cogging, samples, effort)
    for function, effect in physics.stages['torque']:
        function.loop(physics.parameters[effect], state[effect], samples, TORQUE)
        effort += samples[:, TORQUE]


def _inverse_actuation(samples: Array, physics: Physics, state: Array, torque: Array) -> Array:
    effort = torque.copy()
    for _ in range(_INVERSE_ROUNDS):
        samples[:, EFFORT] = effort
        for function, effect in physics.stages['actuation']:
            function.loop(physics.parameters[effect], state[effect], samples, EFFORT)
        change = torque - samples[:, EFFORT]
        if not np.isfinite(change).all():
            return torque
        effort += change
        if np.max(np.abs(change)) < 1e-6 * np.max(np.abs(torque)):
            break
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
