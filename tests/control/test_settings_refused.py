# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Settings and mechanisms without sense are told before anything moves; limits of each part."""

from dataclasses import replace
import math

import numpy as np
import pytest
import yaml

from engb_core.bench.sensors import SensorSettings, VelocityFromPosition
from engb_core.control.acceptance import AcceptanceBounds, check_candidate
from engb_core.control.brake_controller import BrakeController
from engb_core.control.brake_settings import ControllerSettings, ForceSettings
from engb_core.control.clamp_force import ClampForceMap, read_mechanism
from engb_core.control.excitation import Excitation, ExcitationSettings, LEVELS
from engb_core.control.feedforward import Feedforward
from engb_core.control.loop import LoopSettings, PositionLoop
from engb_core.control.pid import PidGains
from engb_core.control.publisher_watch import FirstPublisher
from engb_core.control.reference import ReferenceSettings, ReferenceSource
from engb_core.control.sample_clock import SampleClock
from engb_core.control.supervisor_settings import default_stops, SupervisorSettings
from engb_core.control.trajectory import (
    file_reference,
    identification_strokes,
    Setpoint,
    slow_strokes,
    Trajectory,
    TrajectoryBuilder,
)
from engb_core.errors import InputError
from engb_core.mechanism.kinematics import rising_root
from engb_core.mechanism.statics import back_efficiency, mechanism_load
from engb_core.model import Cogging, EffectSetting, LoadTorque, Model
from engb_ros.files import config_file, TRUE_BRAKE

BRAKE = Model.read(TRUE_BRAKE)
MECHANISM = read_mechanism(config_file('mechanism.yaml'))
GAINS = PidGains(0.4, 1.5, 0.006, 0.75, -0.75, 0.5, -0.5)


@pytest.mark.parametrize(('made', 'words'), [
    (lambda: SensorSettings(effort_noise=-1.0), 'effort_noise is -1.0; it must not be below 0'),
    (lambda: SensorSettings(velocity_cutoff=math.nan), 'velocity_cutoff is nan'),
    (lambda: ExcitationSettings(kind='noise'), "excitation is 'noise'; it must be one of steps"),
    (lambda: ExcitationSettings(hold=0.0), 'hold is 0.0; it must be above 0'),
    (lambda: ExcitationSettings(first_frequency=10.0), 'must lie within 0 and last_frequency'),
    (lambda: SupervisorSettings(stale_action='wait'), "stale_action is 'wait'; it must be one of"),
    (lambda: SupervisorSettings(ramp_time=0.0), 'ramp_time is 0.0; it must be above 0'),
    (lambda: SupervisorSettings(stops=dict(list(default_stops().items())[1:])), 'must be one of'),
    (lambda: ReferenceSettings(kind='sine').trajectory(), "reference is 'sine'; it must be"),
    (lambda: ReferenceSettings(kind='file').trajectory(), 'reference_file is empty'),
])
def test_settings_without_sense_are_refused(made, words):
    with pytest.raises(InputError, match=words):
        made()


@pytest.mark.parametrize('made', [
    lambda: Trajectory([0.0], []), lambda: Trajectory([0.0, 1.0, 2.0], [(0.0, 0.0, 0.0, 0.0)]),
    lambda: TrajectoryBuilder(0.0).move(1.0, 0.0),
    lambda: TrajectoryBuilder(0.0).move(1.0, 1.0, 0.0),
    lambda: identification_strokes([], 100.0, 1.0),
    lambda: identification_strokes([5.0], 100.0, 1.0, repetitions=0),
    lambda: slow_strokes(0.0, 1.0, [])])
def test_a_trajectory_of_nothing_is_a_fault_of_the_program(made):
    with pytest.raises(ValueError, match='need|must be'):
        made()


def test_two_rows_of_a_file_are_a_straight_line(tmp_path):
    path = tmp_path / 'line.csv'
    path.write_text('time,position\n3.0,1.0\n5.0,2.0\n')
    line = file_reference(path)
    assert [line.at(time)[:2] for time in (0.0, 1.0)] == [(1.0, 0.5), (1.5, 0.5)]
    assert line.duration == 2.0


@pytest.mark.parametrize(('kind', 'time', 'torque'), [
    ('steps', 0.6, 0.2 * LEVELS[1]), ('steps', -0.1, 0.0), ('steps', 8.0, 0.0),
    ('sweep', 2.0, 0.2 * math.sin(2.0 * math.pi * 2.0 * 1.25))])
def test_a_torque_that_excites(kind, time, torque):
    excitation = Excitation(ExcitationSettings(kind=kind, amplitude=0.2))
    assert excitation.torque(time) == pytest.approx(torque, abs=1e-12)


# ---- mechanisms

def changed(folder, change):
    data = yaml.safe_load(config_file('mechanism.yaml').read_text())
    change(data)
    (folder / 'mechanism.yaml').write_text(yaml.safe_dump(data))
    return folder / 'mechanism.yaml'


def test_a_mechanism_that_lacks_a_number_or_is_none_is_told(tmp_path):
    with pytest.raises(InputError, match='gear_ratio is missing'):
        read_mechanism(changed(tmp_path, lambda data: data.pop('gear_ratio')))
    (tmp_path / 'list.yaml').write_text('- 1\n')
    with pytest.raises(InputError, match='no mapping; a mechanism file names gear_ratio'):
        read_mechanism(tmp_path / 'list.yaml')
    assert read_mechanism(changed(
        tmp_path, lambda data: data.pop('back_efficiency', None))).back_efficiency is None


def test_losses_backwards_are_those_forwards_unless_they_are_given():
    assert back_efficiency(replace(MECHANISM, efficiency=0.8, back_efficiency=None)) == 0.75
    assert back_efficiency(replace(MECHANISM, back_efficiency=0.6)) == 0.6


def test_a_brake_that_locks_itself_by_its_gain_is_refused():
    locking = replace(BRAKE, effects=(EffectSetting('self_energizing', {'load_ratio': 0.01}),))
    with pytest.raises(InputError, match='gain is 0.01; outside 0.02 to 1.98 the brake locks'):
        ClampForceMap(locking, MECHANISM)


def test_before_contact_a_brake_has_no_stiffness():
    force = ClampForceMap(BRAKE, MECHANISM, 0.249)
    assert force.stiffness_at(force.contact_angle - 0.1) == 0.0
    angle = force.contact_angle + 10.0
    step = force.force_of_angle(angle + 0.5) - force.force_of_angle(angle - 0.5)
    assert force.stiffness_at(angle) == pytest.approx(step, rel=0.02)


@pytest.mark.parametrize('friction', [0.0, 0.249])
def test_the_load_of_a_mechanism_has_the_disc_s_part_where_pads_rub(friction):
    model = mechanism_load(Model(), MECHANISM, friction)
    assert [entry.effect for entry in model.effects] == ['self_energizing'] * bool(friction)
    if friction:
        slopes = MECHANISM.posture(np.linspace(0.0, MECHANISM.stroke, 50)).wedge
        ratios = (slopes - friction) / slopes
        assert ratios.min() < model.effects[0].parameters['load_ratio'] < ratios.max()


def test_a_root_is_found_where_the_slope_misleads_and_refused_where_there_is_none():
    root = rising_root(lambda x: (x ** 3 - 8.0, np.full_like(x, 1e-9)), [0.0], [5.0], 'none')
    assert root == pytest.approx([2.0], rel=1e-14)
    with pytest.raises(InputError, match='none'):
        rising_root(lambda x: (x + 9.0, np.ones_like(x)), [0.0], [5.0], 'none')


# ---- models that are learnt

def test_a_first_load_curve_has_nothing_to_be_compared_with():
    free = replace(BRAKE, load_torque=LoadTorque())
    check_candidate(BRAKE, free, AcceptanceBounds())
    with pytest.raises(InputError, match='load_torque.form is sinusoid'):
        check_candidate(replace(BRAKE, load_torque=LoadTorque('sinusoid', amplitude=0.2)), BRAKE,
                        AcceptanceBounds())


def test_contact_is_found_in_a_curve_that_names_none():
    unnamed = LoadTorque(coefficients=(0.0, 0.0, 2e-4))
    model = replace(BRAKE, load_torque=unnamed)
    check_candidate(model, model, AcceptanceBounds())
    worn = replace(model, load_torque=replace(unnamed, contact_angle=12.0))
    with pytest.raises(InputError, match='contact begins at 12 rad, with the model in use at 3'):
        check_candidate(worn, model, AcceptanceBounds())


def controller(**settings):
    made = BrakeController(BRAKE, ControllerSettings(LoopSettings(GAINS), **settings))
    made.start(0.0)
    return made


def test_a_learnt_model_is_taken_with_and_without_forces():
    heavier = replace(BRAKE, motor=replace(BRAKE.motor, inertia=1.2 * BRAKE.motor.inertia))
    for settings in ({}, {'force': ForceSettings(MECHANISM, 0.249)}):
        made = controller(**settings)
        made.take_model(made.prepare_model(heavier))
        assert made.model == heavier


def test_a_command_beside_a_trajectory_is_not_taken():
    made = controller(reference=ReferenceSettings(kind='strokes'))
    assert not made.on_position_command(0.1, 5.0)
    made = controller()
    assert not made.on_position_command(0.1, 5.0)   # how often joint states come is not known yet
    for now in (0.1, 0.102):
        made.on_state(now, now, 0.0, 0.0, 0.0)
    assert made.on_position_command(0.102, 5.0)


def test_a_disc_speed_that_is_no_number_is_not_taken():
    made = controller()
    made.on_disc_speed(0.1, math.nan)
    made.on_disturbance(0.1, math.nan)
    assert made._disc_speed == 0.0
    made.on_disc_speed(0.2, 7.0)
    assert made._disc_speed == 7.0


# ---- parts of the loop

def test_torque_that_holds_a_load():
    loop = PositionLoop(BRAKE, LoopSettings(GAINS))
    assert loop.held_torque(20.0) == Feedforward(BRAKE).load_torque(20.0) > 0.05
    without = PositionLoop(BRAKE, LoopSettings(GAINS, load_feedforward=False))
    assert without.held_torque(20.0) == 0.0
    assert loop.held_torque(math.nan) == 0.0


def test_an_effort_that_is_no_number_leaves_the_observer_where_it_was():
    loop = PositionLoop(BRAKE, LoopSettings(GAINS, disturbance_compensation=True))
    for index in range(50):
        loop.step(0.001 * index, 0.0, 0.0, 0.02, Setpoint(0.0))
    known = loop.disturbance
    assert known != 0.0
    loop.step(0.05, 0.0, 0.0, math.nan, Setpoint(0.0))
    assert loop.disturbance == known


def test_a_velocity_is_kept_where_a_sample_tells_none():
    velocity = VelocityFromPosition(0.0)
    assert [velocity.step(*sample) for sample in (
        (0.0, 1.0), (0.1, 2.0), (0.1, 5.0), (0.05, 5.0), (math.nan, 5.0), (0.2, 2.5))] == \
        pytest.approx([0.0, 10.0, 10.0, 10.0, 10.0, 5.0])


def test_a_reference_waits_for_a_sample_that_is_a_number_and_goes_on_after_a_jump_of_the_clock():
    source = ReferenceSource(ReferenceSettings(kind='strokes', slow_speeds=(), stop_time=0.0,
                                               amplitudes=(12.0,)))
    assert source.at(math.nan, 3.0) == Setpoint(0.0)
    time, before = 0.0, source.at(0.0, 0.0)
    for time in np.arange(0.001, 0.3, 0.001):
        before = source.at(time, before.position)
    assert source.at(math.nan, before.position).position == pytest.approx(before.position)
    after = source.at(time + 50.0, before.position)     # the clock was set
    assert after.position == pytest.approx(before.position, abs=0.1)
    source.command(99.0)                                # no command beside a trajectory
    assert source.at(time + 50.001, after.position).position < 12.0


def test_stamps_that_go_back_at_once_tell_no_spacing():
    clock = SampleClock()
    clock.step(-0.06)
    assert clock.spacing == 0.0
    for _ in range(3000):
        clock.step(0.001)
    assert 0.0009 < clock.spacing < 0.00101     # learnt all the same, from below


def test_who_came_first_is_known_among_many_and_nobody_is_a_stranger_without_a_name():
    watch = FirstPublisher()
    assert watch.is_first(0.0, b'first') and watch.is_first(0.0, None)
    for number in range(20):
        assert not watch.is_first(0.01 * number, b'%d' % number)
        assert watch.is_first(0.01 * number, b'first')
    assert len(watch._publishers) == 8


def test_cogging_counts_as_known_where_a_force_is_estimated():
    from engb_core.control.clamp_force import ClampForceEstimator
    waves = replace(BRAKE, cogging=(Cogging(7.0, 2e-3, 0.3),))
    estimates = []
    for model in (replace(BRAKE, cogging=()), waves):
        table = ClampForceMap(model, MECHANISM, 0.249)
        estimator = ClampForceEstimator(table)
        angle, torque = 18.0, BrakeController(model, ControllerSettings(
            LoopSettings(GAINS))).loop._feedforward
        load = torque.load_torque(angle) + torque.friction_torque(
            torque.load_torque(angle), 20.0) + torque.cogging_torque(angle)
        for index in range(400):
            estimator.step(0.001 * index, angle, 20.0, -load, 0.0)
        estimates.append(estimator.force)
    assert estimates[1] == pytest.approx(estimates[0], rel=1e-3)


def forced(action='hold'):
    """Return a controller that was asked for a force, and when it heard of that last [s]."""
    made = controller(force=ForceSettings(MECHANISM, 0.249), supervisor=replace(
        SupervisorSettings(), stale_action=action), stale_value=500.0)
    for index in range(1, 200):
        made.on_state(0.001 * index, 0.001 * index, 0.0, 0.0, 0.0)
        if index % 20 == 0:
            made.on_force_command(0.001 * index, 3000.0)
    return made, 0.199


def test_who_takes_over_aims_at_the_same_force():
    made, now = forced()
    assert made._force.command == 3000.0
    made.take_over(now, 0.1)
    assert made._force.command == 3000.0


@pytest.mark.parametrize(('action', 'force'), [
    ('hold', None), ('ramp_to_zero', 0.0), ('ramp_to_value', 500.0)])
def test_a_force_that_nobody_asks_for_any_more_does_what_stale_action_says(action, force):
    made, now = forced(action)
    for index in range(1500):
        made.on_state(now + 0.001 * index, now + 0.001 * index, 0.0, 0.0, 0.0)
    assert made._force.command == force


def test_a_model_without_finite_torque_does_not_reach_the_integral():
    loop = PositionLoop(BRAKE, LoopSettings(GAINS))
    for index in range(20):
        loop.step(0.001 * index, 20.0, 0.0, 0.1, Setpoint(20.2))
    kept = loop.pid.i_term
    assert kept != 0.0
    loop.set_model(replace(BRAKE, load_torque=LoadTorque(coefficients=(math.inf,))))
    assert loop.pid.i_term == kept
