# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Nothing that is said may hang on the size of a machine, or on how fast it is."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.diagnosis import Diagnosis
from engb_core.diagnose.engine import diagnose
from engb_core.model import Friction, Joint, LoadTorque, Model, Motor
from engb_core.recording import Recording

from .simulated_brake import brake_with, lively, NOMINAL


def scaled(model: Model, length: float, force: float) -> Model:
    """Return the model with positions `length` times and torques `force` times as large."""
    load, friction, motor = model.load_torque, model.friction, model.motor
    contact = load.contact_angle
    return replace(
        model, motor=Motor(motor.torque_constant * force, motor.inertia * force / length,
                           motor.viscous_friction * force / length),
        load_torque=LoadTorque(coefficients=tuple(value * force / length ** power
            for power, value in enumerate(load.coefficients)),
            contact_angle=None if contact is None else contact * length),
        friction=Friction(friction.coulomb * force, friction.load_gain,
                          friction.saturation_velocity * length))


def said(length: float, force: float, effect: str, **parameters: float) -> Diagnosis:
    recording = lively(brake_with(effect, **parameters), seed=4)
    return diagnose([Recording(recording.name, recording.time, length * recording.position,
                               force * recording.effort, signals=recording.signals)],
                    scaled(NOMINAL, length, force))


@pytest.mark.parametrize(('effect', 'parameters', 'power'), [
    ('nonlinear_viscous_friction', {'quadratic_viscous_friction': 3e-5}, -2),
    ('coulomb_friction_error', {'coulomb': 0.02}, 0)])
def test_a_press_is_diagnosed_as_a_small_motor_is(effect, parameters, power):
    """Of a radian a millimetre, of a newton metre ten kilonewtons."""
    length, force = 1e-3, 1e4
    small, large = said(1.0, 1.0, effect, **parameters), said(length, force, effect, **parameters)
    assert large.verdict == small.verdict == 'explained'
    assert [entry.effect for entry in large.effects] == [entry.effect for entry in small.effects]
    assert small.effects[0].effect == effect
    for name, found in small.effects[0].parameters.items():
        if found.std is None:
            # It acts on nothing in this form of the effect.
            continue
        assert large.effects[0].parameters[name].value == pytest.approx(
            found.value * force * length ** power, rel=0.02)
    assert large.effects[0].probability == pytest.approx(small.effects[0].probability, abs=0.05)


def test_drag_of_a_slow_strong_axis_is_at_no_bound():
    """Kilonewtons at centimetres a second are 10⁸ newtons for a metre a second squared."""
    time = np.arange(6000) * 2e-3
    place = 0.006 * np.sin(2.0 * np.pi * 0.5 * time) + 0.003 * np.sin(2.0 * np.pi * 1.3 * time)
    speed = np.gradient(place, time)
    drag = 2.5e7
    effort = (900.0 * np.gradient(speed, time) + 4e3 * np.sign(speed)
              + drag * speed * np.abs(speed)
              + np.random.default_rng(1).normal(0.0, 150.0, time.size))
    model = Model(joint=Joint('press', 'prismatic'),
                  motor=Motor(inertia=900.0, viscous_friction=0.0),
                  friction=Friction(4e3, 0.0, 1e-4))
    found = diagnose([Recording('press', time, place, effort)], model)
    assert found.effects[0].effect == 'nonlinear_viscous_friction'
    assert found.effects[0].parameters['quadratic_viscous_friction'].value == pytest.approx(
        drag, rel=0.1)
