# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The nominal numbers as fit parameters: how far the model file is trusted for each."""

from __future__ import annotations

from dataclasses import dataclass, replace
import math

from engb_core.effects.base import Scene
from engb_core.effects.contact_shift import EFFECT as CONTACT_SHIFT
from engb_core.effects.load_curve_shape import EFFECT as LOAD_SHAPE
from engb_core.model import EffectSetting, Model
from engb_core.physics.nominal_torque import (
    N_AMPLITUDE,
    N_CONTACT,
    N_COULOMB,
    N_DELAY,
    N_INERTIA,
    N_LOAD_CURVATURE,
    N_LOAD_GAIN,
    N_PHASE,
    N_SATURATION,
    N_TERMS,
    N_VISCOUS,
)

__all__ = ['BELIEVED', 'CURVATURE', 'DELAY', 'Knots', 'LOAD_NUMBERS', 'NominalNumber',
           'SHAPE_NUMBERS', 'first_knot', 'nominal_numbers', 'with_load_shape', 'with_numbers',
           'with_reference_load']

# Effort and position may be sampled up to a sample apart; fitted along, never claimed.
DELAY = 'sampling_delay'
# How friction departs from a straight line over load: no refit of a file knew of it.
CURVATURE = 'load_curvature'
# Deviation to which the logarithm of a number of the file is believed: files are refitted, and
# parts vary.
BELIEVED = 0.4
# What a table adds to the load curve, knot by knot.
SHAPE_NUMBERS = tuple(entry.name for entry in LOAD_SHAPE.parameters)
# Those that make up the load curve.
LOAD_NUMBERS = frozenset({'contact_angle', 'load_amplitude', 'load_phase',
                          *(f'p{power}' for power in range(12)), *SHAPE_NUMBERS})


@dataclass(frozen=True)
class NominalNumber:
    """One nominal number: name, place in the nominal vector, unit, trust and bounds.

    `spread` is the standard deviation of the model file's value (additive; for logarithmic
    numbers of the logarithm): wide, since files are refitted and parts vary, but finite, so that
    numbers which a recording can't determine stay where the file has them. `effect` is the id
    of the file's effect whose parameter at `place` this is ('': a place in the nominal vector).
    """

    name: str
    place: int
    unit: str
    spread: float
    low: float
    high: float
    logarithmic: bool = False
    effect: str = ''


def nominal_numbers(model: Model, scene: Scene) -> tuple[NominalNumber, ...]:
    """Return the numbers that every hypothesis refits."""
    motor, friction, load = model.motor, model.friction, model.load_torque
    effort = max(scene.largest_effort, 1e-9)
    speed = max(scene.speed, 1e-9)
    revolute = model.joint.type == 'revolute'
    torque = 'N·m' if revolute else 'N'
    delay = NominalNumber(DELAY, N_DELAY, 's', 0.5 * scene.sampling, -0.6 * scene.sampling,
                          0.5 * scene.sampling)
    # A command is computed from the very position that is recorded beside it.
    apart = () if scene.commanded else (delay,)
    angle = 'rad' if revolute else 'm'
    numbers = [
        NominalNumber('inertia', N_INERTIA, 'kg·m²' if revolute else 'kg', BELIEVED,
                      motor.inertia * 0.05, motor.inertia * 20.0, True),
        NominalNumber('viscous_friction', N_VISCOUS, f'{torque}·s/{angle}',
                      0.5 * motor.viscous_friction + 0.2 * effort / speed,
                      0.0, 10.0 * motor.viscous_friction + 2.0 * effort / speed),
        NominalNumber('coulomb', N_COULOMB, torque, 0.5 * friction.coulomb + 0.1 * effort,
                      0.0, 5.0 * friction.coulomb + effort),
    ]
    if scene.largest_load > 1e-3 * effort:
        numbers.append(NominalNumber('load_gain', N_LOAD_GAIN, '-', 0.2, 0.0, 3.0))
        if scene.reference_load > 0.0:
            numbers.append(NominalNumber(CURVATURE, N_LOAD_CURVATURE, '-', 0.4, -0.9, 0.9))
    if friction.saturation_velocity > 0.004 * scene.speed:
        # A narrower one acts at speeds that count as standstill: no data could move it.
        numbers.append(NominalNumber(
            'saturation_velocity', N_SATURATION, f'{angle}/s', 0.5,
            friction.saturation_velocity * 0.02, friction.saturation_velocity * 20.0, True))
    shape = _shape_numbers(model, scene, torque)
    numbers += shape
    if load.form == 'sinusoid':
        numbers += [
            NominalNumber('load_amplitude', N_AMPLITUDE, torque,
                          0.3 * abs(load.amplitude) + 0.1 * effort, -10 * effort, 10 * effort),
            NominalNumber('load_phase', N_PHASE, 'rad', 0.2, load.phase - 1.5, load.phase + 1.5),
        ]
        return (*numbers, *apart)
    if load.contact_angle is not None:
        reach = max(abs(value - load.contact_angle) for value in scene.position_range)
        numbers.append(NominalNumber(
            'contact_angle', N_CONTACT, angle, CONTACT_SHIFT.parameters[0].of_stroke * reach,
            load.contact_angle - reach, load.contact_angle + reach))
    else:
        reach = max(abs(value) for value in scene.position_range)
    # Beside a table the polynomial stands as the file has it: both would make up for each other
    # where it was recorded, and run away where it was not.
    used = [] if shape else _used_terms(model)
    for power in used:
        size = max(reach, 1e-9) ** -power * max(scene.largest_load, 0.3 * effort)
        numbers.append(NominalNumber(
            f'p{power}', N_TERMS + 1 + power,
            torque if power == 0 else f'{torque}/{angle}' + ('' if power == 1 else f'^{power}'),
            size, -30.0 * size, 30.0 * size))
    return (*numbers, *apart)


def _shape_numbers(model: Model, scene: Scene, torque: str) -> list[NominalNumber]:
    """Return the knots of the table that the model adds to its load curve, where it has one."""
    if not any(entry.effect == LOAD_SHAPE.id for entry in model.effects):
        return []
    size = max(scene.largest_load, 0.3 * scene.largest_effort, 1e-9)
    first = first_knot(model, scene.position_range)
    return [NominalNumber(name, place, torque, size, -30.0 * size, 30.0 * size,
                          effect=LOAD_SHAPE.id)
            for place, name in enumerate(SHAPE_NUMBERS) if place >= first]


def first_knot(model: Model, position_range: tuple[float, float]) -> int:
    """Return the place of the first knot of a table that may be other than none.

    Where the stroke [rad] begins before the contact nothing is touched there, so that no form of
    the load curve gives a torque: what is the same along the whole stroke is an offset, or
    friction that differs with the direction, and a free knot would take it in.
    """
    contact = model.load_torque.contact_angle
    return 0 if contact is None or contact <= position_range[0] else 1


@dataclass(frozen=True)
class Knots:
    """Where the knots of a table beside the load curve lie: evenly along the stroke, but a part
    of them about one place, within some width of it [rad]."""

    at: float = 0.0
    width: float = 1.0
    part: float = 0.0


def with_load_shape(model: Model, scene: Scene, knots: Knots) -> Model:
    """Return the model with a table beside its load curve that is zero yet, along the stroke that
    was recorded."""
    if any(entry.effect == LOAD_SHAPE.id for entry in model.effects):
        return model
    low, high = scene.position_range
    setting = EffectSetting(LOAD_SHAPE.id, {**dict.fromkeys(SHAPE_NUMBERS, 0.0),
                                            'from': float(low), 'to': float(high),
                                            'dense_at': knots.at, 'dense_width': knots.width,
                                            'dense_part': knots.part})
    # First of all, so that whatever else acts on the load finds the whole curve.
    return replace(model, effects=(setting, *model.effects))


def _used_terms(model: Model) -> list[int]:
    coefficients = model.load_torque.coefficients
    if not any(coefficients):
        return []
    first = 0 if model.load_torque.contact_angle is None else 1
    if coefficients[0] != 0.0:
        first = 0
    return list(range(first, len(coefficients)))


def with_reference_load(model: Model, scene: Scene) -> Model:
    """Return the model with a load about which its friction may be curved."""
    if model.friction.load_curvature:
        return model
    return replace(model, friction=replace(model.friction, reference_load=scene.reference_load))


def with_numbers(model: Model, values: dict[str, float]) -> Model:
    """Return the model with nominal numbers replaced, by the names of `nominal_numbers`."""
    motor = replace(model.motor, **{name: values[name] for name in
                                    ('inertia', 'viscous_friction') if name in values})
    friction = replace(model.friction, **{name: values[name] for name in
                                          ('coulomb', 'load_gain', CURVATURE,
                                           'saturation_velocity')
                                          if name in values})
    if not friction.load_curvature:
        friction = replace(friction, reference_load=0.0)
    load = model.load_torque
    coefficients = list(load.coefficients)
    for name, value in values.items():
        if name[0] == 'p' and name[1:].isdigit():
            coefficients[int(name[1:])] = value
    contact = load.contact_angle
    if contact is not None:
        contact = values.get('contact_angle', contact)
    load = replace(load, coefficients=tuple(coefficients), contact_angle=contact,
                   amplitude=values.get('load_amplitude', load.amplitude),
                   phase=math.remainder(values['load_phase'], 2 * math.pi)
                   if 'load_phase' in values else load.phase)
    effects = tuple(
        replace(entry, parameters={**entry.parameters, **{
            name: values[name] for name in SHAPE_NUMBERS if name in values}})
        if entry.effect == LOAD_SHAPE.id else entry for entry in model.effects)
    return replace(model, motor=motor, friction=friction, load_torque=load, effects=effects)
