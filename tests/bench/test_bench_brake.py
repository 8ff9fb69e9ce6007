# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The bench brake: each of its physics by a number worked out apart, and what it is made with."""

from dataclasses import replace
import math

import numpy as np
import pytest

from engb_core.bench.apparent import apparent_model
from engb_core.bench.brake import BenchBrake, mean_load_torque, pad_friction_at
from engb_core.bench.settings import BenchSettings
from engb_core.errors import InputError
from engb_core.mechanism.statics import clamp_force, load_values
from engb_core.physics.simulation import BrakePlant
from engb_core.reproduce import chosen
from engb_core.reproduce.drawn_brakes import CONTACTS, draw_brake

# Nothing but a motor, a load and friction of the model's form.
PLAIN = chosen.FORM
STICKING = replace(PLAIN, saturation_velocity=0.0, breakaway=0.018, stribeck_velocity=2.0)


def driven_to(brake, angle, gain=0.5, seconds=1.0, disc_speed=0.0):
    """Bring the brake to `angle` without overshoot and hold it; return the last torque."""
    integral = torque = 0.0
    first, count = brake.position, round(seconds * 1000)
    for sample in range(count):
        part = min(1.0, 2.0 * (sample + 1) / count)
        error = first + (angle - first) * part - brake.position
        integral += 0.0005 * error
        torque = min(max(gain * error + integral - 0.008 * brake.velocity, -0.7), 0.7)
        brake.advance(torque, 1e-3, disc_speed)
    return torque


def test_without_more_physics_it_is_the_model():
    """Another integrator and a current loop: the same motion as the package's own plant."""
    bench, plant = BenchBrake(PLAIN), BrakePlant(apparent_model(PLAIN))
    apart = []
    for sample in range(30000):
        torque = 0.07 * math.sin(2.0 * math.pi * 1.2e-4 * sample) + 0.03
        bench.advance(torque, 1e-4)
        plant.advance(bench.effort, 1e-4)
        apart.append(bench.position - plant.position)
    assert 1.0 < abs(bench.position) < chosen.MECHANISM.stroke
    assert np.abs(apart).max() < 0.02


def test_torque_constant_is_the_motors_not_the_drives():
    """A weaker magnet needs more current: the drive, asked for torque, gives less."""
    speeds = []
    for constant in (0.0174, 0.0150):
        brake = BenchBrake(replace(PLAIN, torque_constant=constant), unloaded=True)
        brake.advance(0.06, 0.02)
        speeds.append(brake.velocity)
        assert brake.effort == pytest.approx(0.06, rel=0.02)
    friction = PLAIN.coulomb
    expected = (0.06 * 0.0150 / 0.0174 - friction) / (0.06 - friction)
    assert speeds[1] / speeds[0] == pytest.approx(expected, rel=0.05)


def test_supply_limits_speed_by_back_emf():
    brake = BenchBrake(replace(PLAIN, voltage=2.0), unloaded=True)
    brake.advance(0.5, 5.0)
    # v = R·i + K_T·ω at the end, with K_T·i = B·ω + C₀.
    settings = brake.settings
    per_speed = settings.viscous_friction / settings.torque_constant
    current = settings.coulomb / settings.torque_constant
    expected = ((2.0 - settings.resistance * current)
                / (settings.torque_constant + settings.resistance * per_speed))
    assert brake.velocity == pytest.approx(expected, rel=0.03)
    assert brake.effort < 0.2


def test_it_sticks_below_breakaway_and_slides_above():
    wavy = replace(STICKING, friction_waviness=0.0, cogging=())
    held, moved = BenchBrake(wavy, unloaded=True), BenchBrake(wavy, unloaded=True)
    held.advance(0.0175, 2.0)
    moved.advance(0.0185, 2.0)
    assert held.velocity == 0.0
    assert abs(held.position) < 1e-3
    assert moved.position > 1.0
    assert held.friction_torque == pytest.approx(0.0175, rel=0.01)


def test_slip_takes_less_torque_than_letting_go():
    """Stick and slip: once it slides it goes on under a torque that would not have moved it."""
    brake = BenchBrake(replace(STICKING, cogging=()), unloaded=True)
    brake.advance(0.03, 0.3)
    brake.advance(0.0165, 1.0)
    assert brake.velocity > 1.0


def test_force_on_releasing_is_less_by_the_hysteresis():
    def over_elastic(settings):
        brake, found = BenchBrake(settings), []
        for angle in (15.0, 19.0, 15.0):
            driven_to(brake, angle)
            found.append(brake.clamp_force / float(clamp_force(settings.mechanism,
                                                               brake.position)))
        return found[0], found[2]

    up, down = over_elastic(replace(PLAIN, hysteresis=0.1, hysteresis_distance=2e-5))
    assert up == pytest.approx(1.1, abs=0.01)
    assert down == pytest.approx(0.9, abs=0.02)
    assert over_elastic(PLAIN) == pytest.approx((1.0, 1.0), abs=1e-3)


def test_held_force_creeps():
    brake = BenchBrake(replace(PLAIN, creep=0.1, creep_time=0.3))
    driven_to(brake, 15.0, seconds=0.3)
    first = brake.clamp_force
    driven_to(brake, 15.0, seconds=2.0)
    grip = float(brake.settings.mechanism.posture(15.0).pad_onto
                 ) - brake.settings.mechanism.clearance
    relaxed = 0.9 * grip
    linear, square = brake.settings.mechanism.clamp_stiffness
    assert brake.clamp_force < 0.97 * first
    assert brake.clamp_force == pytest.approx(relaxed * (linear + relaxed * square), rel=0.01)


def test_turning_disc_takes_the_load_off_and_run_out_moves_it():
    still, turning = BenchBrake(PLAIN), BenchBrake(PLAIN)
    driven_to(still, 15.0)
    driven_to(turning, 15.0, disc_speed=35.0)
    gain = float(mean_load_torque(PLAIN, 15.0, 35.0) / mean_load_torque(PLAIN, 15.0))
    assert turning.load_torque / still.load_torque == pytest.approx(gain, rel=0.01)
    assert gain == pytest.approx(0.421, abs=0.01)
    wobbling = BenchBrake(replace(PLAIN, runout=2e-5))
    driven_to(wobbling, 15.0, disc_speed=35.0)
    forces = []
    for _ in range(400):
        driven_to(wobbling, 15.0, seconds=0.001, disc_speed=35.0)
        forces.append(wobbling.clamp_force)
    assert np.ptp(forces) > 200.0


def test_pad_friction_falls_with_speed_force_and_heat():
    more = chosen.MORE
    base = float(pad_friction_at(more, more.reference_force, 35.0))
    assert float(pad_friction_at(more, more.reference_force, 70.0)) < base
    assert float(pad_friction_at(more, 2.0 * more.reference_force, 35.0)) < base
    hot = float(pad_friction_at(more, more.reference_force, 35.0, 220.0))
    assert hot == pytest.approx(base * (1.0 - 200.0 * more.friction_by_heat))
    assert float(pad_friction_at(more, 1000.0, -35.0)) < 0.0


def test_pads_heat_and_wear_by_their_work():
    brake = BenchBrake(replace(PLAIN, wear_rate=1e-9, heat_capacity=500.0, cooling=0.0))
    driven_to(brake, 15.0, disc_speed=35.0)
    before = brake.pad_temperature, brake.wear
    driven_to(brake, 15.0, disc_speed=35.0)
    power = PLAIN.pad_friction * brake.clamp_force * 35.0 * PLAIN.friction_radius
    assert brake.pad_temperature - before[0] == pytest.approx(power / 500.0, rel=0.02)
    assert brake.wear - before[1] == pytest.approx(1e-9 * power, rel=0.02)


def test_load_cell_reads_the_force_with_its_own_error():
    brake = BenchBrake(replace(PLAIN, cell_gain=1.02, cell_noise=5.0))
    driven_to(brake, 15.0)
    read = np.array([brake.load_cell() for _ in range(2000)])
    assert read.mean() == pytest.approx(1.02 * brake.clamp_force, rel=1e-3)
    assert read.std() == pytest.approx(5.0, rel=0.1)


def test_apparent_load_is_the_mechanisms_in_the_drives_units():
    weak = replace(PLAIN, torque_constant=0.9 * PLAIN.assumed_torque_constant)
    angle = np.linspace(2.0, 20.0, 50)
    seen = load_values(apparent_model(weak).load_torque, angle)
    assert seen == pytest.approx(mean_load_torque(weak, angle) / 0.9, abs=2e-6)
    assert apparent_model(weak).motor.inertia == pytest.approx(weak.inertia / 0.9)


def test_settings_come_back_from_their_file(tmp_path):
    chosen.MORE.write(tmp_path / 'brake.yaml')
    assert BenchSettings.read(tmp_path / 'brake.yaml') == chosen.MORE


@pytest.mark.parametrize(('text', 'word'), [
    ('speling: 1', 'speling'), ('inertia: -1', 'inertia'), ('inertia: heavy', 'number'),
    ('voltage: 0', 'voltage'), ('saturation_velocity: 0.01', 'saturation_velocity'),
    ('- 1', 'mapping'), ('mechanism: {gear_ratio: 4}', 'bench brake'), ('a: [', 'read')])
def test_bad_settings_are_told_with_their_file(text, word, tmp_path):
    path = tmp_path / 'brake.yaml'
    path.write_text(text)
    with pytest.raises(InputError, match=word) as told:
        BenchSettings.read(path)
    assert 'brake.yaml' in str(told.value)


def test_drawn_brakes_differ_and_stay_in_range():
    brakes = [draw_brake(seed) for seed in range(30)]
    contacts = [apparent_model(brake).load_torque.contact_angle for brake in brakes]
    assert min(contacts) > CONTACTS[0] - 0.01
    assert max(contacts) < CONTACTS[1] + 0.01
    assert np.ptp(contacts) > 4.0
    assert draw_brake(3) == draw_brake(3)
    assert draw_brake([3, 4]) != draw_brake(3)
    constants = np.array([brake.torque_constant for brake in brakes]) / 0.0174
    assert constants.min() > 0.7
    assert constants.max() < 1.3
    assert np.ptp(constants) > 0.4
