# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The bench brake's numbers, and their file."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
import math
import os
from pathlib import Path
from typing import Any

import yaml

from engb_core.errors import InputError
from engb_core.mechanism.kinematics import CHOSEN, Mechanism
from engb_core.mechanism.statics import efficiency_load_gain

__all__ = ['BenchSettings']

# Below this the boundary layer of friction is stiffer than the integration's step can follow; a
# brake whose friction is so steep is one that sticks, (13).
STEEPEST = 0.2

# Sizes that divide.
ABOVE_ZERO = ('inertia', 'torque_constant', 'assumed_torque_constant', 'resistance', 'inductance',
              'voltage', 'current_bandwidth', 'stribeck_velocity', 'standstill', 'creep_time',
              'hysteresis_distance', 'heat_capacity', 'reference_force', 'cell_cutoff')


@dataclass(frozen=True)
class BenchSettings:
    """The bench brake's numbers, SI units; 0 takes an effect out. Equations: `bench.brake`.

    Attributes:
        mechanism: the geometry, clearance and stiffness of chapter 2.
        inertia, viscous_friction: J [kg·m²], B [N·m·s/rad].
        torque_constant: K_T [N·m/A], the true one.
        assumed_torque_constant: by which the drive turns torque into current and back [N·m/A].
        resistance, inductance, voltage: of the phase [Ω, H], of the supply [V].
        current_bandwidth: of the current loop [Hz].
        coulomb: C₀ [N·m].
        saturation_velocity: friction is (C₀ + C₁·T_L)·sat(ω/ω_s), the model file's form [rad/s];
            0: (13), with its stick, and what follows here.
        breakaway, stribeck_velocity: T_sf [N·m], ω_st [rad/s].
        standstill: ε of (13) [rad/s].
        friction_waviness: of the screw's friction over its turn, a part of it [-].
        cogging: rows of order [1/rev], amplitude [N·m], phase [rad].
        hysteresis, hysteresis_distance: of the caliper [-], [m].
        creep, creep_time: the part of the compression that relaxes [-], in this time [s].
        pad_friction: μ of a slow disc at `reference_force` and `ambient` [-].
        friction_by_speed, friction_by_force, friction_by_heat: how μ falls, per e-fold of the
            disc's speed [-], per `reference_force` [-], per kelvin [1/K].
        reference_force: [N].
        runout: of the disc, either way, once per turn [m].
        friction_radius: of the pads on the disc [m].
        heat_capacity, cooling, ambient: of the pads [J/K], [W/K], [°C].
        wear_rate: of the pads [m/J].
        cell_gain, cell_noise, cell_cutoff: of the load cell [-], [N], [Hz].
    """

    mechanism: Mechanism = CHOSEN
    inertia: float = 5.62e-5
    viscous_friction: float = 9.3e-4
    torque_constant: float = 0.0174
    assumed_torque_constant: float = 0.0174
    resistance: float = 0.12
    inductance: float = 6.0e-5
    voltage: float = 12.0
    current_bandwidth: float = 400.0
    coulomb: float = 0.012
    saturation_velocity: float = 0.0
    breakaway: float = 0.018
    stribeck_velocity: float = 2.0
    standstill: float = 0.02
    friction_waviness: float = 0.03
    cogging: tuple[tuple[float, float, float], ...] = ((12.0, 4.0e-3, 0.7), (4.0, 1.5e-3, -1.1))
    hysteresis: float = 0.06
    hysteresis_distance: float = 6.0e-5
    creep: float = 0.08
    creep_time: float = 0.8
    pad_friction: float = 0.249
    friction_by_speed: float = 0.04
    friction_by_force: float = 0.05
    friction_by_heat: float = 4.0e-4
    reference_force: float = 2000.0
    runout: float = 1.0e-5
    friction_radius: float = 0.11
    heat_capacity: float = 900.0
    cooling: float = 12.0
    ambient: float = 20.0
    wear_rate: float = 0.0
    cell_gain: float = 1.01
    cell_noise: float = 8.0
    cell_cutoff: float = 150.0

    def __post_init__(self) -> None:
        for entry in fields(self):
            if entry.name in ('mechanism', 'cogging'):
                continue
            value = getattr(self, entry.name)
            if not (math.isfinite(value) and value >= 0.0):
                raise InputError(f'bench brake: {entry.name} is {value}; it must not be below 0')
        for name in ABOVE_ZERO:
            if getattr(self, name) <= 0.0:
                raise InputError(f'bench brake: {name} must be above 0')
        if 0.0 < self.saturation_velocity < STEEPEST:
            raise InputError(f'bench brake: saturation_velocity is {self.saturation_velocity}; '
                             f'below {STEEPEST} rad/s write 0: friction that sticks')

    @property
    def load_gain(self) -> float:
        """C₁ [-], from the efficiencies of gear and screw."""
        return efficiency_load_gain(self.mechanism)[1]

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> BenchSettings:
        """Read a file that `write` made; InputError names what is wrong."""
        path = Path(path)
        try:
            data = yaml.safe_load(path.read_text(encoding='utf-8'))
        except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
            raise InputError(f'{path}: cannot be read; give a bench brake file') from error
        if not isinstance(data, dict):
            raise InputError(f'{path}: no mapping; a bench brake file names inertia, coulomb, …')
        try:
            return cls.from_mapping(data)
        except InputError as error:
            raise InputError(f'{path}: {error}') from error

    @classmethod
    def from_mapping(cls, data: dict[str, Any]) -> BenchSettings:
        """Return the settings of a mapping; what is missing keeps its default."""
        known = {entry.name for entry in fields(cls)}
        unknown = sorted(set(data) - known)
        if unknown:
            raise InputError(f'bench brake: unknown key {unknown[0]}; known: '
                             f'{", ".join(sorted(known))}')
        values = dict(data)
        try:
            if 'mechanism' in values:
                parts = dict(values.pop('mechanism'))
                parts['clamp_stiffness'] = tuple(float(item) for item in parts['clamp_stiffness'])
                values['mechanism'] = Mechanism(**parts)
            if 'cogging' in values:
                values['cogging'] = tuple(tuple(float(item) for item in row)
                                          for row in values['cogging'])
            numbers: dict[str, Any] = {
                name: value if name in ('mechanism', 'cogging') else float(value)
                for name, value in values.items()}
            return cls(**numbers)
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f'bench brake: every value must be a number in SI units ({error})'
                             ) from error

    def to_mapping(self) -> dict[str, Any]:
        """Return the numbers as a mapping for YAML or JSON."""
        data = asdict(self)
        data['mechanism']['clamp_stiffness'] = list(self.mechanism.clamp_stiffness)
        data['cogging'] = [list(row) for row in self.cogging]
        return data

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the numbers as YAML."""
        Path(path).write_text(yaml.safe_dump(self.to_mapping(), sort_keys=False),
                              encoding='utf-8')
