# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The machines that effects hide in: brakes, robot joints with a pendulum's load, linear axes.

Each is drawn in its own SI units and brought to units in which a turn at full speed is 60: there
the truth plant runs and effects are sized, and its recordings go out in the machine's own units.
A joint swings both ways about a level of its own under 10 to 50 N·m of gravity; an axis moves 20
to 30 cm of stroke against friction, a counter spring and little else.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .nominal import Nominal
from .plant_record import blank_plant
from .references import axis_motion, joint_motion, Reference, rich, routine, section, short_test

__all__ = ['draw_machine', 'Machine', 'MACHINES', 'motions', 'native']

MACHINES = ('brake', 'joint', 'axis')
_NOT_ELSEWHERE = {'self_energizing', 'pad_friction_fade', 'disc_runout', 'pad_creep',
                  'load_hysteresis', 'outside_disc_dither', 'outside_hot_contact',
                  'outside_pad_damping', 'outside_contact_wanders'}
# The powers of (unit of angle, unit of torque) in each of the contract's parameters.
_UNITS = {'inertia': (-1, 1), 'viscous_friction': (-1, 1), 'coulomb': (0, 1), 'shift': (1, 0),
          'offset': (0, 1), 'stribeck_velocity': (1, 0), 'presliding_distance': (1, 0),
          'quadratic_viscous_friction': (-2, 1), 'order': (-1, 0), 'amplitude': (0, 1),
          'gap': (1, 0)}


@dataclass(frozen=True)
class Machine:
    """A kind of machine and its units: one unit inside is `angle` rad (or m), `torque` N·m (N)."""

    kind: str
    angle: float = 1.0
    torque: float = 1.0

    def can_hold(self, effect: str) -> bool:
        """Whether the effect may occur in it (a joint has neither pad nor disc)."""
        return self.kind == 'brake' or effect not in _NOT_ELSEWHERE


def native(machine: Machine, name: str, value: float) -> float:
    """A parameter of the contract in the machine's own units."""
    angle, torque = _UNITS.get(name, (0, 0))
    return float(value * machine.angle ** angle * machine.torque ** torque)


def _brake(rng: np.random.Generator, plant: np.ndarray) -> tuple[Machine, Nominal]:
    around = rng.uniform(0.7, 1.3, 8)
    if rng.random() < 0.5:
        at = rng.uniform(4.5, 9.5)
        load = (0.0, 2.9e-3 * around[0], 1.5e-4 * around[1], 2.5e-6 * around[2])
    else:
        at = None
        load = (rng.uniform(0.0, 0.004), 2.3e-3 * around[0], 1.2e-4 * around[1],
                1.8e-6 * around[2])
    lazy = rng.uniform(0.3, 2.0) if rng.random() < 0.15 else 0.0
    wide = rng.random() < 0.15
    inertia = rng.uniform(3e-5, 1.5e-4) if wide else 6.8e-5 * around[3]
    # Some brakes truly have no friction that grows with load: a 0 in the model is no sign.
    gain = 0.0 if rng.random() < 0.15 else rng.uniform(0.06, 0.15)
    plant['saturation'], plant['limit'] = lazy, 0.75
    return Machine('brake'), Nominal(inertia, 1.15e-3 * around[4], load, at, 0.015 * around[5],
                                     gain, lazy or rng.uniform(0.05, 0.06))


def _joint(rng: np.random.Generator, plant: np.ndarray) -> tuple[Machine, Nominal]:
    speed, gravity = rng.uniform(1.8, 3.5), rng.uniform(10.0, 50.0)
    machine = Machine('joint', speed / 60.0, gravity / 0.25)
    phase = rng.uniform(-0.6, 0.6)
    per = machine.angle / machine.torque
    plant['limit'] = 1.2
    return machine, Nominal(
        gravity * rng.uniform(0.008, 0.02) * per, gravity * rng.uniform(0.01, 0.04) * per,
        (0.25 * np.cos(phase), 0.25 * np.sin(phase), 0.0, 0.0), None,
        0.25 * rng.uniform(0.03, 0.1), rng.uniform(0.02, 0.1), rng.uniform(0.05, 0.06),
        machine.angle)


def _axis(rng: np.random.Generator, plant: np.ndarray) -> tuple[Machine, Nominal]:
    mass, speed = rng.uniform(30.0, 120.0), rng.uniform(0.3, 0.5)
    machine = Machine('axis', speed / 60.0, mass * 12.0)
    per = machine.angle / machine.torque
    spring = rng.uniform(0.0, 3.0) * mass * per
    plant['limit'] = 1.0
    return machine, Nominal(mass * per, mass * rng.uniform(1.0, 3.0) * per,
                            (rng.uniform(-0.01, 0.02), spring, 0.0, 0.0), None,
                            rng.uniform(0.012, 0.03), rng.uniform(0.0, 0.1),
                            rng.uniform(0.05, 0.06))


def draw_machine(rng: np.random.Generator, kind: str) -> tuple[Machine, np.ndarray, Nominal]:
    """A machine with random numbers and gains, as the plant's record and as a model."""
    plant = blank_plant()
    machine, base = {'brake': _brake, 'joint': _joint, 'axis': _axis}[kind](rng, plant)
    for name in ('inertia', 'viscous', 'load', 'coulomb', 'gain', 'turn'):
        plant[name] = getattr(base, name)
    plant['contact'] = -1e9 if base.contact is None else base.contact
    scale = np.sqrt(base.inertia / 6.8e-5)
    plant['kp'], plant['ki'] = rng.uniform(0.25, 0.5) * scale, rng.uniform(1.0, 2.4) * scale
    plant['kd'] = rng.uniform(0.0045, 0.0065) * scale
    return machine, plant, base


def motions(rng: np.random.Generator, kind: str, motion: str, count: int
            ) -> tuple[list[Reference], Reference]:
    """Training motions and another one to judge on; `motion` is rich, routine or brief."""
    plain, brief = motion == 'routine', motion == 'brief'
    length = 14.0 if brief else 40.0 if count == 1 else 45.0 / count
    if kind != 'brake':
        move = joint_motion if kind == 'joint' else axis_motion
        return ([move(rng, length) for _ in range(count)], move(rng, 10.0 if brief else 20.0))
    test = short_test(rng, plain, length=9.0 if brief else None)
    if count > 1:
        return section(rng, count, length), test
    if brief:
        return section(rng, 1, length, mixed=True), test
    return [routine(rng) if plain else rich(rng)], test
