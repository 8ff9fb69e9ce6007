# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A model as a joint of MuJoCo (MJCF) or of a robot description (URDF), and what they cannot say.

Both describe one joint with inertia, viscous and dry friction. MJCF also has the load curve, as a
spring whose stiffness is a polynomial, and drag that grows with the square of the speed.
https://mujoco.readthedocs.io/en/stable/XMLreference.html, http://wiki.ros.org/urdf/XML/joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

import numpy as np

from engb_core.export.folded import folded, missing
from engb_core.model import Model

__all__ = ['mjcf', 'urdf']

GRAVITY = 9.81
# What the other body of the joint weighs: nothing that matters, but no simulator takes none.
_LIGHT = 1e-6
_SPRING_TERMS = 3


def _said(comment: Sequence[str]) -> str:
    lines = '\n'.join(f'    - {line}' for line in comment) or '    nothing'
    return ('\n  Written by engb export. SI units; angles are motor angles, torques motor-side.\n'
            f'  Not in this file, since the format cannot say it:\n{lines}\n').replace('--', '- -')


def _number(value: float) -> str:
    return f'{value:.9g}'


def mjcf(model: Model) -> tuple[str, tuple[str, ...]]:
    """Return the model as MJCF, and what is not in it, a line each.

    The joint is `joint.name` of the model; the actuator of the same name takes its torque. The
    three numbers of a stiffness need MuJoCo 3.4 or later.
    """
    model, left = folded(model)
    lacks = _lacks(model)
    # Drag that levels off is no polynomial of speed.
    drag = next((entry for entry in left if entry.effect == 'nonlinear_viscous_friction'
                 and not entry.parameters.get('levels_off', 0.0)), None)
    left = tuple(entry for entry in left if entry is not drag)
    root = ElementTree.Element('mujoco', {'model': model.joint.name})
    ElementTree.SubElement(root, 'compiler', {'angle': 'radian', 'autolimits': 'true'})
    ElementTree.SubElement(root, 'option', {'timestep': '0.0005', 'integrator': 'implicitfast',
                                            'gravity': f'0 0 {_number(-GRAVITY)}'})
    world = ElementTree.SubElement(root, 'worldbody')
    body = ElementTree.SubElement(world, 'body', {'name': f'{model.joint.name}_shaft'})
    damping = [model.motor.viscous_friction]
    if drag is not None:
        damping.append(float(drag.parameters['quadratic_viscous_friction']))
    joint = {'name': model.joint.name,
             'type': 'slide' if model.joint.type == 'prismatic' else 'hinge', 'axis': '1 0 0',
             'damping': ' '.join(_number(value) for value in damping),
             'frictionloss': _number(model.friction.coulomb)}
    mass, reach, inertia = _LIGHT, 0.0, model.motor.inertia
    load = model.load_torque
    tendon: dict[str, str] = {}
    if load.form == 'sinusoid' and load.amplitude:
        # A pendulum; up to a half of the inertia is its own.
        reach = min(0.1, 0.5 * inertia * GRAVITY / abs(load.amplitude))
        mass = abs(load.amplitude) / (GRAVITY * reach)
        inertia -= mass * reach ** 2
    elif load.form != 'sinusoid':
        tendon = _spring(model, joint, lacks)
    if model.joint.type == 'prismatic':
        inertia -= mass
    joint['armature'] = _number(inertia)
    ElementTree.SubElement(body, 'joint', joint)
    # Gravity turns a mass that hangs at −z (about x) with m g r sin(θ): the load's phase turns it.
    turned = load.phase + (np.pi if load.amplitude < 0 else 0.0)
    place = (0.0, reach * np.sin(turned), -reach * np.cos(turned))
    small = _number(1e-9 * model.motor.inertia)
    ElementTree.SubElement(body, 'inertial', {
        'pos': ' '.join(_number(value) for value in place), 'mass': _number(mass),
        'diaginertia': f'{small} {small} {small}'})
    if tendon:
        group = ElementTree.SubElement(root, 'tendon')
        fixed = ElementTree.SubElement(group, 'fixed', tendon)
        ElementTree.SubElement(fixed, 'joint', {'joint': model.joint.name, 'coef': '1'})
    actuators = ElementTree.SubElement(root, 'actuator')
    ElementTree.SubElement(actuators, 'motor', {'name': model.joint.name,
                                                'joint': model.joint.name, 'gear': '1'})
    lacks += missing(left)
    return _text(root, lacks), tuple(lacks)


def _spring(model: Model, joint: dict[str, str], lacks: list[str]) -> dict[str, str]:
    """Put the load curve into the joint, or return the tendon that has it beyond its contact."""
    load = model.load_torque
    terms = np.polynomial.Polynomial(load.coefficients)
    if not any(load.coefficients):
        return {}
    zero = 0.0
    if load.coefficients[0] and load.contact_angle is None:
        # A curve that passes zero somewhere is a spring about that place, the constant included.
        roots = [float(root.real) for root in terms.roots() if abs(root.imag) < 1e-9]
        if roots:
            zero = min(roots, key=abs)
            terms = terms(np.polynomial.Polynomial([zero, 1.0]))
    values = [float(value) for value in terms.coef]
    if abs(values[0]) > 1e-12 * max(np.abs(load.coefficients)):
        lacks.append(f'load_torque.coefficients[0] = {_number(values[0])}: a load that begins '
                     'with a step')
    if any(values[1 + _SPRING_TERMS:]):
        lacks.append('terms of the load curve above the third power')
    stiffness = (values[1:] + [0.0] * _SPRING_TERMS)[:_SPRING_TERMS]
    text = ' '.join(_number(value) for value in stiffness)
    if load.contact_angle is None:
        joint |= {'stiffness': text, 'springref': _number(zero)}
        return {}
    # A tendon is slack up to the contact: no load before it.
    return {'name': 'load', 'springlength': f'-1e6 {_number(load.contact_angle)}',
            'stiffness': text}


def urdf(model: Model) -> tuple[str, tuple[str, ...]]:
    """Return the model as URDF, and what is not in it, a line each."""
    model, left = folded(model)
    lacks = _lacks(model)
    if any(model.load_torque.coefficients) or model.load_torque.amplitude:
        lacks.insert(0, 'the load curve: URDF has no springs')
    prismatic = model.joint.type == 'prismatic'
    name = model.joint.name
    root = ElementTree.Element('robot', {'name': f'{name}_model'})
    ElementTree.SubElement(root, 'link', {'name': 'base'})
    link = ElementTree.SubElement(root, 'link', {'name': f'{name}_shaft'})
    inertial = ElementTree.SubElement(link, 'inertial')
    ElementTree.SubElement(inertial, 'mass', {
        'value': _number(model.motor.inertia if prismatic else _LIGHT)})
    tensor = _number(1e-9 if prismatic else model.motor.inertia)
    ElementTree.SubElement(inertial, 'inertia', {
        'ixx': tensor, 'ixy': '0', 'ixz': '0', 'iyy': tensor, 'iyz': '0', 'izz': tensor})
    joint = ElementTree.SubElement(root, 'joint', {
        'name': name, 'type': 'prismatic' if prismatic else 'continuous'})
    ElementTree.SubElement(joint, 'parent', {'link': 'base'})
    ElementTree.SubElement(joint, 'child', {'link': f'{name}_shaft'})
    ElementTree.SubElement(joint, 'axis', {'xyz': '1 0 0'})
    limit = model.controller.effort_limit if model.controller is not None else np.inf
    if prismatic or np.isfinite(limit):
        far = {'lower': '-1000', 'upper': '1000'} if prismatic else {}
        ElementTree.SubElement(joint, 'limit', {
            **far, 'effort': _number(limit if np.isfinite(limit) else 1e9), 'velocity': '1e9'})
    ElementTree.SubElement(joint, 'dynamics', {
        'damping': _number(model.motor.viscous_friction),
        'friction': _number(model.friction.coulomb)})
    lacks += missing(left)
    return _text(root, lacks), tuple(lacks)


def _lacks(model: Model) -> list[str]:
    """Return what neither format can say of the nominal model."""
    found = []
    if model.friction.load_gain:
        found.append(f'friction.load_gain = {_number(model.friction.load_gain)}: friction that '
                     'grows with load')
    if model.friction.coulomb or model.friction.load_gain:
        found.append('friction.saturation_velocity = '
                     f'{_number(model.friction.saturation_velocity)}: dry friction is at once '
                     'whole')
    if model.cogging:
        found.append(f'cogging: {len(model.cogging)} waves over the motor angle')
    if model.controller is not None:
        found.append('the gains of the controller')
    return found


def _text(root: ElementTree.Element, lacks: Sequence[str]) -> str:
    root.insert(0, ElementTree.Comment(_said(lacks)))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding='unicode') + '\n'
