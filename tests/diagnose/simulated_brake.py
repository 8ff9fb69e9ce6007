# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A brake on a simulated bench: closed loop, counts, noise."""

from dataclasses import replace

import numpy as np

from engb_core.bench.sensors import SensorSettings
from engb_core.bench.virtual_brake import DriveSettings, VirtualBrake
from engb_core.control.loop import LoopSettings, PositionLoop
from engb_core.control.pid import PidGains
from engb_core.control.trajectory import Trajectory, TrajectoryBuilder
from engb_core.model import Controller, EffectSetting, Friction, LoadTorque, Model
from engb_core.recording import Recording, Reference

NOMINAL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6)),
                friction=Friction(0.012, 0.11, 0.5),
                controller=Controller(0.3, 1.0, 0.004, 0.75, 1000.0))


def brake_with(effect, **parameters):
    """Return the nominal brake with one effect."""
    return replace(NOMINAL, effects=(EffectSetting(effect, parameters),))


def equal_strokes(duration, top=20.0, acceleration=80.0, speed=30.0):
    """Return strokes that are all alike: a poor excitation."""
    builder = TrajectoryBuilder().stop(0.3)
    while builder.build().duration < duration:
        builder.move(top, acceleration, speed).stop(0.3).move(0.0, acceleration, speed).stop(0.3)
    return builder.build()


def recorded(brake, setpoint, duration, name='run', seed=1, noise=0.005):
    """Return a recording of `brake` in the nominal model's loop.

    `setpoint` is a function of time [s] and measured position [rad].
    """
    gains = NOMINAL.controller
    bench = VirtualBrake(brake, DriveSettings(physics_step=1e-4), SensorSettings(
        counts_per_revolution=4096, effort_noise=noise, seed=seed))
    loop = PositionLoop(NOMINAL, LoopSettings(gains=PidGains(
        p=gains.proportional, i=gains.integral, d=gains.derivative,
        u_clamp_max=gains.effort_limit, u_clamp_min=-gains.effort_limit)))
    rows = []
    for _ in range(int(duration * gains.rate)):
        measured = bench.advance()
        wanted = setpoint(measured.time, measured.position)
        bench.command(loop.step(measured.time, measured.position, measured.velocity,
                                measured.effort, wanted))
        rows.append((*measured[:4], *wanted[:2], loop.feedforward))
    time, position, velocity, effort, *reference = np.array(rows).T
    return Recording.from_samples(name, time, position, effort, velocity,
                                  Reference(time, *reference))


def strokes_and_waves(seed: int) -> Trajectory:
    """Return strokes of all lengths and speeds, with small waves at their ends."""
    generator = np.random.default_rng(seed)
    builder = TrajectoryBuilder().stop(0.3)
    while builder.build().duration < 16.0:
        top = generator.uniform(6.0, 24.0)
        builder.move(top, 900.0, generator.uniform(8.0, 50.0)).stop(0.2)
        for _ in range(2):
            builder.move(top - generator.uniform(1.0, 4.0), 500.0, generator.uniform(4.0, 12.0))
            builder.move(top, 500.0, generator.uniform(4.0, 12.0))
        builder.move(generator.uniform(0.0, 2.0), 900.0, generator.uniform(8.0, 50.0)).stop(0.2)
    return builder.build()


LIVELY = equal_strokes(9.0, acceleration=900.0)


def lively(brake: Model, seed: int = 1) -> Recording:
    """Return a recording of fast strokes, with little noise."""
    return recorded(brake, lambda time, _: LIVELY.at(time), LIVELY.duration, seed=seed,
                    noise=0.002)
