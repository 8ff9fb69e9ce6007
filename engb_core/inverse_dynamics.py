"""The effort that a recorded motion needs: equation (1) solved for the motor.

Sample by sample through all stages, by the same `torque_without_inertia` that the simulation
runs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.compiled import kernel, row_of
from engb_core.effects.base import ACCELERATION, EFFORT
from engb_core.filtering import judgeable, slowest_speed
from engb_core.model import Model
from engb_core.motion import Motion, motion_of
from engb_core.plant import (
    N_DELAY,
    N_INERTIA,
    Physics,
    physics_of,
    torque_without_inertia,
)
from engb_core.recording import Recording

__all__ = ['effort_of_motion', 'predict_effort']

Array = NDArray[np.float64]

# So long before the first count and after the last one the shaft may have moved [s].
BESIDE_A_STOP = 0.02
# The actuation maps are near identity: the fixed point for their inverse converges fast.
_INVERSE_ROUNDS = 6


@kernel
def _needed(nominal, cogging, functions, bounds, owner, parameters, state, samples, effort):
    for row in range(samples.shape[0]):
        sample = row_of(samples, row)
        effort[row] = nominal[N_INERTIA] * sample[ACCELERATION] + torque_without_inertia(
            nominal, cogging, functions, bounds, owner, parameters, state, sample)


@kernel
def _later(values, samples, out):
    """Write into `out` the values `samples` later, straight between them, held at both ends."""
    last = values.size - 1
    for row in range(values.size):
        place = min(max(row + samples, 0.0), float(last))
        whole = min(int(place), last - 1)
        out[row] = values[whole] + (place - whole) * (values[whole + 1] - values[whole])


def effort_of_motion(samples: Array, step: float, physics: Physics) -> Array:
    """Return the effort (n,) [N·m] that a motion needs.

    Args:
        samples: (n, SAMPLE_SIZE) from `Motion.samples`; the columns of the stages are filled in.
        step: [s] between samples.
        physics: model and effects.
    """
    effort = np.empty(samples.shape[0])
    state = physics.fresh_state()
    _needed(physics.nominal, physics.cogging, physics.functions, physics.bounds, physics.owner,
            physics.parameters, state, samples, effort)
    if physics.stages['actuation']:
        effort = _inverse_actuation(samples, physics, state, effort)
    if physics.time_constant != 0.0:
        effort += physics.time_constant * np.gradient(effort, step)
    delay = physics.delay + physics.nominal[N_DELAY]
    if delay != 0.0 and effort.size > 1:
        prompt, effort = effort, np.empty_like(effort)
        _later(prompt, delay / step, effort)
    return effort


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
    speed = float(np.quantile(np.abs(motion.velocity), 0.995))
    slowest = slowest_speed([motion], model.friction.saturation_velocity, speed)
    effort = _beside_stops(effort, judgeable(motion, slowest), motion.step)
    return np.interp(recording.time, motion.time, effort)


def _beside_stops(effort: Array, judgeable: NDArray[np.bool_], step: float) -> Array:
    """Return the effort with the moments beside a stop taken from the motion next to them.

    An encoder tells of a start only with the first count, and derivatives are smoothed over it;
    friction is there at once.
    """
    moving = np.flatnonzero(judgeable)
    if moving.size == 0:
        return effort
    place = np.arange(effort.size)
    after = np.clip(np.searchsorted(moving, place), 0, moving.size - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(np.abs(moving[after] - place) <= np.abs(moving[before] - place),
                       moving[after], moving[before])
    beside = np.abs(nearest - place) * step <= BESIDE_A_STOP
    return np.where(beside, effort[nearest], effort)


def _with_phases_found(motion: Motion, model: Model) -> Model:
    from engb_core.diagnose.phases import find_phases

    return find_phases(motion, model)
