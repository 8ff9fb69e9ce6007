# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The feedforward's torques are those of the plant's balance."""

import numpy as np
import pytest

from engb_core.control.feedforward import Feedforward
from engb_core.control.trajectory import Setpoint
from engb_core.model import Cogging, Friction, LoadTorque, Model, Motor
from engb_core.physics.simulation import BrakePlant

MODELS = {
    'polynomial': Model(load_torque=LoadTorque(coefficients=(0.01, 2e-3, 1e-4, 1e-6)),
                        friction=Friction(0.014, 0.11, 0.3), cogging=(Cogging(12.0, 4e-3, 0.7),)),
    'contact': Model(load_torque=LoadTorque(coefficients=(0.0, 3e-3, 1e-4), contact_angle=4.0),
                     friction=Friction(0.01, 0.2, 0.5)),
    'curved friction': Model(
        load_torque=LoadTorque(coefficients=(0.0, 3e-3, 1e-4), contact_angle=4.0),
        friction=Friction(0.01, 0.2, 0.5, -0.6, 0.06)),
    'sinusoid': Model(Motor(1.0, 1e-2, 0.1), LoadTorque('sinusoid', amplitude=1.5, phase=0.2),
                      Friction(0.1, 0.0, 0.05)),
}


@pytest.mark.parametrize('name', MODELS)
def test_a_plant_that_gets_it_moves_as_asked(name):
    model = MODELS[name]
    feedforward = Feedforward(model)
    for position in (0.5, 5.0, 20.0):
        for velocity in (-20.0, -0.03, 0.02, 15.0):
            for acceleration in (-30.0, 0.0, 30.0):
                plant = BrakePlant(model, step=1e-6, position=position)
                plant._sample[3] = velocity   # as if it had come along
                torque = feedforward.torque(Setpoint(position, velocity, acceleration))
                plant.advance(torque, 1e-6)
                assert plant.acceleration == pytest.approx(acceleration, abs=0.3)


def test_each_term_has_its_switch():
    model = MODELS['polynomial']
    setpoint = Setpoint(10.0, 3.0, 7.0)
    alone = Feedforward(model, load=False, friction=False, cogging=False).torque(setpoint)
    assert alone == pytest.approx(model.motor.inertia * 7.0 + model.motor.viscous_friction * 3.0)
    whole = Feedforward(model)
    load = whole.load_torque(10.0)
    assert load == pytest.approx(np.polyval([1e-6, 1e-4, 2e-3, 0.01], 10.0))
    assert Feedforward(model, friction=False, cogging=False).torque(setpoint) - alone \
        == pytest.approx(load)
    assert Feedforward(model, load=False, cogging=False).torque(setpoint) - alone \
        == pytest.approx(0.014 + 0.11 * load)
    assert Feedforward(model, load=False, friction=False).torque(setpoint) - alone \
        == pytest.approx(whole.cogging_torque(10.0))
