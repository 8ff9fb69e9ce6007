# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Pairs of recordings from MuJoCo: a simulator, and the "real" machine with an effect more.

MuJoCo integrates, holds dry friction by its constraint solver and has the load as a spring on a
slack tendon; the hidden effects are formulas of this file, none of the library's. The simulator's
recording is what a simulator writes: no noise, no counts, a clock of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import math
from pathlib import Path

import numpy as np

from engb_core.model import Controller, Friction, LoadTorque, Model, Motor
from engb_core.recording import Recording, Reference
from tests.core.bench import strokes

__all__ = ['HIDDEN', 'LATE', 'Machine', 'Pair', 'RATE', 'drawn_pair', 'table']

RATE, PHYSICS_RATE = 500.0, 5000.0
COUNTS = 4096
EFFORT_NOISE = 2e-3
# Samples at the start that the recorder of the real machine missed.
LATE = 75


@dataclass(frozen=True)
class Machine:
    """What the simulator knows: numbers in SI units, motor side."""

    inertia: float = 7e-5
    damping: float = 1.1e-3
    friction: float = 0.012
    load: tuple[float, float, float] = (1e-3, 2e-4, 5e-6)
    contact: float = 2.0
    gains: tuple[float, float] = (0.3, 0.004)

    def load_torque(self, position: float) -> float:
        """Return T_L [N·m]."""
        travel = max(position - self.contact, 0.0)
        return travel * (self.load[0] + travel * (self.load[1] + travel * self.load[2]))

    def model(self) -> Model:
        """Return the model file of this machine, as its maker would write it."""
        return Model(
            motor=Motor(inertia=self.inertia, viscous_friction=self.damping),
            load_torque=LoadTorque(coefficients=(0.0, *self.load), contact_angle=self.contact),
            friction=Friction(self.friction, 0.0, 0.05),
            controller=Controller(self.gains[0], 0.0, self.gains[1], 1.0, RATE))

    def mjcf(self) -> str:
        """Return the machine in MuJoCo's language."""
        return f'''
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{1.0 / PHYSICS_RATE}" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody>
    <body>
      <joint name="motor" type="hinge" axis="1 0 0" armature="{self.inertia}"
             damping="{self.damping}" frictionloss="{self.friction}"
             solreffriction="0.0004 1" solimpfriction="0.9999 0.9999 1e-6"/>
      <inertial pos="0 0 0" mass="1e-6" diaginertia="1e-12 1e-12 1e-12"/>
    </body>
  </worldbody>
  <tendon>
    <fixed springlength="-1e6 {self.contact}"
           stiffness="{self.load[0]} {self.load[1]} {self.load[2]}">
      <joint joint="motor" coef="1"/>
    </fixed>
  </tendon>
  <actuator><motor joint="motor" gear="1"/></actuator>
</mujoco>'''


@dataclass
class Hidden:
    """An effect as the machine has it: hooks in a step of physics [N·m].

    Attributes:
        name: as the library calls it.
        torque: (machine, memory, time, position, velocity, effort) → torque added to the motor's.
        measured: (effort) → what the current sensor says of it.
    """

    name: str
    torque: Callable[[Machine, dict, float, float, float, float], float] | None = None
    measured: Callable[[float], float] | None = None
    memory: dict = field(default_factory=dict)


def _sign(velocity: float) -> float:
    return math.tanh(velocity / 0.05)


def _stribeck(draw: np.random.Generator) -> Hidden:
    rise, speed = draw.uniform(0.4, 0.9), draw.uniform(1.5, 5.0)
    return Hidden('stribeck_friction', lambda m, s, t, x, v, u: -m.friction * rise * _sign(v)
                  / (1.0 + (v / speed) ** 2))


def _cogging(draw: np.random.Generator) -> Hidden:
    size, order = draw.uniform(2e-3, 5e-3), float(draw.integers(3, 13))
    phase = draw.uniform(0.0, 6.0)
    return Hidden('cogging_torque', lambda m, s, t, x, v, u: -size * (
        math.sin(order * x + phase) + 0.15 * math.sin(2.0 * order * x)))


def _ripple(draw: np.random.Generator) -> Hidden:
    size, order = draw.uniform(0.05, 0.12), float(draw.integers(3, 9))
    return Hidden('torque_ripple', lambda m, s, t, x, v, u: size * u * math.cos(order * x))


def _loaded_friction(draw: np.random.Generator) -> Hidden:
    gain = draw.uniform(0.08, 0.2)
    return Hidden('load_dependent_friction', lambda m, s, t, x, v, u: -gain * _sign(v)
                  * m.load_torque(x))


def _asymmetry(draw: np.random.Generator) -> Hidden:
    more = draw.uniform(0.3, 0.7)
    # Less on the way back: the library spreads it evenly about the mean.
    return Hidden('asymmetric_friction', lambda m, s, t, x, v, u: -m.friction * more
                  * max(_sign(v), 0.0))


def _drag(draw: np.random.Generator) -> Hidden:
    size = draw.uniform(2e-5, 5e-5)
    return Hidden('nonlinear_viscous_friction', lambda m, s, t, x, v, u: -size * v * abs(v))


def _offset(draw: np.random.Generator) -> Hidden:
    size = float(draw.choice([-1.0, 1.0])) * draw.uniform(4e-3, 9e-3)
    return Hidden('torque_offset', measured=lambda u: u + size)


def _stiffness(draw: np.random.Generator) -> Hidden:
    more = draw.uniform(0.1, 0.3)
    return Hidden('load_stiffness_error', lambda m, s, t, x, v, u: -more * m.load_torque(x))


def _creep(draw: np.random.Generator) -> Hidden:
    part, time = draw.uniform(0.1, 0.2), draw.uniform(0.3, 1.2)

    def torque(m: Machine, s: dict, t: float, x: float, v: float, u: float) -> float:
        load = m.load_torque(x)
        s['q'] = s.get('q', 0.0) + (load - s.get('q', 0.0)) / (time * PHYSICS_RATE)
        return part * s['q']
    return Hidden('pad_creep', torque)


def _lag(draw: np.random.Generator) -> Hidden:
    time = draw.uniform(2.5e-3, 6e-3)

    def torque(m: Machine, s: dict, t: float, x: float, v: float, u: float) -> float:
        s['u'] = s.get('u', u) + (u - s.get('u', u)) / (time * PHYSICS_RATE)
        return s['u'] - u
    return Hidden('actuation_lag', torque)


def _hysteresis(draw: np.random.Generator) -> Hidden:
    size, distance = draw.uniform(0.08, 0.16), draw.uniform(1.0, 3.0)

    def torque(m: Machine, s: dict, t: float, x: float, v: float, u: float) -> float:
        way = v / PHYSICS_RATE / distance
        z = s.get('z', 0.0)
        # Bouc and Wen's with exponent 2.
        s['z'] = z + way - 0.5 * (abs(way) * abs(z) * z + way * z * z)
        return -size * m.load_torque(x) * s['z']
    return Hidden('load_hysteresis', torque)


def _drift(draw: np.random.Generator) -> Hidden:
    less = draw.uniform(0.4, 0.6)
    return Hidden('friction_drift', lambda m, s, t, x, v, u: m.friction * less * _sign(v)
                  * (1.0 - math.exp(-t / 6.0)))


HIDDEN: tuple[Callable[[np.random.Generator], Hidden], ...] = (
    _stribeck, _cogging, _ripple, _loaded_friction, _asymmetry, _drag, _offset, _stiffness,
    _creep, _lag, _hysteresis, _drift)


@dataclass(frozen=True)
class Pair:
    """A simulator's recording and the real one.

    Attributes:
        simulated, real: recordings under the same commands; the clocks differ.
        machine: what the simulator has.
        effect: what the real machine has more.
        offset, drift: real time = offset + (1 + drift) · simulated time.
    """

    simulated: Recording
    real: Recording
    machine: Machine
    effect: str
    offset: float
    drift: float


def drawn_pair(seed: int, kind: int | None = None) -> Pair:
    """Draw a machine, an effect (None: by the seed) and clocks, and record both."""
    draw = np.random.default_rng([29, seed])
    machine = Machine(
        inertia=7e-5 * draw.uniform(0.7, 1.5), damping=1.1e-3 * draw.uniform(0.7, 1.3),
        friction=0.012 * draw.uniform(0.7, 1.3),
        load=tuple(value * draw.uniform(0.7, 1.3) for value in (1e-3, 2e-4, 5e-6)),
        contact=draw.uniform(1.0, 4.0))
    make = HIDDEN[seed % len(HIDDEN) if kind is None else kind]
    hidden = make(draw)
    tops = tuple(draw.uniform(8.0, 22.0, 6))
    # Fast and slow strokes, as whoever compares a simulation with a bench would command.
    wanted = np.concatenate([strokes(tops[:3], RATE, 400.0, 0.3), strokes(tops[3:5], RATE, 60.0),
                             strokes(tops[5:], RATE, 12.0)])
    offset, drift = draw.uniform(-0.4, 0.4), draw.uniform(-3e-4, 3e-4)
    simulated = _recorded('simulated', machine, wanted)
    real = _recorded('real', machine, wanted, hidden, draw, offset, drift)
    return Pair(simulated, real, machine, hidden.name, offset, drift)


def table(path: Path, run: Recording) -> None:
    """Write a recording as a table."""
    assert run.reference is not None
    wanted = np.interp(run.time, run.reference.time, run.reference.position)
    np.savetxt(path, np.column_stack([run.time, run.position, run.effort, wanted]), delimiter=',',
               header='time [s],position [rad],effort [N·m],reference [rad]', comments='',
               encoding='utf-8', fmt='%.10g')


def _recorded(name: str, machine: Machine, wanted: np.ndarray, hidden: Hidden | None = None,
              draw: np.random.Generator | None = None, offset: float = 0.0,
              drift: float = 0.0) -> Recording:
    import mujoco
    model = mujoco.MjModel.from_xml_string(machine.mjcf())
    data = mujoco.MjData(model)
    inner = round(PHYSICS_RATE / RATE)
    speed = np.gradient(wanted, 1.0 / RATE)
    turn = 2.0 * math.pi / COUNTS
    rows, before = [], 0.0
    add = hidden.torque if hidden is not None else None
    for tick, (target, rate) in enumerate(zip(wanted, speed, strict=True)):
        position = float(data.qpos[0])
        if draw is not None:
            position = round(position / turn) * turn
        measured_speed = (position - before) * RATE
        before = position
        effort = (machine.gains[0] * (target - position)
                  + machine.gains[1] * (rate - measured_speed))
        data.ctrl[0] = effort
        for step in range(inner):
            if add is not None:
                assert hidden is not None
                data.qfrc_applied[0] = add(machine, hidden.memory, tick / RATE
                                           + step / PHYSICS_RATE, float(data.qpos[0]),
                                           float(data.qvel[0]), effort)
            mujoco.mj_step(model, data)
        told = effort if hidden is None or hidden.measured is None else hidden.measured(effort)
        if draw is not None:
            told += draw.normal(0.0, EFFORT_NOISE)
        rows.append((tick / RATE, position, told))
    time, position, effort = np.array(rows).T
    clock = 100.0 + offset + (1.0 + drift) * time
    # A recorder does not begin with the first command.
    first = 0 if hidden is None else LATE
    return Recording.from_samples(name, clock[first:], position[first:], effort[first:],
                                  reference=Reference(clock, wanted, speed))
