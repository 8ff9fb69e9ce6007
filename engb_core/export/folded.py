# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Effects that are wrong numbers, put into the numbers: other formats need not know them."""

from __future__ import annotations

from dataclasses import replace

from engb_core.effects.catalogue import get_effect
from engb_core.model import EffectSetting, Model

__all__ = ['folded', 'missing']


def folded(model: Model) -> tuple[Model, tuple[EffectSetting, ...]]:
    """Return the model with its wrong numbers corrected, and the effects that remain.

    The order of effects is kept; what a number does is what its effect does in the torque balance
    (a shift of the contact of a load curve without one stays an effect).
    """
    left: list[EffectSetting] = []
    for entry in model.effects:
        values = {name: value for name, value in entry.parameters.items()
                  if isinstance(value, float)}
        motor, friction, load = model.motor, model.friction, model.load_torque
        if entry.effect == 'inertia_error':
            model = replace(model, motor=replace(motor, inertia=values['inertia']))
        elif entry.effect == 'viscous_friction_error':
            model = replace(model, motor=replace(
                motor, viscous_friction=values['viscous_friction']))
        elif entry.effect == 'coulomb_friction_error':
            model = replace(model, friction=replace(friction, coulomb=values['coulomb']))
        elif entry.effect == 'load_stiffness_error':
            model = replace(model, load_torque=replace(
                load, coefficients=tuple(values['scale'] * one for one in load.coefficients),
                amplitude=values['scale'] * load.amplitude))
        elif entry.effect == 'contact_shift' and load.contact_angle is not None:
            model = replace(model, load_torque=replace(
                load, contact_angle=load.contact_angle + values['shift']))
        elif entry.effect == 'load_dependent_friction':
            model = replace(model, friction=replace(
                friction, load_gain=values['load_gain'],
                load_curvature=values.get('load_curvature', 0.0),
                reference_load=values.get('reference_load', friction.reference_load or 0.2)))
        else:
            left.append(entry)
    return replace(model, effects=()), tuple(left)


def missing(left: tuple[EffectSetting, ...]) -> list[str]:
    """Return a sentence for each effect that a format cannot say."""
    return [f'{get_effect(entry.effect).title} ({entry.effect})'
            + (f': {entry.formula}' if entry.formula else '') for entry in left]
