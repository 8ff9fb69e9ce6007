"""The effort that a recorded motion needs: equation (1) solved for the motor.

Sample by sample through all stages, by the same `torque_without_inertia` that the simulation
runs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.compiled import kernel, row_of
from engb_core.effects.base import ACCELERATION, EFFORT
from engb_core.plant import N_DELAY, N_INERTIA, Physics, torque_without_inertia

__all__ = ['effort_of_motion']

Array = NDArray[np.float64]

# The actuation maps rise: their inverse by secants converges fast.
_INVERSE_ROUNDS = 6
# Torque per effort that a step towards the effort believes in.
_SLOPES = (0.1, 3.0)


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


@kernel
def _held(values, moving, most):
    """Let the first `most` values of each standstill be the last one of the motion before."""
    last, stood = np.nan, 0
    for row in range(values.size):
        if moving[row]:
            last, stood = values[row], 0
        else:
            stood += 1
            if last == last and stood <= most:
                values[row] = last


def effort_of_motion(samples: Array, step: float, physics: Physics,
                     moving: NDArray[np.bool_] | None = None) -> Array:
    """Return the effort (n,) [N·m] that a motion needs.

    Args:
        samples: (n, SAMPLE_SIZE) from `Motion.samples`; the columns of the stages are filled in.
        step: [s] between samples.
        physics: model and effects.
        moving: (n,) where the motion tells the torque (None: everywhere). Where torque comes late,
            effort before a stop is that of an instant when the shaft stands already, and friction
            takes up what it likes: so long it is taken to go on as it was.
    """
    effort = np.empty(samples.shape[0])
    state = physics.fresh_state()
    _needed(physics.nominal, physics.cogging, physics.functions, physics.bounds, physics.owner,
            physics.parameters, state, samples, effort)
    if physics.stages['actuation']:
        effort = _inverse_actuation(samples, physics, state, effort)
    delay = physics.delay + physics.nominal[N_DELAY]
    steady = effort
    if moving is not None:
        # As far as the delay and its interpolation reach; the lag is told by the motion alone.
        if delay > 0.0:
            _held(effort, moving, int(np.ceil(delay / step)) + 1)
        if physics.time_constant > 0.0:
            steady = effort.copy()
            _held(steady, moving, effort.size)
    if physics.time_constant != 0.0:
        effort = effort + physics.time_constant * np.gradient(steady, step)
    if delay != 0.0 and effort.size > 1:
        prompt, effort = effort, np.empty_like(effort)
        _later(prompt, delay / step, effort)
    return effort


def _inverse_actuation(samples: Array, physics: Physics, state: Array, torque: Array) -> Array:
    effort = torque.copy()
    slope = np.ones_like(torque)
    before = step = np.zeros_like(torque)
    tiny = 1e-9 * np.max(np.abs(torque), initial=0.0)
    for _ in range(_INVERSE_ROUNDS):
        samples[:, EFFORT] = effort
        for function, effect in physics.stages['actuation']:
            function.loop(physics.parameters[effect], state[effect], samples, EFFORT)
        change = torque - samples[:, EFFORT]
        if not np.isfinite(change).all():
            return torque
        # Secants: where a motor saturates, plain steps would be many.
        np.divide(before - change, step, out=slope, where=np.abs(step) > tiny)
        np.clip(slope, *_SLOPES, out=slope)
        step = change / slope
        effort += step
        before = change
        if np.max(np.abs(change)) < 1e-6 * np.max(np.abs(torque)):
            break
    return effort
