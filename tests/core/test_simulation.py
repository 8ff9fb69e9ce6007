# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The brake run forward: it sticks, loses no energy that it should not, and converges."""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.model import (
    Cogging,
    Controller,
    EffectSetting,
    Friction,
    LoadTorque,
    Model,
    Motor,
)
from engb_core.physics.simulation import BrakePlant, simulate_closed_loop
from engb_core.recording import Recording, Reference

from .bench import Bench, strokes

LOAD = LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6), contact_angle=2.0)
MODEL = Model(load_torque=LOAD, friction=Friction(0.012, 0.11, 0.3))


def sticky(load: LoadTorque | None = None) -> Model:
    return Model(load_torque=load or LoadTorque(), friction=Friction(0.012, 0.0, 1e-3))


@pytest.mark.parametrize('step', [5e-5, 1e-3, 5e-3])
@pytest.mark.parametrize('torque', [0.0115, -0.0115, 0.004, 0.0])
def test_friction_holds_what_it_can_hold(torque, step):
    """For any step: friction is solved for implicitly, so nothing chatters."""
    plant = BrakePlant(sticky(), step=step, position=1.0)
    for _ in range(20):
        plant.advance(torque, 0.05)
        assert abs(plant.velocity) <= 1e-3
    assert abs(plant.position - 1.0) < 1.1e-3
    assert abs(plant.acceleration) < 0.1


def test_friction_holds_the_load():
    """Let go in contact, the brake stays where friction bears the load, and opens where not."""
    held = BrakePlant(sticky(LOAD), position=8.0)     # T_L(8) = 0.0143 > 0.012
    held.advance(0.004, 2.0)
    assert held.position == pytest.approx(8.0, abs=2e-3)
    let_go = BrakePlant(sticky(LOAD), position=14.0)  # T_L(14) = 0.049
    let_go.advance(0.0, 3.0)
    assert let_go.load_torque == pytest.approx(0.012, abs=5e-4)
    assert abs(let_go.velocity) < 1e-3


def test_it_breaks_away():
    plant = BrakePlant(sticky())
    plant.advance(0.02, 1e-4)
    assert plant.acceleration == pytest.approx((0.02 - 0.012) / 6.813e-5, rel=0.02)
    plant.advance(0.02, 3.0)
    assert plant.velocity == pytest.approx((0.02 - 0.012) / 1.125e-3, rel=1e-3)


def test_it_comes_to_rest():
    plant = BrakePlant(sticky())
    plant.advance(0.3, 0.1)
    assert plant.velocity > 50.0
    plant.advance(0.0, 2.0)
    stopped = plant.position
    assert abs(plant.velocity) < 1e-6
    plant.advance(0.0, 1.0)
    assert plant.position == pytest.approx(stopped, abs=1e-6)


def potential(position: float) -> float:
    """Return ∫ T_L dθ up to a position [J]."""
    travel = max(position - LOAD.contact_angle, 0.0)
    return sum(coefficient * travel ** (power + 1) / (power + 1)
               for power, coefficient in enumerate(LOAD.coefficients))


def test_energy_balance():
    """Work put in = kinetic energy + work on the load + what viscous drag and friction take."""
    plant = BrakePlant(MODEL)
    tick, work = 1e-3, 0.0
    speed, level = [0.0], [MODEL.friction.coulomb]
    for index in range(400):
        before = plant.position
        torque = 0.11 * math.sin(2.0 * math.pi * 2.5 * index * tick) + 0.03
        plant.advance(torque, tick)
        work += torque * (plant.position - before)
        speed.append(plant.velocity)
        level.append(MODEL.friction.coulomb + MODEL.friction.load_gain * plant.load_torque)
    speed, level = np.array(speed), np.array(level)
    direction = np.clip(speed / MODEL.friction.saturation_velocity, -1.0, 1.0)
    drag = np.trapezoid(MODEL.motor.viscous_friction * speed ** 2, dx=tick) \
        if hasattr(np, 'trapezoid') else \
        np.trapz(MODEL.motor.viscous_friction * speed ** 2, dx=tick)
    rubbing = float(np.sum(level * direction * speed)) * tick
    kinetic = 0.5 * MODEL.motor.inertia * plant.velocity ** 2
    assert plant.position > 4.0
    assert work == pytest.approx(kinetic + potential(plant.position) + drag + rubbing, rel=0.01)
    assert min(drag, rubbing) > 0.05 * work


def test_without_losses_energy_stays():
    """Within what the step costs: 1 % of what the motor's own drag would have taken."""
    model = Model(Motor(viscous_friction=0.0), LoadTorque('sinusoid', amplitude=0.3),
                  Friction(0.0, 0.0, 0.1))
    plant = BrakePlant(model, position=1.0)
    highest = []
    for _ in range(40):
        plant.advance(0.0, 0.01)
        kinetic = 0.5 * model.motor.inertia * plant.velocity ** 2
        highest.append(kinetic - 0.3 * math.cos(plant.position))
    np.testing.assert_allclose(highest, -0.3 * math.cos(1.0), atol=0.025 * 0.3)


def test_it_converges_with_the_step():
    def end(step: float) -> float:
        plant = BrakePlant(MODEL, step=step)
        for torque in (0.12, 0.05, -0.08):
            plant.advance(torque, 0.08)
        return plant.position

    truth = end(1e-6)
    errors = [abs(end(step) - truth) for step in (4e-4, 2e-4, 1e-4, 5e-5)]
    assert all(coarse > 1.7 * fine for coarse, fine in zip(errors, errors[1:], strict=False))
    assert errors[-1] < 2e-3


def test_time_and_torque():
    plant = BrakePlant(MODEL)
    plant.advance(math.nan, 0.0123)
    assert plant.time == pytest.approx(0.0123)
    assert plant.position == 0.0
    for step in (0.0, -1e-5, 0.1, math.nan):
        with pytest.raises(InputError, match='plant step'):
            BrakePlant(MODEL, step=step)


@pytest.fixture(scope='module')
def recorded():
    return Bench(noise=0.0, counts=65536).run(strokes((20.0, 12.0)))


def test_the_loop_is_the_recorded_one(recorded):
    """Another integrator, another friction curve, the same loop: the same motion."""
    model = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6)),
                  friction=Friction(0.012, 0.11, 0.06),
                  controller=Controller(0.3, 1.0, 0.004, 0.6, 500.0))
    position, velocity = simulate_closed_loop(recorded, model)
    tracking = np.std(recorded.position - recorded.reference.position)
    assert np.std(position - recorded.position) < 0.08 * tracking
    rate = np.gradient(recorded.position, recorded.time)
    assert np.std(velocity - rate) < 0.02 * np.std(rate)


def test_a_loop_that_cannot_be_simulated(recorded):
    with pytest.raises(InputError, match='controller'):
        simulate_closed_loop(recorded, MODEL)
    for rate in (1e-320, 0.01, 1e12):
        with pytest.raises(InputError, match='controller.rate of .* check its unit'):
            simulate_closed_loop(recorded, replace(MODEL, controller=Controller(0.3, rate=rate)))
    bare = type(recorded)(recorded.name, recorded.time, recorded.position, recorded.effort)
    with pytest.raises(InputError, match='no reference'):
        simulate_closed_loop(bare, Model(controller=Controller(0.3)))


@pytest.mark.parametrize('model', [
    MODEL, Model(load_torque=LoadTorque('sinusoid', amplitude=0.2, phase=0.3)),
    Model(load_torque=LOAD, friction=Friction(0.02, 0.05, 2.0),
          cogging=(Cogging(6.0, 1e-3, 0.1), Cogging(12.0, 4e-4, 1.0)))])
def test_without_effects_the_short_way_gives_the_same_numbers(model):
    """To the last bit: an effect that adds nothing takes the long way through all stages."""
    nothing = EffectSetting('viscous_friction_error',
                            {'viscous_friction': model.motor.viscous_friction})
    short, long = BrakePlant(model), BrakePlant(replace(model, effects=(nothing,)))
    for index in range(300):
        torque = 0.15 * math.sin(0.1 * index) + 0.04
        for plant in (short, long):
            plant.advance(torque, 0.0037, disc_speed=3.0)
        assert (short.time, short.position, short.velocity, short.acceleration,
                short.load_torque) == (long.time, long.position, long.velocity,
                                       long.acceleration, long.load_torque)
    assert abs(short.position) > 1.0


@pytest.mark.parametrize('velocity', [True, False])
def test_the_loop_runs_on_over_blocks(monkeypatch, velocity):
    """A run is computed in blocks, which no number shows."""
    time = np.arange(0.0, 1.0, 1.3e-3)
    angle = 20.0 * np.sin(9.0 * time)
    recording = Recording.from_samples(
        'run', time, angle, 0.01 * np.sign(angle), reference=Reference(
            time, angle, 180.0 * np.cos(9.0 * time) if velocity else None, None))
    model = replace(MODEL, controller=Controller(0.05, 0.2, 0.002, 0.6, 1000.0))
    whole = simulate_closed_loop(recording, model)
    for block in (7, 100, 998, 999, 1000):
        monkeypatch.setattr('engb_core.physics.simulation._BLOCK', block)
        for values, expected in zip(simulate_closed_loop(recording, model), whole, strict=True):
            np.testing.assert_allclose(values, expected, atol=1e-9)


def test_differences_of_times_are_the_same_steps():
    """Who steps by differences of times (0.001 s but for the last digits) gets what equal steps
    give: impacts in a gap had made 1e-3 of the stroke of 1e-16 s."""
    from tests.export.machines import EFFORT, machines, STEP
    model = machines()['backlash']
    even, uneven = BrakePlant(model), BrakePlant(model)
    for tick, effort in enumerate(EFFORT):
        even.advance(float(effort), STEP)
        uneven.advance(float(effort), (tick + 1) * STEP - tick * STEP)
        assert uneven.position == even.position and uneven.velocity == even.velocity
