"""What a drive records of a run: quantised, noisy, late, doubled, lost."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .nominal import low_pass, rms
from .truth_plant import Run, TICK

__all__ = ['Motion', 'Recorded', 'Sensors', 'draw_sensors', 'motion_of', 'record']


@dataclass(frozen=True)
class Sensors:
    """Nuisance of one recording. Times in s, noise in N·m, rates in Hz."""

    rate: float
    counts: float
    noise: float
    colour: float
    jitter: float
    lost: float
    gaps: int
    doubled: float
    not_finite: float


@dataclass(frozen=True)
class Recorded:
    """Samples in the order of arrival: stamp and arrival [s], position, velocity, effort.

    `noise` is the effort's error on the 1 ms grid, `floor` its rms when low-passed.
    """

    stamp: np.ndarray
    arrival: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    effort: np.ndarray
    noise: np.ndarray

    def floor(self, cutoff: float = 20.0) -> float:
        """Low-passed noise floor of the effort [N·m]."""
        return rms(low_pass(self.noise, cutoff=cutoff))


@dataclass(frozen=True)
class Motion:
    """Motion on the 1 ms grid: position [rad], velocity [rad/s], acceleration [rad/s²]."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


def motion_of(recorded: Recorded, count: int, cutoff: float = 150.0) -> Motion:
    """The motion that a recording tells, on `count` ticks, for what an oracle can know.

    Positions in order of time, interpolated, low-passed without phase, differenced.
    """
    good = np.isfinite(recorded.position)
    stamp, first = np.unique(recorded.stamp[good], return_index=True)
    grid = np.arange(count) * TICK
    position = low_pass(np.interp(grid, stamp, recorded.position[good][first]), cutoff=cutoff)
    velocity = np.gradient(position, TICK)
    return Motion(position, velocity, np.gradient(velocity, TICK))


def draw_sensors(rng: np.random.Generator) -> Sensors:
    """Mostly good recordings; one in six with jitter, losses, doubles or bad numbers."""
    faulty = rng.random() < 0.17
    return Sensors(
        rate=1000.0 if rng.random() < 0.8 else 500.0,
        counts=8192.0 if rng.random() < 0.65 else 4096.0,
        noise=rng.uniform(0.0016, 0.0038),
        colour=0.0 if rng.random() < 0.6 else rng.uniform(0.2, 0.6),
        jitter=rng.uniform(2e-5, 8e-5) if faulty else 1e-7,
        lost=rng.uniform(0.001, 0.01) if faulty else 0.0,
        gaps=int(rng.integers(1, 6)) if faulty and rng.random() < 0.6 else 0,
        doubled=rng.uniform(0.001, 0.004) if faulty else 0.0,
        not_finite=rng.uniform(1e-4, 1e-3) if faulty and rng.random() < 0.4 else 0.0,
    )


def record(run: Run, sensors: Sensors, rng: np.random.Generator) -> Recorded:
    """Record a run as the drive would."""
    n = run.position.size
    white = rng.normal(0.0, sensors.noise, n)
    noise = white.copy()
    for k in range(1, n):
        noise[k] = sensors.colour * noise[k - 1] + np.sqrt(1 - sensors.colour ** 2) * white[k]
    effort = np.round((run.effort + noise) * 4096.0) / 4096.0
    quantum = 2.0 * np.pi / sensors.counts
    every = int(round(1.0 / (sensors.rate * TICK)))
    pick = np.arange(0, n, every)
    stamp = pick * TICK + rng.normal(0.0, sensors.jitter, pick.size)
    stamp[0] = 0.0
    stamp = np.maximum.accumulate(np.maximum(stamp, 0.0))
    seen = np.interp(stamp, run.time, run.position)
    position = np.round(seen / quantum) * quantum
    counts = np.round(run.position / quantum) * quantum
    speed, filtered = np.diff(counts, prepend=counts[0]) / TICK, np.empty(n)
    state = 0.0
    for k in range(n):
        state += 0.412 * (speed[k] - state)
        filtered[k] = state
    velocity = np.round(filtered[pick] * 128.0) / 128.0
    columns = np.stack([stamp, position, velocity, effort[pick]], axis=1)
    keep = rng.random(pick.size) >= sensors.lost
    for _ in range(sensors.gaps):
        at, length = rng.integers(2000, pick.size - 2000), rng.integers(5, 40)
        keep[at:at + length] = False
    keep[0] = True
    columns = columns[keep]
    bad = rng.random(columns.shape[0]) < sensors.not_finite
    bad[0] = False
    columns[bad, rng.integers(1, 4, bad.sum())] = np.nan
    columns = np.vstack([columns, columns[rng.random(columns.shape[0]) < sensors.doubled]])
    late = 4e-4 + rng.exponential(2.5e-4, columns.shape[0])
    late = np.minimum(late, 0.01)
    order = np.argsort(columns[:, 0] + late, kind='stable')
    columns, arrival = columns[order], (columns[:, 0] + late)[order]
    return Recorded(columns[:, 0], arrival, columns[:, 1], columns[:, 2], columns[:, 3],
                    effort - run.effort)
