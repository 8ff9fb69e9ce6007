# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A model as Modelica text: the nominal torque balance, with the effects that are one formula."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import re

from engb_core.export.folded import folded, missing
from engb_core.model import EffectSetting, Model

__all__ = ['modelica']

_Changes = dict[str, list[str]]
_UNITS = {'position': 'rad', 'velocity': 'rad/s', 'torque': 'N.m', 'inertia': 'kg.m2',
          'viscous': 'N.m.s/rad'}
_LINEAR = {'position': 'm', 'velocity': 'm/s', 'torque': 'N', 'inertia': 'kg',
           'viscous': 'N.s/m'}


def modelica(model: Model, name: str = 'EngbModel') -> tuple[str, tuple[str, ...]]:
    """Return the model as Modelica 3 text, and what is not in it, a line each.

    `effort` is an input, `position` and `velocity` are outputs; no library is needed. What needs a
    memory or samples (a gap, hysteresis, a delay, a law) is not in it: tools for Modelica take
    the FMU as well.
    """
    model, left = folded(model)
    changes: _Changes = {'effort': [], 'level': [], 'torque': []}
    parameters: list[tuple[str, float, str]] = []
    remaining: list[EffectSetting] = []
    for entry in left:
        made = _FORMULAS.get(entry.effect)
        if made is None or any(one.effect == entry.effect for one in remaining):
            remaining.append(entry)
            continue
        stage, formula, names = made(entry)
        for key, value in names.items():
            parameters.append((f'{entry.effect}_{key}', value, ''))
            formula = re.sub(rf'\b{key}\b', f'{entry.effect}_{key}', formula)
        changes[stage].append(formula)
    lacks = missing(tuple(remaining))
    return _text(model, name, changes, parameters, lacks), tuple(lacks)


def _values(entry: EffectSetting, *names: str) -> dict[str, float]:
    from engb_core.effects.catalogue import get_effect
    from engb_core.physics.plant import setting_values
    effect = get_effect(entry.effect)
    known = dict(zip(effect.names, setting_values(effect, entry), strict=True))
    return {name: known[name] for name in names}


def _offset(entry: EffectSetting) -> tuple[str, str, dict[str, float]]:
    return 'effort', '- offset', _values(entry, 'offset')


def _stribeck(entry: EffectSetting) -> tuple[str, str, dict[str, float]]:
    return 'level', ('* (1 + (breakaway_ratio - 1) * exp(-(abs(velocity) / stribeck_velocity)'
                     '^shape))'), _values(entry, 'breakaway_ratio', 'stribeck_velocity', 'shape')


def _drag(entry: EffectSetting) -> tuple[str, str, dict[str, float]]:
    if _values(entry, 'levels_off')['levels_off'] > 0.5:
        return 'torque', ('- quadratic_viscous_friction * mean_speed^2 * sign(velocity)'
                          ' * (1 - exp(-abs(velocity) / transition_speed))'), _values(
            entry, 'quadratic_viscous_friction', 'mean_speed', 'transition_speed')
    return 'torque', '+ quadratic_viscous_friction * velocity * abs(velocity)', _values(
        entry, 'quadratic_viscous_friction')


_FORMULAS: Mapping[str, Callable[[EffectSetting], tuple[str, str, dict[str, float]]]] = {
    'torque_offset': _offset, 'stribeck_friction': _stribeck,
    'nonlinear_viscous_friction': _drag}


def _text(model: Model, name: str, changes: _Changes, parameters: list[tuple[str, float, str]],
          lacks: list[str]) -> str:
    units = _LINEAR if model.joint.type == 'prismatic' else _UNITS
    load, friction = model.load_torque, model.friction
    lines = [f'model {name} "Brake actuator or axis, written by engb export"']

    def parameter(label: str, value: float, unit: str, what: str) -> None:
        said = f'(unit="{unit}")' if unit else ''
        lines.append(f'  parameter Real {label}{said} = {value!r} "{what}";')

    parameter('inertia', model.motor.inertia, units['inertia'], 'J')
    parameter('viscous_friction', model.motor.viscous_friction, units['viscous'], 'B')
    parameter('coulomb', friction.coulomb, units['torque'], 'Coulomb friction')
    parameter('load_gain', friction.load_gain, '1', 'friction per load')
    parameter('saturation_velocity', friction.saturation_velocity, units['velocity'],
              'speed from which dry friction is whole')
    if friction.load_curvature:
        parameter('load_curvature', friction.load_curvature, '1', 'how friction over load bends')
        parameter('reference_load', friction.reference_load, units['torque'], 'where it crosses')
    if load.form == 'sinusoid':
        parameter('load_amplitude', load.amplitude, units['torque'], 'load')
        parameter('load_phase', load.phase, 'rad', 'load')
        curve = 'load_amplitude * sin(position + load_phase)'
    else:
        terms = ', '.join(repr(float(value)) for value in load.coefficients)
        lines.append(f'  parameter Real p[{len(load.coefficients)}] = {{{terms}}} '
                     '"load curve: p0, p1, ...";')
        curve = f'p[{len(load.coefficients)}]'
        for index in range(len(load.coefficients) - 1, 0, -1):
            curve = f'p[{index}] + travel * ({curve})'
        if load.contact_angle is not None:
            parameter('contact_angle', load.contact_angle, units['position'],
                      'no load before it')
            curve = f'if travel < 0 then 0 else {curve}'
    for label, value, unit in parameters:
        parameter(label, float(value), unit, 'of an effect')
    waves = [f'{one.amplitude!r} * sin({one.order!r} * position + ({one.phase!r}))'
             for one in model.cogging]
    lines += [
        f'  input Real effort(unit="{units["torque"]}") "motor torque, measured or commanded";',
        f'  output Real position(unit="{units["position"]}", start=0, fixed=true) "motor angle";',
        f'  output Real velocity(unit="{units["velocity"]}", start=0, fixed=true) "motor speed";',
        f'  output Real load(unit="{units["torque"]}") "load torque";',
        '  Real motor_torque "torque that the effort gives";',
        '  Real level "friction level";',
        '  Real direction "direction of friction, -1 to 1";',
        '  Real rest "cogging and other torques";']
    gain = 'load_gain'
    if load.form != 'sinusoid':
        lines.append('  Real travel "beyond the contact";')
    if friction.load_curvature:
        lines += ['  Real size "of the load";', '  Real edge;', '  Real gain;']
        gain = 'gain'
    lines.append('equation')
    if load.form != 'sinusoid':
        lines.append('  travel = position' + (' - contact_angle;'
                                              if load.contact_angle is not None else ';'))
    if friction.load_curvature:
        edge = '2 * reference_load'
        if friction.load_curvature < 0:
            edge = (f'min({edge}, reference_load * (1 - load_curvature) / '
                    '(-2 * load_curvature))')
        lines += [
            '  size = abs(load);', f'  edge = {edge};',
            '  gain = if size <= edge then load_gain * (1 + load_curvature * (size / '
            'reference_load - 1)) else load_gain * (edge * (1 + load_curvature * (edge / '
            'reference_load - 1)) + (1 + load_curvature * (2 * edge / reference_load - 1)) * '
            '(size - edge)) / size;']
    lines += [
        '  der(position) = velocity;',
        '  inertia * der(velocity) = motor_torque - viscous_friction * velocity - load '
        '- level * direction - rest;',
        f'  motor_torque = {" ".join(["effort", *changes["effort"]])};',
        f'  load = {curve};',
        f'  level = {" ".join([f"(coulomb + {gain} * abs(load))", *changes["level"]])};',
        '  direction = max(-1, min(1, velocity / saturation_velocity));',
        f'  rest = {" ".join([" + ".join(waves) or "0", *changes["torque"]])};']
    if lacks:
        lines.append('  // Not in this text; the FMU has it:')
        lines += [f'  //   {line}' for line in lacks]
    lines.append(f'end {name};')
    return '\n'.join([*lines, ''])
