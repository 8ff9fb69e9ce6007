# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""MJCF, URDF, Modelica and JSON say what they can, and what they cannot is told."""

from __future__ import annotations

from dataclasses import replace
import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest

from engb_core.effect_check import MODEL
from engb_core.export.json_text import json_text
from engb_core.export.modelica import modelica
from engb_core.export.robot_formats import mjcf, urdf
from engb_core.model import Cogging, EffectSetting, Friction, LoadTorque, Model
from engb_core.physics.simulation import BrakePlant

from .machines import EFFORT, machines, STEP, with_law

# What MJCF can say whole, but for how friction begins at rest.
PLAIN = replace(MODEL, friction=Friction(0.004, 0.0, 0.02))
CURVES = {
    'contact': LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6), contact_angle=2.0),
    'everywhere': LoadTorque(coefficients=(-0.02, 4e-3, 1e-5, 2e-5)),
    'pendulum': LoadTorque('sinusoid', amplitude=0.05, phase=0.6),
    'pendulum_upside_down': LoadTorque('sinusoid', amplitude=-0.05, phase=0.6),
}


def run_here(model: Model) -> np.ndarray:
    plant = BrakePlant(model)
    found = []
    for effort in EFFORT:
        plant.advance(float(effort), STEP)
        found.append(plant.position)
    return np.array(found)


def run_in_mujoco(text: str) -> np.ndarray:
    mujoco = pytest.importorskip('mujoco', reason='mujoco is not installed (pip install mujoco)')
    machine = mujoco.MjModel.from_xml_string(text)
    machine.opt.timestep = 5e-5
    data = mujoco.MjData(machine)
    found = []
    for effort in EFFORT:
        data.ctrl[0] = effort
        for _ in range(round(STEP / machine.opt.timestep)):
            mujoco.mj_step(machine, data)
        found.append(float(data.qpos[0]))
    return np.array(found)


@pytest.mark.parametrize('curve', [pytest.param(
    name, marks=() if name == 'contact' else pytest.mark.slow) for name in CURVES])
@pytest.mark.parametrize('drag', [0.0, 2e-5])
def test_mujoco_moves_as_the_model_does(curve, drag):
    model = replace(PLAIN, load_torque=CURVES[curve])
    if drag:
        model = replace(model, effects=(EffectSetting('nonlinear_viscous_friction', {
            'quadratic_viscous_friction': drag}),))
    text, lacks = mjcf(model)
    # Its dry friction is a constraint of the solver's, ours grows with speed at first.
    assert [line.split(' ')[0] for line in lacks] == [
        'friction.saturation_velocity', 'the']
    here = run_here(model)
    assert np.abs(run_in_mujoco(text) - here).max() < 0.01 * np.ptp(here)


def test_wrong_numbers_are_put_right_in_the_file():
    model = replace(PLAIN, effects=(
        EffectSetting('inertia_error', {'inertia': 1e-4}),
        EffectSetting('contact_shift', {'shift': 1.5}),
        EffectSetting('load_stiffness_error', {'scale': 1.4}),
        EffectSetting('viscous_friction_error', {'viscous_friction': 2e-3}),
        EffectSetting('coulomb_friction_error', {'coulomb': 0.006})))
    text, _ = mjcf(model)
    here = run_here(model)
    assert np.abs(run_in_mujoco(text) - here).max() < 0.01 * np.ptp(here)
    assert np.abs(run_here(PLAIN) - here).max() > 0.03 * np.ptp(here)


def test_each_effect_is_in_the_file_or_on_the_list():
    for name, model in machines().items():
        if name in ('nominal', 'rich'):
            continue
        effect = model.effects[0].effect
        for text, lacks in (mjcf(model), urdf(model), modelica(model)):
            listed = any(f'({effect})' in line for line in lacks)
            if effect in ('contact_shift', 'load_stiffness_error'):
                # They are numbers of the load curve: where that is lost they are.
                listed = lacks and lacks[0].startswith('the load curve')
            changed = text not in (mjcf(MODEL)[0], urdf(MODEL)[0], modelica(MODEL)[0])
            assert listed or changed, f'{effect} is lost'
            assert all(line in text for line in lacks)


@pytest.mark.parametrize(('load', 'line'), [
    (LoadTorque(coefficients=(0.1, 0.0, 0.02)), 'load_torque.coefficients[0] = 0.1: a load that'),
    (LoadTorque(coefficients=(0.0, 1e-3, 0.0, 0.0, 1e-6)), 'terms of the load curve above the'),
])
def test_what_no_spring_is_stands_on_the_list(load, line):
    text, lacks = mjcf(replace(PLAIN, load_torque=load))
    assert [entry for entry in lacks if entry.startswith(line)]
    assert ElementTree.fromstring(text).find('worldbody/body/joint').get('stiffness')


def test_a_free_slide_has_its_mass_and_nothing_on_the_list_but_the_gains():
    slide = replace(PLAIN, friction=Friction(0.0, 0.0, 0.02), joint=replace(
        PLAIN.joint, type='prismatic'), load_torque=LoadTorque('sinusoid'))
    text, lacks = mjcf(slide)
    body = ElementTree.fromstring(text).find('worldbody/body')
    assert body.find('joint').get('type') == 'slide'
    moved = float(body.find('joint').get('armature')) + float(body.find('inertial').get('mass'))
    assert moved == pytest.approx(slide.motor.inertia, rel=1e-8)
    assert lacks == ('the gains of the controller',)


def test_cogging_stands_on_the_list():
    _, lacks = mjcf(replace(PLAIN, cogging=(Cogging(7.0, 1e-3, 0.3),)))
    assert 'cogging: 1 waves over the motor angle' in lacks


@pytest.mark.parametrize('curve', CURVES)
def test_urdf_has_inertia_damping_and_friction(curve):
    text, lacks = urdf(replace(MODEL, load_torque=CURVES[curve]))
    root = ElementTree.fromstring(text)
    dynamics = root.find('joint/dynamics')
    assert float(dynamics.get('damping')) == MODEL.motor.viscous_friction
    assert float(dynamics.get('friction')) == MODEL.friction.coulomb
    assert float(root.find('link/inertial/inertia').get('ixx')) == MODEL.motor.inertia
    assert lacks[0].startswith('the load curve')


def test_urdf_is_read_by_mujoco():
    mujoco = pytest.importorskip('mujoco', reason='mujoco is not installed (pip install mujoco)')
    machine = mujoco.MjModel.from_xml_string(urdf(MODEL)[0])
    assert machine.dof_damping[0] == MODEL.motor.viscous_friction
    assert machine.dof_frictionloss[0] == MODEL.friction.coulomb
    assert machine.dof_M0[0] == pytest.approx(MODEL.motor.inertia, rel=1e-6)


def modelica_acceleration(text: str, position: float, velocity: float, effort: float) -> float:
    """Return what the equations of a Modelica text say, one after another."""
    known: dict = {'position': position, 'velocity': velocity, 'effort': effort, 'abs': abs,
                   'min': min, 'max': max, 'sin': np.sin, 'exp': np.exp, 'sign': np.sign}
    for name, value in re.findall(r'parameter Real (\w+)(?:\(.*?\))? = ([-\d.e]+)', text):
        known[name] = float(value)
    table = re.search(r'parameter Real p\[\d+\] = \{(.*?)\}', text)
    if table:
        known['p'] = [None, *(float(value) for value in table[1].split(','))]
    equations = dict(re.findall(r'^  (\w+) = (.*);$', text.split('equation\n')[1], re.M))
    for name in ('travel', 'load', 'size', 'edge', 'gain', 'motor_torque', 'level', 'direction',
                 'rest'):
        if name in equations:
            line = re.sub(r'if (.*?) then (.*?) else (.*)', r'(\2) if (\1) else (\3)',
                          equations[name]).replace('^', '**')
            known[name] = eval(line, {}, known)     # the text of this test's own making
    # inertia * der(velocity) = motor_torque - …
    balance = re.search(r'inertia \* der\(velocity\) = (.*);', text)[1]
    return eval(balance, {}, known) / known['inertia']


@pytest.mark.parametrize('effect', [None, 'torque_offset', 'stribeck_friction',
                                    'nonlinear_viscous_friction'])
@pytest.mark.parametrize('curve', CURVES)
def test_modelica_s_equations_are_the_model_s(curve, effect):
    model = replace(machines()['rich'], load_torque=CURVES[curve])
    if effect:
        model = replace(model, effects=machines()[effect].effects)
    text, lacks = modelica(model)
    assert lacks == ()
    for position, velocity, effort in ((5.0, 20.0, 0.1), (5.0, -0.05, 0.1), (-1.0, -3.0, 0.0)):
        plant = BrakePlant(model, position=position)
        plant._sample[3] = velocity
        plant.advance(effort, 1e-7)
        assert modelica_acceleration(text, position, velocity, effort) == pytest.approx(
            plant.acceleration, rel=2e-3, abs=0.5)


LEVELS_OFF = EffectSetting('nonlinear_viscous_friction', {
    'quadratic_viscous_friction': -4e-5, 'transition_speed': 3.0, 'levels_off': 1.0,
    'mean_speed': 12.0})


def test_drag_that_levels_off_is_in_modelica_and_on_the_list_of_what_has_polynomials():
    model = replace(machines()['rich'], effects=(LEVELS_OFF,))
    text, lacks = modelica(model)
    assert lacks == ()
    for velocity in (20.0, 1.5, -3.0):
        plant = BrakePlant(model, position=5.0)
        plant._sample[3] = velocity
        plant.advance(0.1, 1e-7)
        assert modelica_acceleration(text, 5.0, velocity, 0.1) == pytest.approx(
            plant.acceleration, rel=2e-3, abs=0.5)
    assert any('nonlinear_viscous_friction' in line for line in mjcf(model)[1])


def test_modelica_tells_what_the_fmu_has_more():
    text, lacks = modelica(with_law('torque'))
    assert len(lacks) == 1 and 'sin(k * position + c)' in lacks[0]
    assert lacks[0] in text


def test_json_is_the_model_again():
    for model in (MODEL, machines()['stribeck_friction'], with_law('torque')):
        data = json.loads(json_text(model))
        assert Model.from_mapping(data['model']) == model
    assert data['effects'][0]['equation'] == 'T = f, f = a * abs(load) * sin(k * position + c)'
