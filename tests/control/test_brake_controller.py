# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The whole controller on the plant: force commands, wear, a turning disc, release."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.bench.virtual_brake import Profile, VirtualBrake
from engb_core.control.brake_controller import BrakeController
from engb_core.control.brake_settings import ControllerSettings, ForceSettings
from engb_core.control.causes import State
from engb_core.control.clamp_force import ClampForceMap, read_mechanism
from engb_core.control.loop import LoopSettings
from engb_core.control.pid import PidGains
from engb_core.control.reference import ReferenceSettings
from engb_core.model import EffectSetting, Model
from engb_ros.files import config_file, TRUE_BRAKE

BRAKE = Model.read(TRUE_BRAKE)
MECHANISM = read_mechanism(config_file('mechanism.yaml'))
MAP = ClampForceMap(BRAKE, MECHANISM, 0.249)
SETTINGS = ControllerSettings(
    LoopSettings(PidGains(0.4, 1.5, 0.006, 0.75, -0.75, 0.5, -0.5)),
    force=ForceSettings(MECHANISM, 0.249, running_clearance=2.0), position_max=42.0)


def braking(forces, effects=(), disc=0.0, hold=1.0, settings=SETTINGS):
    """Command each force for `hold` seconds; return true and estimated force at each end."""
    shift = sum(entry.parameters['shift'] for entry in effects if entry.effect == 'contact_shift')
    brake = VirtualBrake(replace(BRAKE, effects=effects),
                         disc_speed=Profile([0.0], [disc], 'disc_speed'))
    controller = BrakeController(BRAKE, settings)
    controller.start(0.0)
    ends, now = [], 0.0
    for force in forces:
        for index in range(round(hold * 1000)):
            measured = brake.advance()
            now = measured.time
            if index % 20 == 0 and index:
                assert controller.on_force_command(now, force)
                controller.on_disc_speed(now, disc)
            torque = controller.on_state(now, now, *measured[1:4])
            brake.command(torque)
        ends.append((MAP.force_of_angle(brake.plant.position - shift),
                     controller.estimator.force, brake.plant.position))
    assert controller.supervisor.state is State.ENABLED
    return controller, np.array(ends)


@pytest.mark.parametrize('disc', [0.0, 60.0, -60.0])
def test_the_force_asked_for_is_the_force_that_is_there(disc):
    energized = (EffectSetting('self_energizing', {'load_ratio': MAP.gain}),) if disc else ()
    _, ends = braking([3000.0, 7000.0, 1000.0], energized, disc)
    assert ends[:, 0] == pytest.approx([3000.0, 7000.0, 1000.0], rel=0.06, abs=100.0)


def test_after_wear_it_finds_contact_and_keeps_the_running_clearance():
    worn = (EffectSetting('contact_shift', {'shift': 2.0}),)
    controller, ends = braking([6000.0, 0.0] * 4, worn)
    assert controller.estimator.shift == pytest.approx(2.0, abs=0.4)
    assert ends[-2, 0] == pytest.approx(6000.0, rel=0.08)
    assert ends[0, 0] == pytest.approx(6000.0, rel=0.08)   # found while it was applying
    # Released, it stands two radians before where the pads touch now.
    assert ends[-1, 2] == pytest.approx(4.0 + 2.0 - 2.0, abs=0.5)


def test_applying_and_releasing_have_their_own_rates():
    settings = replace(SETTINGS, reference=ReferenceSettings(apply_speed=40.0, release_speed=15.0))
    brake, controller = VirtualBrake(BRAKE), BrakeController(BRAKE, settings)
    controller.start(0.0)
    speeds = []
    for index in range(4000):
        measured = brake.advance()
        if index % 20 == 0 and index:
            controller.on_force_command(measured.time, 8000.0 if index < 1500 else 0.0)
        brake.command(controller.on_state(measured.time, measured.time, *measured[1:4]))
        speeds.append(controller.setpoint.velocity)
    assert max(speeds) == pytest.approx(40.0)
    assert min(speeds) == pytest.approx(-15.0)
