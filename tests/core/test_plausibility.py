# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Wrong units are told with their remedy; a true fault of the machine is not taken for them."""

import dataclasses
import math
import re

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.errors import InputError
from engb_core.identify.first_model import first_model
from engb_core.model import Friction, Joint, LoadTorque, Model, Motor
from engb_core.recording import Recording, Reference
from engb_core.signals.plausibility import Plausibility
from tests.core.test_command_law import PENDULUM, servo
from tests.tables.simulated_bench import sampled, TORQUE_CONSTANT

MODEL = Model(Motor(0.0174, 6.8e-5, 1.1e-3),
              LoadTorque(coefficients=(0.0, 1e-3, 2e-4), contact_angle=5.0),
              Friction(0.012, 0.11, 1.5))


def strokes(count):
    """Return strokes into contact and back, as MODEL has them, with noise."""
    time = np.arange(count) / 250.0
    position = 10.0 - 14.0 * np.cos(2 * np.pi * 0.5 * time) + np.sin(2 * np.pi * 1.7 * time)
    velocity = np.gradient(position, time)
    load = np.polyval([2e-4, 1e-3, 0.0], np.maximum(position - 5.0, 0.0))
    friction = (0.012 + 0.11 * load) * np.clip(velocity / 1.5, -1.0, 1.0)
    effort = 6.8e-5 * np.gradient(velocity, time) + 1.1e-3 * velocity + load + friction
    noise = np.random.default_rng(4).standard_normal(time.size)
    return Recording('run', time, position, effort + 1e-3 * noise)


@pytest.fixture(scope='module')
def recording():
    return strokes(2000)


@pytest.mark.parametrize(('change', 'words'), [
    ({'position': 180.0 / math.pi}, ['degrees', '--scale position=0.01745']),
    ({'position': 4096 / (2.0 * math.pi)}, ['counts of 4096', '--scale position=0.001533']),
    ({'effort': 1000.0}, ['mN·m', '--scale effort=0.001']),
    ({'effort': 1.0 / 0.0174}, ['amperes', '--scale effort=0.0174']),
    ({'position': 180.0 / math.pi, 'effort': 1.0 / 0.0174},
     ['degrees', 'amperes', 'position=0.01745', 'effort=0.0174']),
    ({'effort': 0.0}, ['effort is 0', 'all 2000 samples']),
    # A motor whose torque constant the file has not.
    ({'effort': 1.0 / 0.05}, ['a current of a motor with 0.05 N·m/A (the file says 0.0174)',
                              '--scale effort=0.05']),
    ({'effort': 1000.0 / 0.0174}, ['milliamperes', '--scale effort=1.74e-05']),
    ({'effort': 100.0}, ['N·cm', '--scale effort=0.01']),
    ({'effort': -1.0}, ['opposite sign', '--scale effort=-1']),
    ({'position': 180.0 / math.pi, 'effort': 1.0 / 0.05},
     ['degrees', '0.05 N·m/A', 'position=0.01745', 'effort=0.05']),
    ({'position': 0.5 / math.pi}, ['turns', '--scale position=6.283']),
    ({'position': 4000 / (2.0 * math.pi)}, ['counts of 4', '4000']),
    ({'time': 1000.0}, ['time looks like ms', '--scale time=0.001']),
    ({'time': 1000.0, 'position': 180.0 / math.pi}, ['degrees', 'ms']),
    ({'time': 1e6}, ['time looks like µs']),
])
def test_wrong_units_are_told(recording, change, words):
    columns = {name: getattr(recording, name) * factor for name, factor in change.items()}
    if 'counts' in words[0] or 'counts' in words[-1]:
        columns['position'] = np.rint(columns['position'])
    changed = dataclasses.replace(recording, **columns)
    with pytest.raises(InputError) as caught:
        diagnose([changed], MODEL)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(('change', 'words'), [
    # The file's numbers are all of them a third too small: between amperes and N·cm.
    ({'effort': 1.6 / 0.0174}, ['effort in N·cm (--scale effort=0.01)', 'or effort in amperes',
                                'the motion does not tell']),
    ({'position': 0.5 / math.pi, 'effort': 1.6 / 0.0174}, [
        'position in turns and effort in N·cm', 'or position in turns and effort in amperes']),
    # Whole numbers are counts, and nothing is sampled each four seconds.
    ({'position': 4096 / (2.0 * math.pi), 'time': 1e3}, ['counts of 4096', 'ms']),
    ({'effort': 1e8}, [
        'effort or position is not in N·m and rad', '--unit position=UNIT effort=UNIT']),
])
def test_what_the_motion_does_not_tell_is_asked(recording, change, words):
    columns = {name: getattr(recording, name) * factor for name, factor in change.items()}
    if 'counts' in words[0]:
        columns['position'] = np.rint(columns['position'])
    fault = Plausibility(dataclasses.replace(recording, **columns), MODEL).fault()
    assert all(word in fault for word in words), fault


def test_counts_of_which_the_file_tells_no_number_are_asked_for_with_the_time(recording):
    counted = dataclasses.replace(recording, time=1e3 * recording.time, position=np.rint(
        recording.position * 4096 / (2.0 * math.pi)))
    nothing = Model(Motor(0.0174, 1e-9, 1e-9), LoadTorque(), Friction(0.02, 0.0, 1e-3))
    fault = Plausibility(counted, nothing).fault()
    assert fault.endswith('--unit position=N/rev, N the counts in a turn and --scale time=0.001')


@pytest.mark.parametrize('change', [
    {'position': 0.5 / math.pi, 'effort': 1e3}, {'position': 0.5 / math.pi, 'effort': 1 / 0.0174},
    {'position': 180.0 / math.pi}])
def test_units_are_told_beside_numbers_that_are_off_by_a_third(recording, change):
    off = Model(Motor(0.0174, 4.5e-5, 1.5e-3),
                LoadTorque(coefficients=(0.0, 6.5e-4, 1.3e-4), contact_angle=5.0),
                Friction(0.008, 0.11, 1.5))
    columns = {name: getattr(recording, name) * factor for name, factor in change.items()}
    fault = Plausibility(dataclasses.replace(recording, **columns), off).fault()
    for name, factor in change.items():
        assert f'--scale {name}={1.0 / factor:.4g}'[:-1] in fault
    assert Plausibility(recording, off).fault() == ''


def test_an_axis_that_would_outrun_any_is_in_millimetres():
    """Mass and drag alone say nothing of the unit: position in mm and force in mN are as true."""
    time = np.arange(4000) / 1000.0
    velocity = 1.2 * np.sin(2 * np.pi * 0.7 * time)
    force = 3.0 * np.gradient(velocity, time) + 20.0 * velocity
    axis = Model(Motor(35.0, 3.0, 20.0), LoadTorque(), Friction(0.0, 0.0, 1e-3),
                 joint=Joint(type='prismatic'))
    run = Recording('axis', time, np.cumsum(velocity) * 1e-3, force)
    assert Plausibility(run, axis).fault() == ''
    milli = dataclasses.replace(run, position=1e3 * run.position, effort=1e3 * run.effort)
    assert 'position looks like mm, not m and effort looks like mN' in Plausibility(
        milli, axis).fault()


@pytest.fixture(scope='module', params=['stribeck_friction', 'asymmetric_friction'])
def bench(request):
    """A motor without a load that has an effect which MOTOR lacks, 16 s at 1 kHz."""
    run = sampled(request.param, 10, seed=99)
    return Recording('bench', run['t'], run['phi'], TORQUE_CONSTANT * run['i'])


MOTOR = Model(Motor(TORQUE_CONSTANT, 2e-4, 1.2e-3), LoadTorque(), Friction(0.02, 0.0, 0.05))


@pytest.mark.parametrize(('change', 'words'), [
    ({}, []),
    ({'position': 180.0 / math.pi}, ['position looks like degrees']),
    ({'position': 8192 / (2.0 * math.pi)}, ['counts of']),
    ({'position': 180.0 / math.pi, 'effort': 1.0 / TORQUE_CONSTANT}, ['degrees', 'amperes']),
    ({'time': 1000.0}, ['time looks like ms']),
])
def test_wrong_units_are_told_beside_a_large_effect(bench, change, words):
    columns = {name: getattr(bench, name) * factor for name, factor in change.items()}
    if words == ['counts of']:
        columns['position'] = np.rint(columns['position'])
    fault = Plausibility(dataclasses.replace(bench, **columns), MOTOR).fault()
    assert all(word in fault for word in words)
    assert bool(fault) == bool(words)


def test_a_long_recording_is_judged_by_its_middle():
    """Its clock doesn't begin at 0 there; a standstill up to it had been taken for motion."""
    explained = []
    for count in (10_000, 20_000):
        run = strokes(count)
        fault = Plausibility(dataclasses.replace(run, effort=run.effort / 0.0174), MODEL).fault()
        explained.append(int(re.search(r'explains (\d+)%', fault).group(1)))
    assert explained[1] == explained[0]


def test_counts_of_an_encoder_are_told_without_a_model(bench):
    counts = dataclasses.replace(
        bench, position=np.rint(bench.position * 8192 / (2.0 * math.pi)))
    with pytest.raises(InputError, match='counts of an encoder'):
        first_model([counts])


@pytest.mark.parametrize(('change', 'words'), [
    ({'effort': 0.0}, 'effort is 0 N·m in all'),
    ({'time': 1e3}, 'time looks like ms, not s'),
    ({'time': 1e6}, 'time looks like µs, not s'),
])
def test_no_first_model_is_made_of_what_was_not_measured(bench, change, words):
    columns = {name: getattr(bench, name) * factor for name, factor in change.items()}
    with pytest.raises(InputError, match=words):
        first_model([dataclasses.replace(bench, **columns)])


def test_an_angle_within_one_turn(recording):
    changed = dataclasses.replace(recording, position=np.mod(recording.position, 2 * math.pi))
    assert 'numpy.unwrap' in Plausibility(changed, MODEL).fault()


@pytest.mark.parametrize('lasting', [1, 3])
def test_a_misread_position_is_no_turn(recording, lasting):
    """One answer of a servo's bus that was lost and read as -π, as such recordings hold."""
    position = recording.position.copy()
    for place in (100, 700, 1300):
        position[place:place + lasting] = -40.0
    changed = dataclasses.replace(recording, position=position)
    assert 'unwrap' not in Plausibility(changed, MODEL).fault()


@pytest.mark.parametrize('model', [
    MODEL,
    dataclasses.replace(MODEL, load_torque=dataclasses.replace(
        MODEL.load_torque, coefficients=(0.0, 3e-3, 6e-4))),
    dataclasses.replace(MODEL, load_torque=LoadTorque()),
    dataclasses.replace(MODEL, motor=Motor(0.0174, 6.8e-4, 1.1e-2)),
    dataclasses.replace(MODEL, motor=Motor(0.5, 6.8e-5, 1.1e-3)),
    dataclasses.replace(MODEL, motor=Motor(0.0174, 3e-3, 1.1e-3)),
    dataclasses.replace(MODEL, motor=Motor(0.0174, 6.8e-5, 7e-3)),
    dataclasses.replace(MODEL, motor=Motor(0.0174, 1.4e-5, 2.2e-4)),
    dataclasses.replace(MODEL, motor=Motor(0.0174, 1e-6, 1e-6)),
    dataclasses.replace(MODEL, friction=Friction(0.1, 0.5, 1.5)),
    Model(Motor(0.0174, 1e-3, 1e-2), LoadTorque(), Friction(0.012, 0.0, 1.5))])
@pytest.mark.parametrize('gain', [0.5, 1.0, 2.0])
def test_a_wrong_number_is_no_wrong_unit(recording, model, gain):
    """Load three times too stiff or missing, other friction or inertia, torque constant off."""
    changed = dataclasses.replace(recording, effort=gain * recording.effort)
    assert Plausibility(changed, model).fault() == ''


def test_units_are_not_judged_by_an_effort_that_is_a_command():
    """A servo's effort is what it was asked for; a late set-point makes it unlike its torque."""
    asked = servo()
    degrees = dataclasses.replace(asked, position=np.degrees(asked.position), reference=Reference(
        asked.reference.time, np.degrees(asked.reference.position)))
    measured = dataclasses.replace(degrees, reference=None)
    assert 'degrees' in Plausibility(measured, PENDULUM).fault()
    assert Plausibility(degrees, PENDULUM).fault() == ''
