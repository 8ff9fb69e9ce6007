# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the benchmarks share: a brake with effects on a simulated bench, clocks, memory."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import sys
import time

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from engb_core.bench.sensors import SensorSettings  # noqa: E402
from engb_core.bench.virtual_brake import DriveSettings, VirtualBrake  # noqa: E402
from engb_core.control.loop import LoopSettings, PositionLoop  # noqa: E402
from engb_core.control.pid import PidGains  # noqa: E402
from engb_core.control.trajectory import Trajectory, TrajectoryBuilder  # noqa: E402
from engb_core.model import Controller, EffectSetting, Friction, LoadTorque, Model  # noqa: E402
from engb_core.recording import Recording, Reference  # noqa: E402

__all__ = ['NOMINAL', 'PAIR', 'ROOT', 'peak_memory', 'recorded', 'Stopwatch', 'strokes']

# The paper's plant with a load curve and friction as identified on it.
NOMINAL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6)),
                friction=Friction(0.012, 0.11, 0.3),
                controller=Controller(0.3, 1.0, 0.004, 0.75, 1000.0))
# A pair of effects that a diagnosis has to find together.
PAIR = (EffectSetting('stribeck_friction', {'breakaway_ratio': 1.8, 'stribeck_velocity': 2.5}),
        EffectSetting('load_hysteresis', {'hysteresis_ratio': 0.09}))


def strokes(duration: float) -> Trajectory:
    """Return strokes of several heights and speeds, with stops, over at least `duration` [s]."""
    builder = TrajectoryBuilder().stop(0.3)
    tops, speeds = (20.0, 12.0, 18.0, 8.0, 15.0), (30.0, 8.0, 20.0, 3.0)
    turn = 0
    while builder.build().duration < duration:
        top, speed = tops[turn % len(tops)], speeds[turn % len(speeds)]
        builder.move(top, 80.0, speed).stop(0.25).move(0.0, 80.0, speed).stop(0.25)
        turn += 1
    return builder.build()


def recorded(duration: float, effects: tuple[EffectSetting, ...] = PAIR, seed: int = 1,
             name: str = 'run') -> Recording:
    """Return a 1 kHz recording of the nominal brake with `effects`, in the nominal loop."""
    gains = NOMINAL.controller
    brake = VirtualBrake(replace(NOMINAL, effects=effects), DriveSettings(),
                         SensorSettings(counts_per_revolution=4096, effort_noise=0.004,
                                        seed=seed))
    loop = PositionLoop(NOMINAL, LoopSettings(gains=PidGains(
        p=gains.proportional, i=gains.integral, d=gains.derivative,
        u_clamp_max=gains.effort_limit, u_clamp_min=-gains.effort_limit)))
    setpoint = strokes(duration)
    rows = []
    for _ in range(round(duration * gains.rate)):
        measured = brake.advance()
        wanted = setpoint.at(measured.time)
        brake.command(loop.step(measured.time, measured.position, measured.velocity,
                                measured.effort, wanted))
        rows.append((*measured[:4], *wanted[:2], loop.feedforward))
    time_, position, velocity, effort, *reference = np.array(rows).T
    return Recording.from_samples(name, time_, position, effort, velocity,
                                  Reference(time_, *reference))


class Stopwatch:
    """Wall and processor seconds of a block: `with Stopwatch() as watch: …`."""

    def __enter__(self) -> Stopwatch:
        self._wall, self._processor = time.perf_counter(), time.process_time()
        return self

    def __exit__(self, *unused: object) -> None:
        self.wall = time.perf_counter() - self._wall
        self.processor = time.process_time() - self._processor


def peak_memory() -> float:
    """Return the most memory that this process has had [MiB] (a child inherits ru_maxrss)."""
    for line in Path('/proc/self/status').read_text().splitlines():
        if line.startswith('VmHWM'):
            return int(line.split()[1]) / 1024
    return float('nan')
