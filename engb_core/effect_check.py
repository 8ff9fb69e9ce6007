# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whether an effect that somebody wrote is fit for the catalogue: each fault in a sentence."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
import math
from pathlib import Path
import re

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d, maximum_filter1d

from engb_core.effects.base import (
    DIRECTION,
    Effect,
    LEVEL,
    LOAD,
    POSITION,
    REFERENCE,
    SAMPLE_SIZE,
    Scene,
    STAGES,
    STATE_SIZE,
    TIME,
    TIME_STEP,
    VELOCITY,
)
from engb_core.effects.catalogue import (
    effect_of_file,
    get_effect,
    registered,
)
from engb_core.errors import InputError, raised_at
from engb_core.model import Controller, EffectSetting, Friction, LoadTorque, Model
from engb_core.physics.command_law import Commanded, CommandLaw
from engb_core.physics.compiled import handles, PARAMETER_SIZE
from engb_core.physics.inverse_dynamics import effort_of_motion, measured
from engb_core.physics.plant import physics_of, setting_values
from engb_core.physics.sample_table import sample_table
from engb_core.physics.simulation import simulate_closed_loop
from engb_core.recording import Recording, Reference, Signal
from engb_core.signals.gaussian import gaussian_kernel

__all__ = ['FLOOR', 'MODEL', 'RATE', 'TICK', 'TOLERANCE', 'compared', 'effort_needed',
           'faults_of_effect', 'refuse_unfit', 'simulated_loop', 'with_effect']

Array = NDArray[np.float64]

RATE, DURATION = 1000.0, 4.0
TICK = 1.0 / RATE
CONTROLLER = Controller(0.3, 1.0, 0.004, 10.0, RATE)
# For effects on the set-point: a law whose effort follows from reference and position alone.
PROPORTIONAL = Controller(0.3, 0.0, 0.0, 10.0, RATE)
MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6), contact_angle=2.0),
              friction=Friction(0.012, 0.11, 0.1), controller=CONTROLLER)
SCENE = Scene(duration=DURATION, largest_effort=0.2, largest_load=0.12, speed=60.0, sampling=TICK,
              position_range=(0.0, 16.0), disc_speed_range=(0.0, 60.0),
              temperature_range=(20.0, 200.0))
# How far simulation and inverse dynamics may differ: part of the effect, and what taking the
# middle of a tick costs with no effect at all [N·m].
TOLERANCE, FLOOR = 0.015, 3e-5
# Samples on which each function is tried, in SI units.
_TRIED = ((0.0, 0.0), (5.0, 30.0), (5.0, -30.0), (12.0, 0.01), (12.0, -0.01))


def faults_of_effect(effect: Effect) -> list[str]:
    """Return what is wrong with an effect, a sentence each; none: it is fit for use.

    Checked are names, units and bounds; that its functions give finite numbers at all starting
    points, in both directions and at rest; that it vanishes where it says so; and that a motion
    simulated with it needs, by the inverse dynamics, the effort it was simulated with.
    """
    faults = [*_words(effect), *_parameters(effect)]
    if faults:
        return faults
    with registered(effect):
        try:
            faults = list(_functions(effect))
            return faults or list(_in_motion(effect))
        except InputError as error:
            return [str(error)]


def refuse_unfit(paths: Iterable[Path]) -> None:
    """Raise InputError, which names the file, where the effect of one can't be computed.

    What a simulated motion shows is left to `faults_of_effect`, which takes seconds.
    """
    for path in paths:
        effect = effect_of_file(path)
        try:
            fault = next(iter([*_words(effect), *_parameters(effect)] or _functions(effect)), None)
        except InputError as error:
            raise InputError(f'{path}: {error}') from error
        if fault is not None:
            raise InputError(f'{path}: {effect.id}: {fault}; mend the file, or take it away')


def _words(effect: Effect) -> Iterator[str]:
    if not re.fullmatch(r'[a-z][a-z0-9_]*', effect.id):
        yield f'id is {effect.id!r}: use small letters, digits and _, such as screw_lead_error'
    for name in ('title', 'equation', 'reference'):
        if not getattr(effect, name).strip():
            yield f'{name} is empty: the report quotes it'
    if not effect.stages:
        yield f'stages is empty: give a function for one of {", ".join(STAGES)}'
    for stage in effect.stages:
        if stage not in STAGES:
            yield f'there is no stage {stage!r}: known are {", ".join(STAGES)}'


def _parameters(effect: Effect) -> Iterator[str]:
    if not effect.parameters:
        yield 'parameters is empty: give the number that sizes the effect first'
    elif effect.parameters[0].none is None and not effect.number_only:
        yield f'{effect.parameters[0].name}: give none=, the value at which the effect vanishes'
    if len(set(effect.names)) < len(effect.names):
        yield 'two parameters or constants have one name'
    for entry in effect.parameters:
        if not entry.unit:
            yield f"{entry.name}: the unit is empty; give SI units, '-' for none"
        if not (math.isfinite(entry.low) and math.isfinite(entry.high) and entry.low < entry.high):
            yield f'{entry.name}: bounds {entry.low:g} to {entry.high:g} are no range'
        if entry.logarithmic and entry.low <= 0.0:
            yield f'{entry.name}: the lower bound of a logarithmic parameter must be above 0'
        if not entry.starts:
            yield f'{entry.name}: give starts=, where a fit begins to look'
        for start in entry.starts:
            if not entry.low <= start <= entry.high:
                yield f'{entry.name}: start {start:g} lies outside its bounds'


def _values(effect: Effect) -> Iterator[dict[str, float]]:
    """Yield the settings with which a fit begins: each start of each parameter once."""
    constants = dict(effect.defaults)
    if effect.set_constants is not None:
        constants |= effect.set_constants(SCENE)
    for variant in effect.variants:
        for turn in range(max(len(entry.starts) for entry in effect.parameters)):
            yield {**{entry.name: entry.starts[turn % len(entry.starts)]
                      for entry in effect.parameters}, **constants, **variant}


def _functions(effect: Effect) -> Iterator[str]:
    for values in _values(effect):
        row = np.zeros(PARAMETER_SIZE)
        given = setting_values(effect, EffectSetting(effect.id, dict(values)))
        row[:len(given)] = given
        for stage, function in effect.stages.items():
            for position, velocity in _TRIED:
                sample = np.zeros(SAMPLE_SIZE)
                sample[[TIME_STEP, POSITION, VELOCITY]] = TICK, position, velocity
                sample[[LOAD, LEVEL]] = 0.01 * position, 0.02
                sample[DIRECTION] = np.sign(velocity)
                try:
                    result = function.definition(row, np.zeros(STATE_SIZE), sample)
                except (ArithmeticError, ValueError):
                    result = math.nan
                except Exception as error:
                    # Somebody else's code may raise anything.
                    yield f'{stage} cannot be computed: {raised_at(error)}'
                    return
                if not math.isfinite(result):
                    yield (f'{stage} gives {result} at {velocity:g} rad/s with '
                           f'{_shown(effect, values)}')
        try:
            words = effect.statement(values)
        except Exception as error:
            yield f'statement gives no sentence: {raised_at(error)}'
            return
        if not (isinstance(words, str) and words.strip()):
            yield 'statement gives no sentence'
    for stage, function in effect.stages.items():
        try:
            handles([function])
        except Exception as error:
            # The compiler's own message has dozens of lines, the first of which say what it is.
            said = ' '.join(str(error).split())[:300]
            yield (f'{stage} cannot be compiled: use numbers, arrays and functions of math only '
                   f'({said})')


def _in_motion(effect: Effect) -> Iterator[str]:
    """Yield what a simulated motion shows: whether it is one definition, and does anything."""
    largest = 0.0
    angle = _strokes()
    plain, _ = simulated_loop(MODEL, angle)
    for values in _values(effect):
        samples, effort = simulated_loop(with_effect(effect, values), angle)
        if not np.isfinite(samples).all():
            yield f'the simulation ran away with {_shown(effect, values)}'
            continue
        size = _size(effort_needed(samples, MODEL) - effort, samples)
        off = _size(effort_needed(samples, with_effect(effect, values)) - effort, samples)
        largest = max(largest, size)
        if off > TOLERANCE * size + FLOOR:
            yield (f'simulation and inverse dynamics differ by {off:.2g} N·m of {size:.2g} with '
                   f'{_shown(effect, values)}: the function must not depend on the size of the '
                   'step')
    if largest < 2.0 * FLOOR:
        yield 'at all of its starts the effect does next to nothing'
    first = effect.parameters[0]
    if first.none is not None:
        # An effect that contains another one vanishes with both.
        sizes = {entry.name: entry.none for name in (effect.id, *effect.contains)
                 for entry in get_effect(name).parameters
                 if entry.none is not None and entry.name in effect.names}
        nothing = {**next(_values(effect)), **sizes}
        left = float(np.max(np.abs(effort_needed(plain, with_effect(effect, nothing))
                                   - effort_needed(plain, MODEL))))
        if not left < 1e-9:
            yield f'with {first.name} = {first.none:g} it should vanish, and is {left:.2g} N·m'


def with_effect(effect: Effect, values: dict[str, float]) -> Model:
    """Return `MODEL` with one effect, its parameters and constants at these values."""
    return replace(MODEL, effects=(EffectSetting(effect.id, dict(values)),),
                   controller=PROPORTIONAL if 'command' in effect.stages else CONTROLLER)


def simulated_loop(model: Model, angle: Array) -> tuple[Array, Array]:
    """Return a closed loop's samples (n - 1, SAMPLE_SIZE), and the effort (n - 1,) [N·m] that it
    held.

    A sample is the middle of a tick, over which effort and acceleration are constant and mean;
    its reference is that of the tick's begin. The effort is what the feedback asks for by the
    reference as it is given, whatever set-point the drive acts on, as it is then measured.

    Args:
        model: the simulated machine, with its feedback.
        angle: (n,) what is tracked [rad], at `RATE`.
    """
    time = np.arange(angle.size, dtype=np.float64) * TICK
    speed = np.gradient(angle, TICK)
    push = np.gradient(speed, TICK) * MODEL.motor.inertia + speed * MODEL.motor.viscous_friction
    disc: Array = 40.0 * np.clip(2.0 * time, 0.0, 1.0)
    warmth: Array = 20.0 + 40.0 * time
    position, velocity = simulate_closed_loop(Recording(
        'loop', time, angle.copy(), np.zeros(time.size),
        reference=Reference(time, angle, speed, push),
        signals={'disc_speed': Signal(time, disc), 'pad_temperature': Signal(time, warmth)}),
        model)
    error = angle - position
    gains = model.controller or CONTROLLER
    integral = np.concatenate([[0.0], np.cumsum(gains.integral * error * TICK)[:-1]])
    effort = (push + gains.proportional * error + integral
              + gains.derivative * (speed - velocity))
    middle = time[:-1] + 0.5 * TICK
    middle[0] = 0.0     # a start at 0 tells the effects to begin anew
    samples = sample_table(
        TICK, middle, 0.5 * (position[1:] + position[:-1]), 0.5 * (velocity[1:] + velocity[:-1]),
        np.diff(velocity) / TICK, disc[:-1],
        (np.cumsum(disc) * TICK)[:-1] - 0.5 * disc[:-1] * TICK, warmth[:-1])
    samples[:, REFERENCE] = angle[:-1]
    physics = physics_of(model)
    return samples, measured(samples.copy(), physics, physics.fresh_state(), effort[:-1])


def effort_needed(samples: Array, model: Model) -> Array:
    """Return the effort (n,) [N·m] that the motion of samples (n, SAMPLE_SIZE) needs, as the
    model's loop records it."""
    physics = physics_of(model)
    effort = effort_of_motion(samples.copy(), TICK, physics)
    if physics.stages['command'] and model.controller is not None:
        law = CommandLaw(model.controller.proportional, 0.0, -math.inf, math.inf)
        effort += Commanded(law, samples, np.ones(1), samples[:, TIME]).recorded_beyond_acted(
            physics)
    return effort


def compared(values: Array, samples: Array) -> Array:
    """Return `values` (n,) at the moving ones of samples (n, SAMPLE_SIZE), through a 60 Hz
    low-pass."""
    moving = ~maximum_filter1d(np.abs(samples[:, VELOCITY]) < 0.3, 41)
    filtered: Array = convolve1d(values * moving, gaussian_kernel(60.0, TICK))
    judged: Array = filtered[moving]
    return judged


def _strokes() -> Array:
    """Return strokes (n,) of 16 and of 6 rad with a stop after each; the sine's square has no jerk
    at its ends."""
    time = np.arange(round(DURATION * RATE), dtype=np.float64) * TICK
    return (16.0 * np.sin(np.pi * np.clip(time / 1.6, 0.0, 1.0)) ** 2
            + 6.0 * np.sin(np.pi * np.clip((time - 1.9) / 1.8, 0.0, 1.0)) ** 2)


def _size(values: Array, samples: Array) -> float:
    """Return the root mean square of what is compared [N·m]."""
    return float(np.sqrt(np.mean(compared(values, samples) ** 2)))


def _shown(effect: Effect, values: dict[str, float]) -> str:
    return ', '.join(f'{entry.name} = {values[entry.name]:g}' for entry in effect.parameters)
