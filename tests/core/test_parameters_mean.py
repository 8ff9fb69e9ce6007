# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a parameter is said to be is what the torque does: measured on the effect itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.problem import problem_of
from engb_core.model import EffectSetting, Friction, LoadTorque, Model, Motor
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.physics.sample_table import sample_table
from engb_core.recording import Recording

STEP, TOP = 1e-3, 20.0
LOAD = LoadTorque(coefficients=(0.0, 2e-3, 2e-4, 1e-5))
# Nothing but the load resists.
BARE = Model(motor=Motor(inertia=1e-12, viscous_friction=0.0), load_torque=LOAD,
             friction=Friction(0.0, 0.0, 1e-6))


def effort(model, position, **columns):
    """Return the effort (n,) that a motion (n,) needs, with columns of the sample as given."""
    samples = sample_table(STEP, STEP * np.arange(position.size), position,
                           np.gradient(position, STEP), 0.0, **columns)
    return effort_of_motion(samples, STEP, physics_of(model))


def with_effect(effect, model=BARE, **parameters):
    return replace(model, effects=(EffectSetting(effect, parameters),))


@pytest.mark.parametrize('sense', [1.0, -1.0], ids=['friction', 'play'])
@pytest.mark.parametrize('elements', [0.0, 1.0], ids=['forgets', 'elements'])
@pytest.mark.parametrize('distance', [0.7, 4.0])
@pytest.mark.parametrize('sharpness', [1.0, 2.5])
def test_hysteresis_ratio_is_half_the_widest_opening(sense, elements, distance, sharpness):
    up = np.linspace(0.0, TOP, 4000)
    peak = float(effort(BARE, up)[-1])
    power = float(np.log2(peak / effort(BARE, up)[2000]))
    torque = effort(with_effect(
        'load_hysteresis', hysteresis_ratio=0.05, memory_distance=distance, load_exponent=0.5,
        sharpness=sharpness, peak_load=peak, sense=sense, reach=TOP, elements=elements,
        load_power=power),
        np.concatenate([up, up[::-1]]))
    opening = 0.5 * np.abs(torque[:4000] - torque[:3999:-1]).max()
    assert opening / torque.max() == pytest.approx(0.05, rel=0.06)


@pytest.mark.parametrize(('steepness', 'middle'), [(0.1, 0.5), (4.0, -0.5), (4.0, 1.2),
                                                   (9.0, 0.4)])
@pytest.mark.parametrize('by_temperature', [0.0, 1.0], ids=['speed', 'temperature'])
def test_ratio_change_is_that_over_the_range(steepness, middle, by_temperature):
    model = with_effect('pad_friction_fade', ratio_change=-0.2, load_ratio=0.8,
                        steepness=steepness, middle=middle, by_temperature=by_temperature,
                        speed_from=4.0, speed_to=80.0, temperature_from=30.0, temperature_to=300.0)
    at = np.full(2, TOP)
    torque = effort(model, at, disc_speed=np.array([4.0, 80.0]),
                    pad_temperature=np.array([30.0, 300.0])) / effort(BARE, at)
    assert torque[1] - torque[0] == pytest.approx(-0.2, abs=1e-6)


def test_amplitude_of_a_displacement_is_that_at_the_given_slope():
    at = np.full(400, 12.0)
    slope = float(np.diff(effort(BARE, np.array([11.99, 12.01])))[0] / 0.02)
    turn = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    torque = effort(with_effect('disc_runout', amplitude=0.004, phase=0.3, second_sine=0.0,
                                second_cosine=0.0, displacement=1.0, reference_slope=slope),
                    at, disc_angle=turn, disc_speed=30.0)
    assert np.ptp(torque) / 2.0 == pytest.approx(0.004, rel=0.02)


@pytest.mark.parametrize('half_load', [0.01, 0.3, 5.0])
def test_amplitude_of_a_force_is_that_at_the_reference_load(half_load):
    at = np.full(400, 12.0)
    turn = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    torque = effort(with_effect('disc_runout', amplitude=0.004, phase=0.0, second_sine=0.0,
                                second_cosine=0.0, half_load=half_load,
                                reference_load=float(effort(BARE, at)[0])),
                    at, disc_angle=turn, disc_speed=30.0)
    assert np.ptp(torque) / 2.0 == pytest.approx(0.004, rel=0.02)


@pytest.mark.parametrize('growth', [-0.5, 0.0, 0.9])
def test_asymmetry_is_that_at_the_mean_speed(growth):
    rubbing = replace(BARE, friction=Friction(0.02, 0.0, 1e-6), load_torque=LoadTorque())
    model = with_effect('asymmetric_friction', rubbing, asymmetry=0.15, of_load_friction=1.0,
                        growth=growth, mean_speed=10.0)
    away = 10.0 * STEP * np.arange(50)
    there, back = effort(model, away)[25], -effort(model, away[::-1])[25]
    assert (there - back) / (there + back) == pytest.approx(0.15, rel=1e-3)
    fast = [effort(model, way)[25] for way in (5.0 * away, 5.0 * away[::-1])]
    rises = (fast[0] + fast[1]) / (fast[0] - fast[1]) - 0.15
    assert np.sign(round(rises, 9)) == np.sign(growth)


def test_pad_friction_builds_up_in_the_given_time():
    model = with_effect('self_energizing', load_ratio=0.7, turning_speed=0.5, build_up=0.1)
    at = np.full(600, TOP)
    speed = np.where(np.arange(600) < 100, 0.0, 50.0)
    ratio = effort(model, at, disc_speed=speed) / effort(BARE, at)
    assert ratio[99] == pytest.approx(1.0)
    assert ratio[200] == pytest.approx(1.0 - 0.3 * (1.0 - np.exp(-1.0)), abs=0.005)
    assert ratio[-1] == pytest.approx(0.7, abs=0.005)


@pytest.mark.parametrize('fall', [-0.5, 0.0, 0.5])
def test_load_ratio_is_that_at_the_reference_load(fall):
    """Without load pad friction is by `fall` more, or less."""
    place = np.array([1.0, 10.0, TOP])
    standing = effort(BARE, place)
    model = with_effect('self_energizing', load_ratio=0.9, fall_with_load=fall,
                        reference_load=float(standing[1]))
    ratio = effort(model, place, disc_speed=np.full(3, 50.0)) / standing
    assert ratio[1] == pytest.approx(0.9)
    assert ratio[0] == pytest.approx(1.0 - 0.1 * (1.0 + fall * (1.0 - standing[0] / standing[1])))
    assert ratio[2] <= 1.0


@pytest.mark.parametrize('growth', [-0.6, 0.0, 0.8])
def test_asymmetry_is_that_of_all_speeds_on_average(growth):
    rng = np.random.default_rng(5)
    ways = [rng.uniform(4.0, TOP) for _ in range(6)]
    counts = rng.integers(300, 3000, 6)
    way = np.concatenate([np.concatenate([np.linspace(0.0, top, count),
                                          np.linspace(top, 0.0, count)])
                          for top, count in zip(ways, counts, strict=True)])
    dry = replace(BARE, friction=Friction(0.02, 0.0, 1e-6), load_torque=LoadTorque(
        coefficients=(0.0, 1e-3)))
    time = STEP * np.arange(way.size)
    scene = problem_of([Recording.from_samples('dry', time, way, effort(dry, way))], dry).scene
    uneven = with_effect('asymmetric_friction', dry, asymmetry=0.1, of_load_friction=1.0,
                         growth=growth, mean_speed=scene.middle_speed, loaded_share=0.0)
    velocity = np.gradient(way, STEP)
    moving = np.abs(velocity) > 1.0
    more = (effort(uneven, way) - effort(dry, way))[moving]
    assert float(more.mean()) / 0.02 == pytest.approx(0.1, rel=0.03)


@pytest.mark.parametrize('speed', [0.4, 3.0, 60.0])
def test_a_fade_turns_the_load_as_far_as_the_disc_turns(speed):
    """A disc that hardly turns helps little, with a pad that fades and with one that doesn't."""
    at, disc_speed = np.full(2, TOP), np.full(2, speed)
    steady = effort(with_effect('self_energizing', load_ratio=0.7, turning_speed=3.0,
                                build_up=1e-3, fall_with_load=0.0, reference_load=0.2),
                    at, disc_speed=disc_speed)
    fading = effort(with_effect('pad_friction_fade', ratio_change=0.0, load_ratio=0.7,
                                turning_speed=3.0, steepness=3.0, middle=0.5, by_temperature=1.0,
                                speed_from=1.0, speed_to=80.0, temperature_from=30.0,
                                temperature_to=300.0), at, disc_speed=disc_speed,
                    pad_temperature=np.full(2, 100.0))
    assert fading == pytest.approx(steady, rel=1e-9)


@pytest.mark.parametrize('error', [0.01, 0.3])
def test_eccentricity_is_how_far_a_reading_is_off(error):
    """A plain brake needs for the true motion what one with an eccentric encoder needs for the
    reading: θ_read = θ + error · sin(θ + phase), however large the error."""
    plain = Model(motor=Motor(inertia=1e-4, viscous_friction=1e-3), load_torque=LOAD,
                  friction=Friction(0.0, 0.0, 1e-6))
    time = STEP * np.arange(4000)
    turn = 2.0 * np.pi * 0.5 * time
    true = 10.0 + 6.0 * np.sin(turn)
    speed, rate = 6.0 * np.pi * np.cos(turn), -6.0 * np.pi ** 2 * np.sin(turn)
    phase = true + 0.7
    read = true + error * np.sin(phase)
    read_speed = speed * (1.0 + error * np.cos(phase))
    read_rate = rate * (1.0 + error * np.cos(phase)) - error * np.sin(phase) * speed ** 2

    def needed(model, position, velocity, acceleration):
        return effort_of_motion(sample_table(STEP, time, position, velocity, acceleration), STEP,
                                physics_of(model))

    said = needed(with_effect('unexplained_eccentricity', plain, error=error, phase=0.7),
                  read, read_speed, read_rate)
    assert said == pytest.approx(needed(plain, true, speed, rate), abs=1e-12)
