# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The effort that a recorded motion needs: equation (1) solved for the motor.

Sample by sample through all stages, by the same `torque_without_inertia` that the simulation
runs.
"""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

from engb_core.effects.base import (
    ACCELERATION,
    EFFORT,
    POSITION,
    STAGES,
    TORQUE,
    VELOCITY,
)
from engb_core.physics.compiled import (
    call_effect,
    compiled,
    EffectFunction,
    kernel,
    row_of,
)
from engb_core.physics.nominal_torque import N_DELAY
from engb_core.physics.plant import Physics
from engb_core.physics.walk import Walk

__all__ = ['effort_of_motion', 'measured']

Array = NDArray[np.float64]
Places = NDArray[np.int64]

# The actuation maps rise: their inverse by secants converges fast.
_INVERSE_ROUNDS = 6
# Part of the largest torque that need not be found.
_NEAR = 1e-6
# Torque per effort that a step towards the effort believes in.
_LEAST_SLOPE, _MOST_SLOPE = 0.1, 3.0
_ACTUATION = STAGES.index('actuation')


@kernel
def _later(values: Array, samples: float, out: Array) -> None:
    """Write into `out` the values `samples` later, straight between them, held at both ends."""
    last = values.size - 1
    for row in range(values.size):
        place = min(max(row + samples, 0.0), float(last))
        whole = min(int(place), last - 1)
        out[row] = values[whole] + (place - whole) * (values[whole + 1] - values[whole])


@kernel
def _warped(values: Array, late: Array, out: Array) -> None:
    """Write into `out` the function that `late` (n,) samples earlier has the values; instants that
    would pass one another come at once."""
    place = 0
    instant = -late[0]
    following = max(instant, 1.0 - late[min(1, values.size - 1)])
    for row in range(values.size):
        while following < row and place < values.size - 2:
            place += 1
            instant = following
            following = max(instant, place + 1 - late[place + 1])
        way = following - instant
        along = (row - instant) / way if way > 1e-9 else 1.0
        along = min(max(along, 0.0), 1.0)
        out[row] = values[place] + along * (values[place + 1] - values[place])


@kernel
def _held(values: Array, moving: NDArray[np.bool_], most: int) -> None:
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
                     moving: NDArray[np.bool_] | None = None, walk: Walk | None = None,
                     taps: Array | None = None) -> Array:
    """Return the effort (n,) [N·m] that a motion needs.

    Args:
        samples: (n, SAMPLE_SIZE) from `Motion.samples`; the columns of the stages are filled in.
        step: [s] between samples.
        physics: model and effects.
        moving: (n,) where the motion tells the torque (None: everywhere). Where torque comes late,
            effort before a stop is that of an instant when the shaft stands already, and friction
            takes up what it likes: so long it is taken to go on as it was.
        walk: the last one of these samples (None: nothing is known of them).
        taps: (k,) of the low-pass of what the motion tells of the torque (None: all of it). Where
            torque is not in proportion to effort, the noise of the rest would not average out.
    """
    state = physics.fresh_state()
    if physics.corrections:
        samples, walk = _corrected(samples, step, physics), None
    walk = Walk() if walk is None else walk
    effort = walk.torques_of(physics, state, samples)
    if physics.stages['actuation']:
        effort = _inverse_actuation(samples, physics, state, effort, walk, taps)
    for function, effect in physics.warps:
        effort = _undelayed(samples, step, physics.parameters[effect], state[effect], function,
                            effort, moving)
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
    return measured(samples, physics, state, effort) if physics.stages['measurement'] else effort


def measured(samples: Array, physics: Physics, state: Array, effort: Array) -> Array:
    """Return what is recorded of a true effort (n,) [N·m], by the stage of measurement; `samples`
    (n, SAMPLE_SIZE) hold the times, and the efforts afterwards."""
    samples[:, EFFORT] = effort
    for function, effect in physics.stages['measurement']:
        function.loop(physics.parameters[effect], state[effect], samples, EFFORT)
    return samples[:, EFFORT].copy()


def _corrected(samples: Array, step: float, physics: Physics) -> Array:
    """Return the samples of the true motion, as far as this grid tells what the sensor's error
    does; where there is a recording, position_error.py knows better."""
    effort_of_motion(samples, step, replace(physics, corrections=()))
    state = physics.fresh_state()
    moved = samples.copy()
    for function, effect, late in physics.corrections:
        function.loop(physics.parameters[effect], state[effect], samples, TORQUE)
        error = samples[:, TORQUE].copy()
        if late:
            error *= samples[:, VELOCITY]
        rate = np.gradient(error, step)
        for column, values in ((POSITION, error), (VELOCITY, rate),
                               (ACCELERATION, np.gradient(rate, step))):
            moved[:, column] += values
    return moved


def _undelayed(samples: Array, step: float, parameters: Array, state: Array,
               function: EffectFunction, torque: Array,
               moving: NDArray[np.bool_] | None) -> Array:
    """Return the effort (n,) whose torque comes late by what `function` says at each sample."""
    if torque.size < 3:
        return torque
    samples[:, EFFORT] = torque
    function.loop(parameters, state, samples, TORQUE)
    late = np.ascontiguousarray(samples[:, TORQUE]) / step
    if not np.isfinite(late).all():
        return torque
    if moving is not None:
        _held(torque, moving, int(min(np.ceil(np.abs(late).max()), torque.size)) + 1)
    effort = np.empty_like(torque)
    _warped(torque, late, effort)
    return effort


def _inverse_actuation(samples: Array, physics: Physics, state: Array, torque: Array,
                       walk: Walk, taps: Array | None) -> Array:
    if physics.proportional:
        samples[:, EFFORT] = 1.0
        gain = np.ones_like(torque)
        for place in range(len(physics.stages['actuation'])):
            gain = gain * walk.values_of('actuation', place, physics, state, samples)
        if gain.min() >= _LEAST_SLOPE and gain.max() <= _MOST_SLOPE:
            return torque / gain
    if taps is None:
        return _searched(samples, physics, state, torque)
    slow: Array = convolve1d(torque, taps, mode='nearest')
    effort = _searched(samples, physics, state, slow)
    # The noise of the rest averages out where its effort goes with it alone.
    largest = float(np.max(np.abs(effort), initial=0.0))
    return effort + (torque - slow) / _mean_slope(samples, physics, largest)


def _searched(samples: Array, physics: Physics, state: Array, torque: Array) -> Array:
    """Return the effort (n,) that gives the torque (n,), found by secants; `samples` hold it."""
    effort = torque.copy()
    slope = np.ones_like(torque)
    before, step = np.zeros_like(torque), np.zeros_like(torque)
    largest = float(np.max(np.abs(torque), initial=0.0))
    fresh, near = state.copy(), -1.0
    for _ in range(_INVERSE_ROUNDS):
        change = _towards(physics.functions, physics.bounds, physics.owner, physics.parameters,
                          state, samples, torque, 1e-9 * largest, near, effort, before, step,
                          slope)
        if not math.isfinite(change):
            return torque
        if change < _NEAR * largest:
            break
        if np.array_equal(state, fresh):
            # What remembers nothing need not be asked again where it is right.
            near = _NEAR * largest
    return effort


def _mean_slope(samples: Array, physics: Physics, largest: float) -> Array:
    """Return the torque per effort (n,) [-] of each sample, in the mean over efforts of up to
    `largest` [N·m] either way: what does not depend on the effort itself."""
    if largest == 0.0:
        return np.ones(samples.shape[0])
    down, up = np.empty((2, samples.shape[0]))
    for effort, torque in ((-largest, down), (largest, up)):
        _actuated(physics.functions, physics.bounds, physics.owner, physics.parameters,
                  physics.fresh_state(), samples, effort, torque)
    return np.clip((up - down) / (2.0 * largest), _LEAST_SLOPE, _MOST_SLOPE)


@compiled
def _torque_of(functions: object, bounds: Places, owner: Places, parameters: Array, state: Array,
               sample: Array, effort: float) -> float:
    """Return the torque [N·m] that an effort gives, by the stage of actuation."""
    sample[EFFORT] = effort
    for index in range(bounds[_ACTUATION], bounds[_ACTUATION + 1]):
        sample[EFFORT] = call_effect(functions, index, parameters, owner[index], state, sample)
    torque: float = sample[EFFORT]
    return torque


@kernel
def _actuated(functions: object, bounds: Places, owner: Places, parameters: Array, state: Array,
              samples: Array, effort: float, torque: Array) -> None:
    """Write the torque (n,) that an effort gives at each sample [N·m]."""
    for row in range(samples.shape[0]):
        sample = row_of(samples, row)
        torque[row] = _torque_of(functions, bounds, owner, parameters, state, sample, effort)


@kernel
def _towards(functions: object, bounds: Places, owner: Places, parameters: Array, state: Array,
             samples: Array, torque: Array, tiny: float, near: float, effort: Array,
             before: Array, step: Array, slope: Array) -> float:
    """Move the effort (n,) by a secant step towards what gives the torque (n,), but where no more
    than `near` was missing; return how much was at most [N·m], nan where it is no number.

    Where a motor saturates, plain steps would be many. `before`, `step` and `slope` (n,) are what
    was missing before, the last step, and torque per effort.
    """
    most = 0.0
    for row in range(samples.shape[0]):
        if abs(before[row]) < near:
            continue
        sample = row_of(samples, row)
        change = torque[row] - _torque_of(functions, bounds, owner, parameters, state, sample,
                                          effort[row])
        if not math.isfinite(change):
            return math.nan
        if abs(step[row]) > tiny:
            slope[row] = (before[row] - change) / step[row]
        slope[row] = min(max(slope[row], _LEAST_SLOPE), _MOST_SLOPE)
        step[row] = change / slope[row]
        effort[row] += step[row]
        before[row] = change
        most = max(most, abs(change))
    return most
