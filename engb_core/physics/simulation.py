# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The brake run forward in time: alone (`BrakePlant`) or in its recorded loop.

Friction's direction is solved for implicitly in each step, which is stable for any saturation
velocity and holds the shaft still where friction exceeds what drives it (the stick of (13)).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from engb_core.effects.base import (
    ACCELERATION,
    DIRECTION,
    DISC_ANGLE,
    DISC_SPEED,
    EFFORT,
    INERTIA,
    LEVEL,
    LOAD,
    PAD_TEMPERATURE,
    POSITION,
    REFERENCE,
    SAMPLE_SIZE,
    TIME,
    TIME_STEP,
    VELOCITY,
)
from engb_core.errors import InputError
from engb_core.model import Controller, Model
from engb_core.physics.compiled import call_effect, compiled, kernel, Numbers
from engb_core.physics.dry_friction import friction_gain
from engb_core.physics.nominal_torque import (
    N_COULOMB,
    N_INERTIA,
    N_LOAD_CURVATURE,
    N_LOAD_GAIN,
    N_REFERENCE_LOAD,
    N_SATURATION,
    N_VISCOUS,
)
from engb_core.physics.plant import (
    cogging_wave,
    friction_direction,
    load_torque,
    physics_of,
    torque_without_inertia,
)
from engb_core.recording import Recording

__all__ = ['BrakePlant', 'INNER_STEP', 'LOOP_SIZE', 'acted_reference', 'advance_steps',
           'loop_effort', 'loop_of', 'recorded_effort', 'seen_position', 'simulate_closed_loop']

Array = NDArray[np.float64]
Places = NDArray[np.int64]

INNER_STEP = 5e-5
# Cycles of the loop in one run, a day at 1 kHz, and inner steps, seven hours of them.
MOST_CYCLES, MOST_STEPS = 1e8, 5e8
# Cycles that are computed at a time: a long run takes no more memory than its recording.
_BLOCK = 1 << 16


@compiled
def advance_steps(nominal: Numbers, cogging: Array, functions: object, bounds: Places,
                  owner: Places, parameters: Array, state: Array, sample: Numbers,
                  effort: float, steps: int) -> None:
    """Advance inner steps with the measured effort held; the sample carries the motion."""
    if bounds[6] == 0:
        _advance_nominal(nominal, cogging, sample, effort, steps)
        return
    step = sample[TIME_STEP]
    saturation = nominal[N_SATURATION]
    for _ in range(steps):
        torque = effort
        for index in range(bounds[5], bounds[6]):
            sample[EFFORT] = torque
            torque = call_effect(functions, index, parameters, owner[index], state, sample)
        rest = torque_without_inertia(nominal, cogging, functions, bounds, owner, parameters,
                                      state, sample)
        inertia = sample[INERTIA]
        velocity = sample[VELOCITY]
        if bounds[4] > bounds[3]:
            fresh = velocity + step * (torque - rest) / inertia
        else:
            level = sample[LEVEL]
            drive = torque - (rest - level * sample[DIRECTION])
            fresh = _after_friction(velocity, step, inertia, saturation, drive, level)
        sample[ACCELERATION] = (fresh - velocity) / step
        sample[POSITION] += step * 0.5 * (velocity + fresh)
        sample[VELOCITY] = fresh
        sample[DISC_ANGLE] += step * sample[DISC_SPEED]
        sample[TIME] += step


@compiled
def _after_friction(velocity: float, step: float, inertia: float, saturation: float, drive: float,
                    level: float) -> float:
    """Return the velocity after a step under `drive` and friction of `level`, both [N·m]."""
    fresh = (velocity + step * drive / inertia) / (1.0 + step * level / (inertia * saturation))
    if fresh > saturation:
        fresh = max(saturation, velocity + step * (drive - level) / inertia)
    elif fresh < -saturation:
        fresh = min(-saturation, velocity + step * (drive + level) / inertia)
    return fresh


@compiled
def _advance_nominal(nominal: Numbers, cogging: Array, sample: Numbers, effort: float,
                     steps: int) -> None:
    """Do what `advance_steps` does where no effect acts, number for number, with the motion held
    in the processor's registers: six times as fast."""
    step = sample[TIME_STEP]
    inertia = nominal[N_INERTIA]
    viscous = nominal[N_VISCOUS]
    coulomb = nominal[N_COULOMB]
    load_gain = nominal[N_LOAD_GAIN]
    curvature = nominal[N_LOAD_CURVATURE]
    reference = nominal[N_REFERENCE_LOAD]
    saturation = nominal[N_SATURATION]
    position = sample[POSITION]
    velocity = sample[VELOCITY]
    time = sample[TIME]
    disc_angle = sample[DISC_ANGLE]
    before = velocity
    load = level = direction = 0.0
    for _ in range(steps):
        load = load_torque(nominal, position)
        direction = friction_direction(velocity, saturation)
        level = coulomb + friction_gain(load_gain, curvature, reference, load) * abs(load)
        rest = viscous * velocity + load + level * direction
        for index in range(cogging.shape[0]):
            rest += cogging_wave(cogging[index, 0], cogging[index, 1], cogging[index, 2],
                                 position)
        before = velocity
        velocity = _after_friction(velocity, step, inertia, saturation,
                                   effort - (rest - level * direction), level)
        position += step * 0.5 * (before + velocity)
        disc_angle += step * sample[DISC_SPEED]
        time += step
    sample[POSITION] = position
    sample[VELOCITY] = velocity
    sample[ACCELERATION] = (velocity - before) / step
    sample[DISC_ANGLE] = disc_angle
    sample[TIME] = time
    sample[LOAD] = load
    sample[LEVEL] = level
    sample[DIRECTION] = direction


# What a loop is told and keeps, an array of LOOP_SIZE: its gains, its effort limit, its cycle [s],
# and the integral part of its effort [N·m].
_PROPORTIONAL, _INTEGRAL, _DERIVATIVE, _LIMIT, _CYCLE, _INTEGRATED = range(6)
LOOP_SIZE = 6


@compiled
def acted_reference(functions: object, bounds: Places, owner: Places, parameters: Array,
                    state: Array, sample: Numbers, reference: float, cycle: float) -> float:
    """Return the set-point on which the drive acts, in a loop that runs every `cycle` [s]."""
    inner = sample[TIME_STEP]
    sample[TIME_STEP] = cycle
    sample[REFERENCE] = reference
    for index in range(bounds[6], bounds[7]):
        sample[REFERENCE] = call_effect(functions, index, parameters, owner[index], state, sample)
    sample[TIME_STEP] = inner
    return sample[REFERENCE]


@compiled
def _as_told(functions: object, owner: Places, parameters: Array, state: Array, sample: Numbers,
             place: int, value: float, begin: int, end: int, duration: float) -> float:
    """Return what the functions from `begin` to `end` make of a value that stands at `place` of
    the sample, `duration` [s] after they were last asked; the sample stays as it is."""
    inner = sample[TIME_STEP]
    before = sample[place]
    sample[TIME_STEP] = duration
    sample[place] = value
    for index in range(begin, end):
        sample[place] = call_effect(functions, index, parameters, owner[index], state, sample)
    told = sample[place]
    sample[place] = before
    sample[TIME_STEP] = inner
    return told


@compiled
def recorded_effort(functions: object, bounds: Places, owner: Places, parameters: Array,
                    state: Array, sample: Numbers, effort: float, duration: float) -> float:
    """Return what is recorded of an effort [N·m] that was held for `duration` [s]."""
    return _as_told(functions, owner, parameters, state, sample, EFFORT, effort, bounds[7],
                    bounds[8], duration)


@compiled
def seen_position(functions: object, bounds: Places, owner: Places, parameters: Array,
                  state: Array, sample: Numbers, duration: float) -> float:
    """Return the position [rad] that the sensor says, `duration` [s] after it was last asked."""
    return _as_told(functions, owner, parameters, state, sample, POSITION, sample[POSITION],
                    bounds[8], bounds[9], duration)


@compiled
def loop_effort(functions: object, bounds: Places, owner: Places, parameters: Array, state: Array,
                sample: Numbers, loop: Numbers, reference: float, speed: float,
                feedforward: float) -> float:
    """Return the effort [N·m] that the loop asks for in its next cycle, to be held over it."""
    set_point = reference
    set_speed = speed
    if bounds[7] > bounds[6]:
        # Between cycles the sample holds by how much the set-point runs behind.
        before = sample[REFERENCE]
        set_point = acted_reference(functions, bounds, owner, parameters, state, sample,
                                    reference, loop[_CYCLE])
        sample[REFERENCE] = reference - set_point
        set_speed -= (sample[REFERENCE] - before) / loop[_CYCLE]
    error = set_point - sample[POSITION]
    rate = set_speed - sample[VELOCITY]
    wanted = (feedforward + loop[_PROPORTIONAL] * error + loop[_DERIVATIVE] * rate
              + loop[_INTEGRATED])
    effort = min(loop[_LIMIT], max(-loop[_LIMIT], wanted))
    # Conditional integration: a loop at its limit does not wind up.
    if effort == wanted or (wanted - effort) * error < 0.0:
        loop[_INTEGRATED] += loop[_INTEGRAL] * error * loop[_CYCLE]
    return effort


@kernel
def _run_loop(nominal: Array, cogging: Array, functions: object, bounds: Places, owner: Places,
              parameters: Array, state: Array, sample: Array, loop: Array, ticks: Array,
              steps: int, out: Array) -> None:
    for row in range(ticks.shape[0]):
        sample[DISC_SPEED] = ticks[row, 3]
        sample[PAD_TEMPERATURE] = ticks[row, 4]
        position = sample[POSITION]
        velocity = sample[VELOCITY]
        if bounds[9] > bounds[8]:
            # The loop knows no more of the motion than the sensor says.
            seen = seen_position(functions, bounds, owner, parameters, state, sample,
                                 loop[_CYCLE])
            sample[POSITION] = seen
            if row > 0:
                sample[VELOCITY] = (seen - out[row - 1, 0]) / loop[_CYCLE]
        effort = loop_effort(functions, bounds, owner, parameters, state, sample, loop,
                             ticks[row, 0], ticks[row, 1], ticks[row, 2])
        out[row, 0] = sample[POSITION]
        out[row, 1] = sample[VELOCITY]
        sample[POSITION] = position
        sample[VELOCITY] = velocity
        advance_steps(nominal, cogging, functions, bounds, owner, parameters, state, sample,
                      effort, steps)


def loop_of(controller: Controller) -> Array:
    """Return a controller as the loop's numbers (LOOP_SIZE,), before its first cycle."""
    return np.array([controller.proportional, controller.integral, controller.derivative,
                     min(controller.effort_limit, 1e300), 1.0 / controller.rate, 0.0])


def _inner_steps(duration: float, step: float) -> tuple[int, float]:
    """Return how many inner steps of at most `step` [s] make a duration, and how long one is."""
    steps = max(1, math.ceil(duration / step - 1e-9))
    inner = duration / steps
    # A difference of times is a step but for its last digits, which impacts would magnify.
    return steps, step if abs(inner - step) < 1e-9 * step else inner


class BrakePlant:
    """The simulated brake with all effects of its model.

    Args:
        model: numbers and effects.
        step: inner step [s]; halved as needed to divide a call's duration.
        position: where the motor stands at the start [rad].

    Raises:
        InputError: an unknown effect or parameter.
    """

    def __init__(self, model: Model, *, step: float = INNER_STEP, position: float = 0.0) -> None:
        if not (math.isfinite(step) and 0.0 < step <= 0.01):
            raise InputError(f'plant step is {step}; it must lie between 0 and 0.01 s')
        self.model = model
        self.step = step
        self._physics = physics_of(model, inverse=False)
        self._state = self._physics.fresh_state()
        self._sample = np.zeros(SAMPLE_SIZE)
        self._sample[POSITION] = position
        self._sample[PAD_TEMPERATURE] = 20.0

    def advance(self, torque: float, duration: float, disc_speed: float = 0.0,
                pad_temperature: float = 20.0) -> None:
        """Run on for `duration` [s] with the measured effort held at `torque` [N·m].

        `disc_speed` [rad/s] and `pad_temperature` [°C] are held too. A torque that is not finite
        counts as zero: a drive would not follow it.
        """
        sample = self._sample
        steps, sample[TIME_STEP] = _inner_steps(duration, self.step)
        sample[DISC_SPEED] = disc_speed
        sample[PAD_TEMPERATURE] = pad_temperature
        physics = self._physics
        advance_steps(physics.nominal, physics.cogging, physics.functions, physics.bounds,
                      physics.owner, physics.parameters, self._state, sample,
                      torque if math.isfinite(torque) else 0.0, steps)

    def measured_effort(self, torque: float, duration: float) -> float:
        """Return the effort [N·m] that is recorded of `torque` after another `duration` [s]."""
        physics = self._physics
        return float(recorded_effort(physics.functions, physics.bounds, physics.owner,
                                     physics.parameters, self._state, self._sample, torque,
                                     duration))

    def measured_position(self, duration: float) -> float:
        """Return the angle [rad] that the sensor says after another `duration` [s]."""
        physics = self._physics
        return float(seen_position(physics.functions, physics.bounds, physics.owner,
                                   physics.parameters, self._state, self._sample, duration))

    @property
    def time(self) -> float:
        """[s] since the start."""
        return float(self._sample[TIME])

    @property
    def position(self) -> float:
        """Motor angle [rad]."""
        return float(self._sample[POSITION])

    @property
    def velocity(self) -> float:
        """Motor speed [rad/s]."""
        return float(self._sample[VELOCITY])

    @property
    def acceleration(self) -> float:
        """Motor acceleration over the last inner step [rad/s²]."""
        return float(self._sample[ACCELERATION])

    @property
    def load_torque(self) -> float:
        """T_L with its effects, at the last step [N·m]."""
        return float(self._sample[LOAD])


def simulate_closed_loop(recording: Recording, model: Model) -> tuple[Array, Array]:
    """Return position (n,) and velocity (n,) of the model in the recorded loop.

    The loop is the model's `controller` on the recorded reference; it starts where the recording
    does. Inner steps are at most 50 µs.

    Raises:
        InputError: the recording has no reference, the model no controller, or its rate is no
            rate for this recording.
    """
    if recording.reference is None:
        raise InputError(f'{recording.name}: no reference recorded; a loop cannot be simulated')
    if model.controller is None:
        raise InputError('the model has no controller; add its gains to simulate the loop')
    controller: Controller = model.controller
    tick = 1.0 / controller.rate
    cycles = controller.rate * recording.time[-1]
    steps, inner = _inner_steps(min(tick, 1e9), INNER_STEP)
    if not 2.0 <= cycles <= min(MOST_CYCLES, MOST_STEPS / steps):
        raise InputError(f'controller.rate of {controller.rate:g} Hz makes {cycles:.3g} cycles in '
                         f'the {recording.time[-1]:.3g} s of {recording.name}, which take too '
                         'long to simulate; check its unit, or give a shorter recording')
    physics = physics_of(model, inverse=False)
    state = physics.fresh_state()
    sample = np.zeros(SAMPLE_SIZE)
    sample[POSITION] = recording.position[0]
    sample[TIME_STEP] = inner
    loop = loop_of(controller)
    size = math.ceil(recording.time[-1] / tick) + 1
    found = np.empty((2, recording.time.size))
    for first in range(0, size, _BLOCK):
        # One cycle beyond the block, which the next one begins with, to interpolate up to.
        time = np.arange(first, min(first + _BLOCK + 1, size)) * tick
        ticks = _ticks(recording, time, tick, (size - 1) * tick)
        out = np.empty((time.size, 2))
        own = min(_BLOCK, size - first)
        _run_loop(physics.nominal, physics.cogging, physics.functions, physics.bounds,
                  physics.owner, physics.parameters, state, sample, loop, ticks[:own], steps,
                  out[:own])
        out[own:] = sample[POSITION], sample[VELOCITY]
        if physics.stages['sensing']:
            out[own:] = out[own - 1, 0] + tick * out[own - 1, 1], out[own - 1, 1]
        rows = slice(*np.searchsorted(recording.time, (time[0], time[-1]), side='left'))
        if first + own >= size:
            rows = slice(rows.start, None)
        for column in range(2):
            found[column, rows] = np.interp(recording.time[rows], time, out[:, column])
    return found[0], found[1]


def _ticks(recording: Recording, time: Array, tick: float, end: float) -> Array:
    """Return what each cycle at `time` (n,) is given (n, 5): the reference's position, velocity
    and effort, the disc's speed and the pad's temperature; cycles lie from 0 to `end` [s]."""
    reference = recording.reference
    assert reference is not None
    ticks = np.zeros((time.size, 5))
    ticks[:, 0] = np.interp(time, reference.time, reference.position)
    if reference.velocity is not None and np.any(reference.velocity):
        ticks[:, 1] = np.interp(time, reference.time, reference.velocity)
    else:
        before, after = np.maximum(time - tick, 0.0), np.minimum(time + tick, end)
        ticks[:, 1] = (np.interp(after, reference.time, reference.position)
                       - np.interp(before, reference.time, reference.position)) / (after - before)
    if reference.effort is not None:
        ticks[:, 2] = np.interp(time, reference.time, reference.effort)
    for column, name, default in ((3, 'disc_speed', 0.0), (4, 'pad_temperature', 20.0)):
        signal = recording.signals.get(name)
        ticks[:, column] = default if signal is None else signal.at(time)
    return ticks
