# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Simulators that hold more than a model says, and what is said of them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.export.robot_formats import mjcf
from engb_core.model import LoadTorque, Model
from engb_core.physics.nominal_torque import nominal_vector
from engb_core.physics.plant import load_torques
from engb_core.recording import Recording
from engb_core.simulated import clock_match as clocks
from engb_core.simulated.fmu_drive import _variable
from engb_core.simulated.joint_files import model_of_joint
from engb_core.simulated.surrogate import Surrogate
from engb_ros.commands.nominal_source import _variables
from tests.report.samples import explained, partly, unexplained

# ---- the surrogate in words


@pytest.mark.parametrize(('diagnosis', 'remainder', 'noise', 'words', 'absent'), [
    (explained(), 0.004, None, ['misses 0.004 N·m rms of its effort.', 'holds already: Friction'],
     ['noise as in', "surrogate's own error"]),
    (explained(), 0.004, 0.003, ['noise as in the real recording would leave 0.003.'],
     ["surrogate's own error"]),
    (unexplained(), 0.02, 0.003, ['describes without a name: Between 4 and 9.5 rad',
                                  "below 0.02 N·m may be the surrogate's own error"],
     ['holds already']),
])
def test_a_surrogate_is_told_with_what_it_holds_and_misses(diagnosis, remainder, noise, words,
                                                           absent):
    told = ' '.join(Surrogate(Model(), diagnosis, remainder, noise).told())
    assert all(word in told for word in words)
    assert not any(word in told for word in absent)


def test_an_unlikely_effect_is_not_held_and_a_linear_axis_speaks_of_force():
    diagnosis = partly()
    doubtful = replace(diagnosis, unexplained=None, effects=tuple(
        replace(entry, probability=0.3) for entry in diagnosis.effects))
    model = replace(Model(), joint=replace(Model().joint, type='prismatic'))
    told = Surrogate(model, doubtful, 3.0, None).told()
    assert len(told) == 1 and 'misses 3 N rms' in told[0]


# ---- joints of MuJoCo

def joint_of(tmp_path, *, joint='', more='', body='', moved=''):
    pytest.importorskip('mujoco', reason='mujoco is not installed (pip install mujoco)')
    path = tmp_path / 'model.xml'
    path.write_text(
        '<mujoco><compiler angle="radian"/><worldbody><body name="a">'
        f'<joint name="motor" axis="1 0 0" damping="0.001" {joint}/>'
        f'<inertial pos="0 0 0" mass="0.1" diaginertia="1e-4 1e-4 1e-4"/>{body}</body>{moved}'
        f'</worldbody>{more}</mujoco>', encoding='utf-8')
    return model_of_joint(path, 'motor')


@pytest.mark.parametrize('length', ['2', '-1e6 2'])
def test_a_tendon_of_the_joint_alone_is_a_spring(tmp_path, length):
    model, told = joint_of(tmp_path, more=(
        f'<tendon><fixed name="t" stiffness="0.01" springlength="{length}">'
        '<joint joint="motor" coef="1"/></fixed></tendon>'))
    assert told == ()
    torque = load_torques(nominal_vector(model), np.array([0.0, 2.0, 5.0]))
    np.testing.assert_allclose(torque, [-0.02 if length == '2' else 0.0, 0.0, 0.03], atol=1e-9)


@pytest.mark.parametrize(('stiffness', 'coefficient', 'words'), [
    ('0', '1', None), ('0.01', '2', 'tendon 0, which is no spring of this joint')])
def test_other_tendons_are_told_or_pull_nothing(tmp_path, stiffness, coefficient, words):
    model, told = joint_of(tmp_path, more=(
        f'<tendon><fixed name="t" stiffness="{stiffness}" springlength="2">'
        f'<joint joint="motor" coef="{coefficient}"/></fixed></tendon>'))
    assert model.load_torque == LoadTorque()
    assert (told == ()) if words is None else told[0].startswith(words)


def test_a_constant_part_of_gravity_is_told(tmp_path):
    pytest.importorskip('mujoco', reason='mujoco is not installed (pip install mujoco)')
    slide = replace(Model(), joint=replace(Model().joint, type='prismatic'))
    path = tmp_path / 'model.xml'
    path.write_text(mjcf(slide)[0].replace('axis="1 0 0"', 'axis="0 0 1"'), encoding='utf-8')
    _, told = model_of_joint(path)
    assert any('no sinusoid' in line for line in told)


# ---- variables of an FMU

def described(*names, unit=None, declared=None):
    return SimpleNamespace(modelVariables=[SimpleNamespace(
        name=name, causality='input', type='Real', unit=unit, declaredType=declared,
        valueReference=number) for number, name in enumerate(names)])


@pytest.mark.parametrize(('unit', 'scale'), [(None, 1.0), ('N.m', 1.0), ('mN.m', 1e-3)])
def test_a_single_variable_is_the_one_and_its_unit_counts(unit, scale):
    found = _variable('a.fmu', described('odd', unit=unit), 'effort', 'input', {})
    assert (found.name, found.reference, found.scale) == ('odd', 0, scale)
    declared = SimpleNamespace(unit='furlong')
    with pytest.raises(InputError, match='odd is in furlong; what is understood is'):
        _variable('a.fmu', described('odd', declared=declared), 'effort', 'input', {})


def test_of_several_variables_one_is_asked_for():
    with pytest.raises(InputError, match='--fmu-variable effort=NAME, one of one, two'):
        _variable('a.fmu', described('one', 'two'), 'effort', 'input', {})
    assert _variable('a.fmu', described('one', 'two'), 'effort', 'input',
                     {'effort': 'two'}).reference == 1


@pytest.mark.parametrize('text', ['effort', 'effort=', 'speed=v'])
def test_a_variable_without_sense_is_refused(text):
    assert _variables(SimpleNamespace(fmu_variable=['effort=u', 'position=y'])) == {
        'effort': 'u', 'position': 'y'}
    with pytest.raises(InputError, match=f'--fmu-variable {text}: write effort=NAME'):
        _variables(SimpleNamespace(fmu_variable=[text]))


# ---- clocks

def run(begin, size=400, still=False):
    time = begin + np.arange(size) * 0.01
    position = 0.0 * time if still else np.sin(3.0 * (time - begin)) * (time - begin)
    return Recording('a', time, position, np.cos(time))


def test_runs_that_share_no_time_have_no_energy_in_common():
    one, other = ((entry.time, entry.position) for entry in (run(0.0), run(100.0)))
    none = np.zeros(3)
    assert clocks._common(one, other, none) == (-np.inf, 0.0)
    assert np.isnan(clocks._apart(run(0.0), run(100.0), none)).all()
    np.testing.assert_array_equal(clocks._fitted(one, other, none), none)
    still = run(0.0, still=True)
    assert clocks._common((still.time, still.position), one, none)[0] == -np.inf


def test_positions_and_efforts_on_one_clock_are_compared():
    apart = clocks._apart(run(0.0), run(0.0), np.zeros(3))
    assert apart == (0.0, 0.0)
