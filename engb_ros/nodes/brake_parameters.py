# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A simulated brake by parameters: for nodes `plant` and `drive_emulator`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TYPE_CHECKING

from engb_core.bench.sensors import SensorSettings
from engb_core.model import Model
from engb_ros.files import TRUE_BRAKE
from engb_ros.nodes.joint import JOINT, with_joint
from engb_ros.nodes.parameters import ParameterSpec

if TYPE_CHECKING:
    from engb_core.bench.settings import BenchSettings
    from engb_core.bench.virtual_brake import VirtualBrake

__all__ = ['BRAKE_PARAMETERS', 'make_brake', 'word_about_torque']

BRAKE_PARAMETERS = (
    ParameterSpec('model', '', 'model file of the true brake; empty: the one in config/'),
    JOINT,
    ParameterSpec('effects', '', 'further physics, as a text of YAML; on a command line: -p '
                  '"effects:=\'stribeck_friction: {breakaway_ratio: 1.4, stribeck_velocity: '
                  '2.0}\'"'),
    ParameterSpec('mechanism', '', 'mechanism file: its load torque and load-dependent '
                  'friction (chapter 2) take the place of the model\'s'),
    ParameterSpec('pad_friction', 0.0, 'μ of the pads on the turning disc, with `mechanism`',
                  '-', 0.0, 1.0),
    ParameterSpec('bench', '', 'bench brake file, or a sealed one: a brake with current loop, '
                  'heating pad and load cell (engb_core.bench) runs in the place of the '
                  'model\'s'),
    ParameterSpec('added_inertia', 0.0, 'a disc of known inertia on the motor\'s shaft, with '
                  '`bench`', 'kg·m²', 0.0, 1.0),
    ParameterSpec('unloaded', False, 'the caliper is taken off, with `bench`'),
    ParameterSpec('rate', 1000.0, 'samples per second', 'Hz', 10.0, 10000.0),
    ParameterSpec('effort_limit', 0.75, 'the drive gives no more', 'N·m', 0.0, 1e4),
    ParameterSpec('command_timeout', 0.1, 'without a command for so long, no torque', 's',
                  0.001, 10.0),
    ParameterSpec('physics_step', 5e-5, 'of the integration', 's', 1e-6, 1e-3),
    ParameterSpec('counts_per_revolution', 8192, 'of the encoder; 0: exact', '', 0, 1 << 24),
    ParameterSpec('velocity_cutoff', 100.0, 'low-pass of the drive\'s velocity; 0: none', 'Hz',
                  0.0, 1e5),
    ParameterSpec('effort_noise', 0.002, 'standard deviation of the measured effort', 'N·m',
                  0.0, 10.0),
    ParameterSpec('effort_resolution', 0.0002, 'of the measured effort; 0: exact', 'N·m', 0.0,
                  1.0),
    ParameterSpec('seed', 1, 'of the noise', '', 0, 2**31 - 1),
    ParameterSpec('disc_speed_times', [0.0], 'instants of the disc\'s speed profile', 's', 0.0,
                  1e6),
    ParameterSpec('disc_speed_values', [0.0], 'disc speed at these instants', 'rad/s', -1e4,
                  1e4),
    ParameterSpec('pad_temperature_times', [0.0], 'instants of the temperature profile', 's',
                  0.0, 1e6),
    ParameterSpec('pad_temperature_values', [20.0], 'pad temperature at these instants', '°C',
                  -273.0, 2000.0),
)


def word_about_torque(values: dict[str, Any]) -> str:
    """Return what there is to say of a drive that gives no torque, in one line; '' of others."""
    if values['effort_limit'] > 0.0:
        return ''
    return ('parameter effort_limit is 0: this drive gives no torque, whatever it is asked for; '
            'its controller will find drive_off')


def make_brake(values: dict[str, Any]) -> VirtualBrake:
    """Return the brake of these parameter values; InputError where they don't fit."""
    # Here, not on top: compiling it at the first start takes seconds, in which a signal must
    # already be heeded.
    from engb_core.bench.virtual_brake import DriveSettings, parse_effects, Profile, VirtualBrake
    model = with_joint(Model.read(values['model'] or TRUE_BRAKE), values)
    if values['mechanism']:
        from engb_core.control.clamp_force import read_mechanism
        from engb_core.mechanism.statics import mechanism_load
        model = mechanism_load(model, read_mechanism(values['mechanism']),
                               values['pad_friction'])
    model = replace(model, effects=model.effects + parse_effects(values['effects']))
    bench = None
    if values['bench']:
        from engb_core.bench.brake import BenchBrake
        bench = BenchBrake(_bench_settings(values['bench']), values['added_inertia'],
                           values['unloaded'], values['seed'])
    return VirtualBrake(
        model,
        DriveSettings(values['rate'], values['effort_limit'], values['command_timeout'],
                      values['physics_step']),
        SensorSettings(values['counts_per_revolution'], values['velocity_cutoff'],
                       values['effort_noise'], values['effort_resolution'], values['seed']),
        Profile(values['disc_speed_times'], values['disc_speed_values'], 'disc_speed'),
        Profile(values['pad_temperature_times'], values['pad_temperature_values'],
                'pad_temperature'), bench)


def _bench_settings(path: str) -> BenchSettings:
    from engb_core.bench.settings import BenchSettings
    if not path.endswith('.sealed'):
        return BenchSettings.read(path)
    from engb_core.io.sealed import read_sealed
    truth = read_sealed(path)
    truth.pop('salt', None)
    return BenchSettings.from_mapping(truth)
