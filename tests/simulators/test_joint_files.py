# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A joint of MJCF or URDF as a nominal model: what stands in the file is in the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.export.robot_formats import mjcf, urdf
from engb_core.model import EffectSetting, Friction, LoadTorque, Model, Motor
from engb_core.physics.nominal_torque import nominal_vector
from engb_core.physics.plant import load_torques
from engb_core.simulated.joint_files import model_of_joint

mujoco = pytest.importorskip('mujoco', reason='mujoco is not installed (pip install mujoco)')

PLAIN = Model(motor=Motor(inertia=8e-5, viscous_friction=1.2e-3),
              friction=Friction(0.011, 0.0, 0.05))
CURVES = {'contact': LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6), contact_angle=2.0),
          'everywhere': LoadTorque(coefficients=(-0.02, 4e-3, 1e-5, 2e-5)),
          'pendulum': LoadTorque('sinusoid', amplitude=0.05, phase=0.6), 'none': LoadTorque()}


@pytest.mark.parametrize('curve', CURVES)
def test_what_was_exported_is_read_again(curve, tmp_path):
    model = replace(PLAIN, load_torque=CURVES[curve])
    path = tmp_path / 'model.xml'
    path.write_text(mjcf(model)[0], encoding='utf-8')
    found, told = model_of_joint(path)
    assert told == ()
    assert found.motor.inertia == pytest.approx(8e-5, rel=1e-4)
    assert found.motor.viscous_friction == 1.2e-3 and found.friction.coulomb == 0.011
    assert found.joint == model.joint
    positions = np.linspace(0.0, 20.0, 60)
    torques = [load_torques(nominal_vector(one), positions) for one in (found, model)]
    assert np.abs(torques[0] - torques[1]).max() < 1e-6 * (np.abs(torques[1]).max() + 1e-3)


def test_quadratic_drag_becomes_its_effect(tmp_path):
    model = replace(PLAIN, effects=(EffectSetting('nonlinear_viscous_friction', {
        'quadratic_viscous_friction': 3e-5}),))
    path = tmp_path / 'model.xml'
    path.write_text(mjcf(model)[0], encoding='utf-8')
    assert model_of_joint(path)[0].effects == model.effects


def test_urdf(tmp_path):
    path = tmp_path / 'robot.urdf'
    path.write_text(urdf(PLAIN)[0], encoding='utf-8')
    found, _ = model_of_joint(path)
    assert found.motor.inertia == pytest.approx(8e-5, rel=1e-6)
    assert found.motor.viscous_friction == 1.2e-3 and found.friction.coulomb == 0.011


TWO = '''
<mujoco><compiler angle="radian"/><worldbody>
  <body><joint name="shoulder" axis="0 1 0" damping="0.2" armature="0.01"/>
    <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" mass="1"/>
    <body pos="0.3 0 0"><joint name="elbow" axis="0 1 0" stiffness="2" springref="0.5"/>
      <geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.02" mass="0.5"/></body></body>
</worldbody></mujoco>'''


def test_one_of_several_joints_is_named(tmp_path):
    path = tmp_path / 'arm.xml'
    path.write_text(TWO, encoding='utf-8')
    with pytest.raises(InputError, match='several joints; name one by --joint: shoulder, elbow'):
        model_of_joint(path)
    with pytest.raises(InputError, match="no joint 'wrist'.*shoulder, elbow"):
        model_of_joint(path, 'wrist')
    found, told = model_of_joint(path, 'elbow')
    assert found.joint.name == 'elbow' and any('other joints' in line for line in told)
    # Spring and gravity: one is the load curve, the other a law.
    assert found.load_torque.coefficients[:2] == pytest.approx((-1.0, 2.0))
    law, = found.effects
    assert law.parameters['a'] == pytest.approx(0.5 * 9.81 * 0.1, rel=1e-3)
    shoulder, _ = model_of_joint(path, 'shoulder')
    assert shoulder.load_torque.form == 'sinusoid'
    # Arm and forearm at their distances.
    assert shoulder.load_torque.amplitude == pytest.approx(9.81 * (0.15 + 0.5 * 0.4), rel=1e-3)
    assert shoulder.motor.inertia > 0.01


@pytest.mark.parametrize(('text', 'words'), [
    ('<mujoco>', 'MuJoCo cannot read it'),
    ('<mujoco><worldbody><body><geom size="1"/></body></worldbody></mujoco>',
     'no joint that turns or slides')])
def test_what_is_no_joint_is_told(text, words, tmp_path):
    path = tmp_path / 'bad.xml'
    path.write_text(text, encoding='utf-8')
    with pytest.raises(InputError, match=words):
        model_of_joint(path)
    with pytest.raises(InputError, match='no such file'):
        model_of_joint(tmp_path / 'gone.urdf')
