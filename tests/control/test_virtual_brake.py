# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The drive behind the plant node: limits, timeout, sensors, effects by text."""

from dataclasses import replace
import math
import re

import numpy as np
import pytest

from engb_core.bench.sensors import SensorChain, SensorSettings, VelocityFromPosition
from engb_core.bench.virtual_brake import DriveSettings, parse_effects, Profile, VirtualBrake
from engb_core.errors import InputError
from engb_core.model import Model
from engb_core.physics.simulation import BrakePlant
from engb_ros.files import TRUE_BRAKE

BRAKE = Model.read(TRUE_BRAKE)


def test_it_is_the_plant_seen_through_the_sensors():
    brake = VirtualBrake(BRAKE, DriveSettings(command_timeout=10.0))
    plant = BrakePlant(BRAKE)
    brake.command(0.08)
    for _ in range(500):
        measured = brake.advance()
        plant.advance(0.08, 1e-3)
    assert brake.plant.position == pytest.approx(plant.position, rel=1e-9)
    count = 2.0 * math.pi / 8192
    assert measured.position == pytest.approx(plant.position, abs=count)
    assert measured.position / count == pytest.approx(round(measured.position / count))
    assert measured.velocity == pytest.approx(plant.velocity, abs=1.5)
    assert measured.effort == pytest.approx(0.08, abs=0.01)


def test_without_commands_the_drive_lets_go():
    brake = VirtualBrake(BRAKE, DriveSettings(command_timeout=0.05))
    brake.command(0.1)
    efforts = [brake.advance().effort for _ in range(100)]
    assert np.mean(efforts[:50]) > 0.09
    assert abs(np.mean(efforts[52:])) < 0.002


def test_what_is_not_finite_is_dropped_and_what_is_too_much_is_cut():
    brake = VirtualBrake(BRAKE)
    assert brake.command(3.0)
    assert brake.torque == 0.75
    for torque in (math.nan, -math.inf, -1e6):   # no controller of this drive asks for that
        assert not brake.command(torque)
    assert (brake.torque, brake.rejected) == (0.75, 3)


def test_the_same_seed_gives_the_same_noise():
    def efforts(seed):
        chain = SensorChain(SensorSettings(seed=seed))
        return [chain.measure(1e-3 * index, 0.0, 0.1)[2] for index in range(200)]

    assert efforts(1) == efforts(1) != efforts(2)
    assert np.std(efforts(3)) == pytest.approx(0.002, rel=0.2)


def test_velocity_is_derived_from_uneven_samples():
    derived = VelocityFromPosition(50.0)
    time = np.cumsum(np.random.default_rng(1).uniform(5e-4, 2e-3, 400))
    for now in time:
        derived.step(now, 7.0 * now)
    assert derived.velocity == pytest.approx(7.0, rel=1e-3)
    assert derived.step(math.nan, 1.0) == derived.velocity


def test_a_profile_is_linear_and_held():
    profile = Profile([1.0, 2.0, 4.0], [0.0, 10.0, 20.0], 'disc_speed')
    assert [profile.at(time) for time in (0.0, 1.5, 3.0, 9.0)] == [0.0, 5.0, 15.0, 20.0]
    for times in ([0.0], [0.0, 0.0, 1.0], []):
        with pytest.raises(InputError, match='disc_speed'):
            Profile(times, [1.0, 2.0, 3.0], 'disc_speed')


def test_effects_come_as_text():
    effects = parse_effects('stribeck_friction: {breakaway_ratio: 1.4, stribeck_velocity: 2}\n'
                            'backlash: {gap: 0.2}')
    assert [entry.effect for entry in effects] == ['stribeck_friction', 'backlash']
    assert effects[0].parameters == {'breakaway_ratio': 1.4, 'stribeck_velocity': 2.0}
    assert parse_effects('') == ()


@pytest.mark.parametrize('text', ['[1, 2', 'backlash', 'backlash: 3', 'backlash: {gap: wide}',
                                  'backlash: {gap: .nan}', 'backlash: {gap: 1, gap: 2}',
                                  '{' * 2000])
def test_bad_effects_are_refused(text):
    with pytest.raises(InputError, match='effects'):
        parse_effects(text)


@pytest.mark.parametrize(('text', 'told'), [
    ('inertia_error: {inertia: -1.0}', 'inertia_error.inertia is -1 kg·m²; it must be above 0'),
    ('inertia_error: {inertia: 0}', 'must be above 0'),
    ('viscous_friction_error: {viscous_friction: -0.1}', 'must not be below 0'),
    ('backlash: {gap: -0.2}', 'backlash.gap is -0.2 rad')])
def test_effects_that_no_machine_has_are_refused(text, told):
    with pytest.raises(InputError, match=re.escape(told)):
        parse_effects(text)
    for allowed in ('contact_shift: {shift: -1.0}', 'asymmetric_friction: {asymmetry: -0.5}'):
        assert parse_effects(allowed)


@pytest.mark.parametrize(('text', 'told'), [
    ('viscous_friction_error: {viscous_friction: 1.0e6}',
     'viscous_friction_error (viscous_friction 1e+06)'),
    ('{torque_offset: {offset: 0.1}, nonlinear_viscous_friction: '
     '{quadratic_viscous_friction: -1.0}}',
     'torque_offset (offset 0.1); nonlinear_viscous_friction (quadratic_viscous_friction -1)')])
def test_a_motion_beyond_all_numbers_names_the_effect(text, told):
    brake = VirtualBrake(replace(Model.read(TRUE_BRAKE), effects=parse_effects(text)))
    with pytest.raises(InputError, match=re.escape(told)):
        for _ in range(3000):
            brake.command(0.1)
            brake.advance()


def test_a_drive_that_gives_nothing_takes_whatever_is_asked_for_and_gives_nothing():
    brake = VirtualBrake(BRAKE, DriveSettings(effort_limit=0.0))
    assert brake.command(0.5)
    assert brake.command(-1e6)
    assert (brake.torque, brake.rejected) == (0.0, 0)
    assert not brake.command(math.nan)
    assert not brake.command(math.inf)
    assert brake.rejected == 2
