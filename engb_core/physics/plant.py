# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The brake's torque balance: the one place where nominal terms and effects meet.

Equation (1) with effects, motor side:

    J ω̇ = T_M − B ω − T_L − T_C − T_cog − (added torques),   T_M from the measured effort.

`torque_without_inertia` walks one sample through the stages of effects/base.py. The inverse
dynamics and the simulation both call it, so that a hypothesis is fitted with the very physics
with which it is simulated afterwards.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from engb_core.effects.base import (
    COULOMB,
    DIRECTION,
    Effect,
    INERTIA,
    LEVEL,
    LOAD,
    LOAD_GAIN,
    POSITION,
    SAMPLE_SIZE,
    SATURATION,
    SHIFT,
    STAGES,
    STATE_SIZE,
    TIME_STEP,
    VELOCITY,
    VISCOUS,
)
from engb_core.effects.catalogue import get_effect
from engb_core.errors import InputError, raised_at
from engb_core.model import EffectSetting, Model
from engb_core.physics import nominal_torque
from engb_core.physics.compiled import (
    call_effect,
    compiled,
    EffectFunction,
    handles,
    kernel,
    Numbers,
    PARAMETER_SIZE,
)
from engb_core.physics.dry_friction import friction_gain
from engb_core.physics.nominal_torque import (
    N_COULOMB,
    N_INERTIA,
    N_LOAD_CURVATURE,
    N_LOAD_GAIN,
    N_REFERENCE_LOAD,
    N_SATURATION,
    N_VISCOUS,
    nominal_vector,
)

__all__ = ['Physics', 'effects_of', 'friction_torques', 'load_torque', 'load_torques',
           'nominal_sum', 'physics_of', 'set_friction', 'set_load', 'set_numbers',
           'torque_without_inertia', 'with_values']

Array = NDArray[np.float64]
Places = NDArray[np.int64]

# What an effect may give for a motion of size one, in SI units; beyond it sums overflow.
_LARGEST = 1e100


@dataclass(frozen=True)
class Physics:
    """A model made ready for the kernels.

    Attributes:
        nominal: (NOMINAL_SIZE,) the nominal numbers.
        cogging: (k, 3) order, amplitude, phase of the model's own cogging terms.
        stages: per stage the (function, effect) pairs, for whole motions.
        functions: the k effect functions in order of stage, as kernels take them.
        bounds: (10,) where each stage begins in `functions`; the last entry is their number.
        walked: (10,) the same, but for the stage of torques, which ends where those of `apart`
            begin.
        apart: (function, effect) of effects that only add a torque, or remember nothing: over a
            whole motion the torque may be computed by itself.
        owner: (k,) which effect a function belongs to.
        parameters: (effects, PARAMETER_SIZE) parameters and constants.
        time_shifts: (effect, its row in `parameters`) of those by which torque comes late.
        delay, time_constant: [s] by which torque comes after measured effort, for the inverse
            dynamics to undo.
        warps: (function, its row in `parameters`) of delays that change from sample to sample,
            for the inverse dynamics to undo.
        corrections: (function, its row in `parameters`, whether it is a delay [s]) of what the
            measured position is off by (position_error.py).
        proportional: whether the stage of actuation makes a torque that is proportional to the
            effort.
        shares_state: whether what an effect remembers passes from the torque to a later stage.
        one_by_one: whether a motion may pass the stages up to the torque one after another: no
            effect remembers from one to another, or knows the load of the sample before.
        of_motion: for each row in `parameters`, whether the effect looks at the motion alone.
    """

    nominal: Array
    cogging: Array
    stages: dict[str, list[tuple[EffectFunction, int]]]
    functions: object
    bounds: NDArray[np.int64]
    walked: NDArray[np.int64]
    apart: tuple[tuple[EffectFunction, int], ...]
    owner: NDArray[np.int64]
    parameters: Array
    time_shifts: tuple[tuple[Effect, int], ...]
    delay: float
    time_constant: float
    warps: tuple[tuple[EffectFunction, int], ...] = ()
    corrections: tuple[tuple[EffectFunction, int, bool], ...] = ()
    proportional: bool = False
    shares_state: bool = False
    one_by_one: bool = False
    of_motion: tuple[bool, ...] = ()

    def fresh_state(self) -> Array:
        """Return the effects' states at the start of a run, (effects, STATE_SIZE)."""
        return np.zeros((self.parameters.shape[0], STATE_SIZE))


def setting_values(effect: Effect, setting: EffectSetting) -> list[float]:
    """Return a setting's numbers in the order of `effect.names`.

    Raises:
        InputError: a parameter is missing or unknown.
    """
    known = set(effect.names)
    for name in setting.parameters:
        if name not in known:
            raise InputError(f'effects: {effect.id} has no parameter {name!r}; '
                             f'it has {", ".join(effect.names)}')
    values = []
    for name in effect.names:
        value = setting.parameters.get(name)
        if value is None:
            default = default_value(effect, name)
            if default is None:
                raise InputError(f'effects: {effect.id} needs the parameter {name}')
            value = default
        if isinstance(value, list):
            raise InputError(f'effects: {effect.id}.{name} must be one number')
        values.append(float(value))
    _refuse_impossible(effect, values)
    return values


def _refuse_impossible(effect: Effect, values: list[float]) -> None:
    """Raise InputError for values with which the effect gives no number (a distance of 0, …), or
    one that no machine knows."""
    parameters = np.zeros(PARAMETER_SIZE)
    parameters[:len(values)] = values
    for function in effect.stages.values():
        sample = np.full(SAMPLE_SIZE, 0.5)
        sample[TIME_STEP] = 1e-3
        try:
            # As Python, which refuses to divide by nothing; compiled code gives infinity.
            with np.errstate(all='raise', under='ignore'):
                result = function.definition(parameters, np.zeros(STATE_SIZE), sample)
        except (ArithmeticError, ValueError):
            result = math.nan
        except Exception as error:
            # An effect from outside may raise anything.
            raise InputError(f'effects: {effect.id} cannot be computed: {raised_at(error)}; mend '
                             'its file (engb check-effect FILE)') from error
        if not abs(result) < _LARGEST:
            given = zip(effect.parameters, values, strict=False)
            outside = [f'{entry.name} = {value:g} (within {entry.low:g} and {entry.high:g})'
                       for entry, value in given if not entry.low <= value <= entry.high]
            raise InputError(f'effects: {effect.id} cannot be computed with '
                             f'{", ".join(outside) or "these parameters"}')


def default_value(effect: Effect, name: str) -> float | None:
    """Return what stands for a parameter that a setting leaves out; None where it must be given.

    A shape that the contract does not name may be left out; the sizing parameter may not, unless
    the contract doesn't name it either (a resonance is given by its frequency).
    """
    for index, parameter in enumerate(effect.parameters):
        if parameter.name == name and parameter.default is not None:
            return parameter.default
        if parameter.name == name and index > 0 and parameter.starts:
            return parameter.starts[len(parameter.starts) // 2]
    return effect.defaults.get(name)


def effects_of(model: Model) -> list[tuple[Effect, list[float]]]:
    """Return a model file's own effects with their values in the order of `names`.

    Raises:
        InputError: an unknown effect or parameter.
    """
    settings = [(get_effect(entry.effect), entry) for entry in model.effects]
    return [(effect, setting_values(effect, entry)) if effect.made_of is None
            else effect.made_of(entry) for effect, entry in settings]


def physics_of(model: Model, effects: Iterable[tuple[Effect, Iterable[float]]] | None = None,
               inverse: bool = True) -> Physics:
    """Make a model ready for the kernels.

    Args:
        model: the numbers.
        effects: (effect, values in the order of its `names`); None: those of the model file.
        inverse: for inverse dynamics, where a lag is undone by `delay` and `time_constant`
            rather than run forward in time.

    Raises:
        InputError: an unknown effect or parameter.
    """
    if effects is None:
        effects = effects_of(model)
    chosen = [(effect, list(values)) for effect, values in effects]
    functions: list[EffectFunction] = []
    stages: dict[str, list[tuple[EffectFunction, int]]] = {}
    owner: list[int] = []
    bounds = [0]
    for stage in STAGES:
        stages[stage] = []
        # Those that only add a torque stand last in its stage.
        for index, (effect, _) in sorted(enumerate(chosen), key=lambda entry: _is_apart(
                entry[1][0]) and stage == 'torque'):
            undone = inverse and (effect.correction is not None or stage == 'actuation'
                                  and (effect.time_shift or effect.warp) is not None)
            if stage in effect.stages and not undone:
                functions.append(effect.stages[stage])
                stages[stage].append((effect.stages[stage], index))
                owner.append(index)
        bounds.append(len(functions))
    cogging = np.array([[term.order, term.amplitude, term.phase] for term in model.cogging],
                       float).reshape(-1, 3)
    parameters = np.zeros((max(len(chosen), 1), PARAMETER_SIZE))
    time_shifts = []
    warps: list[tuple[EffectFunction, int]] = []
    corrections: list[tuple[EffectFunction, int, bool]] = []
    for index, (effect, values) in enumerate(chosen):
        parameters[index, :len(values)] = values
        if effect.warp is not None:
            warps.append((effect.warp, index))
        if effect.correction is not None and inverse:
            corrections.append((effect.correction, index, effect.late_position))
        if effect.time_shift is not None:
            time_shifts.append((effect, index))
    apart = tuple((function, index) for function, index in stages['torque']
                  if _is_apart(chosen[index][0]))
    walked = np.array(bounds, np.int64)
    walked[STAGES.index('torque') + 1] -= len(apart)
    proportional = bool(stages['actuation']) and all(
        _is_proportional(*chosen[index]) for _, index in stages['actuation'])
    changing = [index for stage in ('load', 'level', 'direction') for _, index in stages[stage]]
    one_by_one = bool(changing) and not stages['shift'] and len(set(changing)) == len(changing) \
        and len(apart) == len(stages['torque'])
    first = set(owner[:bounds[STAGES.index('actuation')]])
    shares_state = not first.isdisjoint(owner[bounds[STAGES.index('actuation')]:]) \
        or not first.isdisjoint(index for _, index in warps)
    made = Physics(nominal_vector(model), cogging, stages, handles(functions),
                   np.array(bounds, np.int64), walked, apart, np.array(owner, np.int64),
                   parameters, tuple(time_shifts), 0.0, 0.0, tuple(warps),
                   tuple(corrections), proportional, shares_state, one_by_one,
                   tuple(effect.of_motion for effect, _ in chosen))
    return with_values(made, made.nominal, parameters)


def _is_apart(effect: Effect) -> bool:
    """Whether the torque that an effect adds hangs on nothing that the walk of one sample through
    the stages hands over."""
    return tuple(effect.stages) == ('torque',) or effect.memoryless


def _is_proportional(effect: Effect, values: list[float]) -> bool:
    return effect.proportional is not None and effect.proportional(
        dict(zip(effect.names, values, strict=False)))


def with_values(physics: Physics, nominal: Array, parameters: Array) -> Physics:
    """Return the same physics with other numbers, `nominal` and `parameters` as there."""
    delay = time_constant = 0.0
    for effect, index in physics.time_shifts:
        values = parameters[index].tolist()
        assert effect.time_shift is not None, 'time_shifts are of effects that have one'
        later = effect.time_shift(dict(zip(effect.names, values, strict=False)))
        delay, time_constant = delay + later[0], time_constant + later[1]
    return replace(physics, nominal=nominal, parameters=parameters, delay=delay,
                   time_constant=time_constant)


load_torque = compiled(nominal_torque.load_torque)
friction_direction = compiled(nominal_torque.friction_direction)
cogging_wave = compiled(nominal_torque.cogging_wave)


@kernel
def _load_torques(nominal: Array, positions: Array, torques: Array) -> None:
    for row in range(positions.size):
        torques[row] = load_torque(nominal, positions[row])


def load_torques(nominal: Array, positions: ArrayLike) -> Array:
    """Return T_L(θ) of the nominal model [N·m] at many positions [rad], of their shape."""
    places = np.ascontiguousarray(positions, float)
    torques = np.empty(places.size)
    _load_torques(nominal, places.ravel(), torques)
    return torques.reshape(places.shape)


@kernel
def _friction_torques(nominal: Array, loads: Array, velocities: Array, torques: Array) -> None:
    for row in range(loads.size):
        gain = friction_gain(nominal[N_LOAD_GAIN], nominal[N_LOAD_CURVATURE],
                             nominal[N_REFERENCE_LOAD], loads[row])
        torques[row] = (nominal[N_COULOMB] + gain * abs(loads[row])) * friction_direction(
            velocities[row], nominal[N_SATURATION])


def friction_torques(nominal: Array, loads: ArrayLike, velocities: ArrayLike) -> Array:
    """Return T_C of the nominal model [N·m] at load torques [N·m] and velocities [rad/s], of the
    shape that both have together."""
    load, velocity = np.broadcast_arrays(np.asarray(loads, float), np.asarray(velocities, float))
    torques = np.empty(load.size)
    _friction_torques(nominal, load.ravel(), velocity.ravel(), torques)
    return torques.reshape(load.shape)


@compiled
def set_numbers(nominal: Numbers, sample: Numbers) -> None:
    """Write the model's inertia and friction into a sample: what every effect finds."""
    sample[INERTIA] = nominal[N_INERTIA]
    sample[VISCOUS] = nominal[N_VISCOUS]
    sample[COULOMB] = nominal[N_COULOMB]
    sample[SATURATION] = nominal[N_SATURATION]


@compiled
def set_load(nominal: Numbers, sample: Numbers, shift: float) -> None:
    """Write the load torque at the sample's position, `shift` [rad] on, into it."""
    sample[SHIFT] = shift
    sample[LOAD] = load_torque(nominal, sample[POSITION] + shift)


@compiled
def set_friction(nominal: Numbers, sample: Numbers) -> None:
    """Write level and direction of dry friction under the sample's load into it."""
    sample[DIRECTION] = friction_direction(sample[VELOCITY], nominal[N_SATURATION])
    sample[LOAD_GAIN] = friction_gain(nominal[N_LOAD_GAIN], nominal[N_LOAD_CURVATURE],
                                      nominal[N_REFERENCE_LOAD], sample[LOAD])
    sample[LEVEL] = nominal[N_COULOMB] + sample[LOAD_GAIN] * abs(sample[LOAD])


@compiled
def nominal_sum(nominal: Numbers, cogging: Array, sample: Numbers) -> float:
    """Return the torque [N·m] that drag, load, dry friction and cogging of a sample make up."""
    total = (nominal[N_VISCOUS] * sample[VELOCITY] + sample[LOAD]
             + sample[LEVEL] * sample[DIRECTION])
    for index in range(cogging.shape[0]):
        total += cogging_wave(cogging[index, 0], cogging[index, 1], cogging[index, 2],
                              sample[POSITION])
    return total


@compiled
def torque_without_inertia(nominal: Numbers, cogging: Array, functions: object, bounds: Places,
                           owner: Places, parameters: Array, state: Array,
                           sample: Numbers) -> float:
    """Return the torque that the motor must give beside J·ω̇ [N·m]; fills in the sample's stages.

    J is sample[INERTIA] afterwards: an effect may add to the model's.

    `sample` comes with time, motion and disc; VELOCITY decides the nominal direction unless
    sample[DIRECTION] is overridden by an effect of that stage.
    """
    set_numbers(nominal, sample)
    shift = 0.0
    for index in range(bounds[0], bounds[1]):
        shift += call_effect(functions, index, parameters, owner[index], state, sample)
    set_load(nominal, sample, shift)
    for index in range(bounds[1], bounds[2]):
        sample[LOAD] = call_effect(functions, index, parameters, owner[index], state, sample)
    set_friction(nominal, sample)
    for index in range(bounds[2], bounds[3]):
        sample[LEVEL] = call_effect(functions, index, parameters, owner[index], state, sample)
    for index in range(bounds[3], bounds[4]):
        sample[DIRECTION] = call_effect(functions, index, parameters, owner[index], state,
                                        sample)
    total = nominal_sum(nominal, cogging, sample)
    for index in range(bounds[4], bounds[5]):
        total += call_effect(functions, index, parameters, owner[index], state, sample)
    return total
