# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A joint of a MuJoCo model (MJCF) or of a URDF as a nominal model.

MuJoCo reads both formats; read from it are the joint's inertia (its own, the bodies' and the
armature), damping, dry friction, spring, and what gravity does over the joint's angle, with all
other joints where they stand at the start.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.model import EffectSetting, Friction, Joint, LoadTorque, Model, Motor

__all__ = ['JOINT_FILES', 'model_of_joint']

JOINT_FILES = ('.xml', '.mjcf', '.urdf')
# [rad/s] MuJoCo's dry friction is whole at once; so slow no diagnosis can see it build up.
_AT_ONCE = 0.05
# Angles at which gravity is looked at, over one turn.
_ANGLES = 64
# What a sinusoid leaves of gravity's torque is rounding.
_ROUNDING = 1e-6

Array = NDArray[np.float64]


def model_of_joint(path: str | os.PathLike[str], joint: str | None = None
                   ) -> tuple[Model, tuple[str, ...]]:
    """Return a joint as a model, and what of it the model does not hold, a sentence each.

    Args:
        path: an .xml, .mjcf or .urdf file.
        joint: its name; None where there is only one that moves.

    Raises:
        InputError: MuJoCo is not installed or can't read the file, or it has no such joint.
    """
    try:
        import mujoco
    except ImportError:
        raise InputError(f'{path}: reading it needs MuJoCo: pip install mujoco') from None
    file = Path(path)
    if not file.is_file():
        raise InputError(f'{file}: there is no such file')
    try:
        machine = mujoco.MjModel.from_xml_path(str(file))
    except Exception as error:
        line = (str(error).strip().splitlines() or ['no message'])[0]
        raise InputError(f'{file}: MuJoCo cannot read it ({line})') from error
    index = _joint(mujoco, machine, file, joint)
    return _model(mujoco, machine, index)


def _joint(mujoco: Any, machine: Any, file: Path, wanted: str | None) -> int:
    kinds = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
    found = {_name(mujoco, machine, index): index for index in range(machine.njnt)
             if machine.jnt_type[index] in [int(kind) for kind in kinds]}
    if not found:
        raise InputError(f'{file}: holds no joint that turns or slides')
    if wanted is None and len(found) == 1:
        return next(iter(found.values()))
    if wanted not in found:
        asked = 'several joints' if wanted is None else f'no joint {wanted!r}'
        raise InputError(f'{file}: holds {asked}; name one by --joint: {", ".join(found)}')
    return found[wanted]


def _name(mujoco: Any, machine: Any, index: int) -> str:
    return mujoco.mj_id2name(machine, mujoco.mjtObj.mjOBJ_JOINT, index) or f'joint_{index}'


def _model(mujoco: Any, machine: Any, index: int) -> tuple[Model, tuple[str, ...]]:
    told: list[str] = []
    place, angle = int(machine.jnt_dofadr[index]), int(machine.jnt_qposadr[index])
    data = mujoco.MjData(machine)
    mujoco.mj_forward(machine, data)
    masses = np.zeros((machine.nv, machine.nv))
    # The signature has changed between versions of MuJoCo.
    try:
        mujoco.mj_fullM(machine, data, masses)
    except TypeError:
        mujoco.mj_fullM(machine, masses, data.qM)
    effects = []
    drag = _terms(machine, 'dof_damping', place)
    if drag[1]:
        effects.append(EffectSetting('nonlinear_viscous_friction', {
            'quadratic_viscous_friction': drag[1]}))
    if drag[2]:
        told.append('drag that grows with the cube of the speed')
    load, gravity = _load(mujoco, machine, index, told), None
    size, phase, constant, left = _gravity(mujoco, machine, data, place, angle)
    if size > 0.0 or constant:
        if constant or left:
            told.append('a part of gravity\'s torque that is no sinusoid of this joint\'s angle')
        gravity = LoadTorque('sinusoid', amplitude=size, phase=phase)
    if load is None:
        load = gravity or LoadTorque()
    elif gravity is not None:
        effects.append(EffectSetting('law', {'a': size, 'c': phase}, 'a * sin(position + c)',
                                     'torque'))
    if machine.nv > 1:
        told.append('the other joints, which are taken to stand where they are at the start')
    slides = int(machine.jnt_type[index]) == int(mujoco.mjtJoint.mjJNT_SLIDE)
    model = Model(
        motor=Motor(inertia=float(masses[place, place]), viscous_friction=drag[0]),
        load_torque=load, friction=Friction(float(machine.dof_frictionloss[place]), 0.0, _AT_ONCE),
        effects=tuple(effects),
        joint=Joint(_name(mujoco, machine, index), 'prismatic' if slides else 'revolute'))
    return model, tuple(told)


def _terms(machine: Any, name: str, place: int) -> tuple[float, float, float]:
    """Return a coefficient and those of the next two powers, where this MuJoCo has them."""
    further = getattr(machine, f'{name}poly', None)
    more = (0.0, 0.0) if further is None else tuple(float(value) for value in further[place][:2])
    return float(getattr(machine, name)[place]), more[0], more[1]


def _load(mujoco: Any, machine: Any, index: int, told: list[str]) -> LoadTorque | None:
    """Return the joint's spring, or that of a tendon on this joint alone."""
    stiffness = _terms(machine, 'jnt_stiffness', index)
    found = None
    if any(stiffness):
        rest = float(machine.qpos_spring[machine.jnt_qposadr[index]])
        terms = np.polynomial.Polynomial([0.0, *stiffness])(np.polynomial.Polynomial([-rest, 1.0]))
        found = LoadTorque(coefficients=tuple(float(value) for value in terms.coef))
    for tendon in range(machine.ntendon):
        first = int(machine.tendon_adr[tendon])
        alone = (int(machine.tendon_num[tendon]) == 1
                 and int(machine.wrap_type[first]) == int(mujoco.mjtWrap.mjWRAP_JOINT)
                 and int(machine.wrap_objid[first]) == index
                 and float(machine.wrap_prm[first]) == 1.0)
        terms_of = _terms(machine, 'tendon_stiffness', tendon)
        low, high = (float(value) for value in machine.tendon_lengthspring[tendon])
        if not any(terms_of):
            continue
        if not alone or found is not None or low > -1e5 and low != high:
            told.append(f'tendon {tendon}, which is no spring of this joint beyond a contact')
        elif low == high:
            terms = np.polynomial.Polynomial([0.0, *terms_of])(
                np.polynomial.Polynomial([-low, 1.0]))
            found = LoadTorque(coefficients=tuple(float(value) for value in terms.coef))
        else:
            found = LoadTorque(coefficients=(0.0, *terms_of), contact_angle=high)
    return found


def _gravity(mujoco: Any, machine: Any, data: Any, place: int, angle: int
             ) -> tuple[float, float, bool, bool]:
    """Return amplitude and phase of gravity's torque over the angle, whether it has a constant
    part, and whether more is left."""
    angles = np.arange(_ANGLES) * 2.0 * np.pi / _ANGLES
    torques = np.empty(_ANGLES)
    start = float(data.qpos[angle])
    data.qvel[:] = 0.0
    for row, value in enumerate(angles):
        data.qpos[angle] = value
        mujoco.mj_forward(machine, data)
        torques[row] = data.qfrc_bias[place]
    data.qpos[angle] = start
    columns = np.column_stack([np.sin(angles), np.cos(angles), np.ones(_ANGLES)])
    sine, cosine, constant = np.linalg.lstsq(columns, torques, rcond=None)[0]
    size = float(np.hypot(sine, cosine))
    # Against the torque that the joint itself can tell of: its friction.
    scale = max(float(np.abs(torques).max()), float(machine.dof_frictionloss[place]), 1e-300)
    left = float(np.abs(torques - columns @ [sine, cosine, constant]).max())
    if size < _ROUNDING * scale:
        size = 0.0
    return (size, float(np.arctan2(cosine, sine)), bool(abs(constant) > _ROUNDING * scale),
            bool(left > _ROUNDING * scale))
