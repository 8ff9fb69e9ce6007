# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a drive records of a run: quantised, noisy, late, doubled, lost, spiked, clipped."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from .nominal import low_pass, moving, Nominal, rms, torque_of
from .truth_plant import Run, TICK

__all__ = ['FAULTS', 'Motion', 'Recorded', 'Sensors', 'draw_sensors', 'motion_of', 'record']

FAULTS = ('glitches', 'spikes', 'bursts_lost', 'clipped_current')


@dataclass(frozen=True)
class Sensors:
    """Nuisance of one recording. Times in s, noise in N·m, rates in Hz.

    `clock`: the stamps' clock runs fast by this share. `faults`: of FAULTS.
    """

    rate: float
    counts: float
    noise: float
    colour: float
    jitter: float
    lost: float
    gaps: int
    doubled: float
    not_finite: float
    anti_alias: bool = False
    clock: float = 0.0
    faults: tuple[str, ...] = ()


@dataclass(frozen=True)
class Recorded:
    """Samples in the order of arrival: stamp and arrival [s], position, velocity, effort.

    `noise` is the effort's error at the samples taken, `counted` the low-passed torque [N·m] that
    position counts feign in the model, on the grid of 1 ms.
    """

    stamp: np.ndarray
    arrival: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    effort: np.ndarray
    noise: np.ndarray
    rate: float
    quantum: float

    def floor(self, run: Run, model: Nominal, cutoff: float = 20.0) -> float:
        """Noise floor [N·m]: of the effort and of what counts do to the model, low-passed."""
        cutoff = min(cutoff, 0.4 * self.rate)
        effort = rms(low_pass(self.noise, self.rate, cutoff))
        every = int(round(1.0 / (self.rate * TICK)))
        exact = _motion(run.time[::every], run.position[::every], run.position.size, self.rate)
        count = np.round(run.position[::every] / self.quantum) * self.quantum
        coarse = _motion(run.time[::every], count, run.position.size, self.rate)
        move = moving(run.velocity)
        feigned = low_pass(move * (torque_of(model, coarse) - torque_of(model, exact)),
                           cutoff=cutoff)[move]
        return float(np.hypot(effort, rms(feigned)))

    def on_grid(self, count: int) -> np.ndarray:
        """The effort's noise on `count` ticks of 1 ms."""
        at = np.arange(self.noise.size) * int(round(1.0 / (self.rate * TICK)))
        return np.interp(np.arange(count), at, self.noise)


@dataclass(frozen=True)
class Motion:
    """Motion on the 1 ms grid: position [rad], velocity [rad/s], acceleration [rad/s²]."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


def _motion(stamp: np.ndarray, position: np.ndarray, count: int, rate: float) -> Motion:
    grid = np.arange(count) * TICK
    told = CubicSpline(stamp, position)(np.clip(grid, stamp[0], stamp[-1])) if rate < 1000.0 \
        else np.interp(grid, stamp, position)
    smooth = low_pass(told, cutoff=min(150.0, 0.4 * rate))
    velocity = np.gradient(smooth, TICK)
    return Motion(smooth, velocity, np.gradient(velocity, TICK))


def motion_of(recorded: Recorded, count: int) -> Motion:
    """The motion that a recording tells, on `count` ticks, for what an oracle can know.

    Positions in order of time, without glitches, interpolated, low-passed without phase.
    """
    good = np.isfinite(recorded.position)
    stamp, first = np.unique(recorded.stamp[good], return_index=True)
    position = recorded.position[good][first]
    middle = np.median(np.stack([np.roll(position, k) for k in (-1, 0, 1)]), axis=0)
    middle[0], middle[-1] = position[0], position[-1]
    jump = np.abs(position - middle)
    usual = np.percentile(jump, 99) + 2.0 * recorded.quantum
    kept = jump < 10.0 * usual
    return _motion(stamp[kept], position[kept], count, recorded.rate)


def draw_sensors(rng: np.random.Generator, nasty: float = 0.17, brief: bool = False) -> Sensors:
    """Rates from 100 Hz to 1 kHz; `nasty` is the share with jitter, losses and a wrong clock."""
    faulty = rng.random() < nasty
    rates, shares = ((1000.0, 500.0, 250.0, 200.0, 125.0, 100.0),
                     (0.4, 0.2, 0.12, 0.1, 0.1, 0.08))
    rate = float(rng.choice((500.0, 250.0)) if brief else rng.choice(rates, p=shares))
    broken = rng.random() < 0.15
    return Sensors(
        rate=rate,
        counts=float(rng.choice((8192.0, 4096.0, 1024.0), p=(0.6, 0.25, 0.15))),
        noise=rng.uniform(0.0016, 0.0038),
        colour=0.0 if rng.random() < 0.6 else rng.uniform(0.2, 0.6),
        jitter=rng.uniform(2e-5, 8e-5) * 1000.0 / rate if faulty else 1e-7,
        lost=rng.uniform(0.001, 0.01) if faulty else 0.0,
        gaps=int(rng.integers(1, 6)) if faulty and rng.random() < 0.6 else 0,
        doubled=rng.uniform(0.001, 0.004) if faulty else 0.0,
        not_finite=rng.uniform(1e-4, 1e-3) if faulty and rng.random() < 0.4 else 0.0,
        anti_alias=bool(rng.random() < 0.5) and rate < 500.0,
        clock=float(rng.choice((-1e-4, 1e-4))) if faulty and rng.random() < 0.5 else 0.0,
        faults=tuple(str(x) for x in rng.choice(FAULTS, rng.integers(1, 3), replace=False))
        if broken else ())


def _coloured(sensors: Sensors, count: int, rng: np.random.Generator) -> np.ndarray:
    white = rng.normal(0.0, sensors.noise, count)
    noise, share = white.copy(), np.sqrt(1 - sensors.colour ** 2)
    for k in range(1, count):
        noise[k] = sensors.colour * noise[k - 1] + share * white[k]
    return noise


def _spoiled(columns: np.ndarray, sensors: Sensors, rng: np.random.Generator) -> np.ndarray:
    """Single samples that are wrong, and current beyond what its sensor can tell."""
    columns, count = columns.copy(), columns.shape[0]
    if 'clipped_current' in sensors.faults:
        most = rng.uniform(0.75, 0.92) * np.abs(columns[:, 3]).max()
        columns[:, 3] = np.clip(columns[:, 3], -most, most)
    if 'glitches' in sensors.faults:
        at = rng.integers(10, count - 10, rng.integers(2, 9))
        columns[at, 1] += rng.choice((-1.0, 1.0), at.size) * rng.uniform(0.5, 8.0, at.size)
    if 'spikes' in sensors.faults:
        at = rng.integers(10, count - 10, rng.integers(2, 12))
        columns[at, 3] += rng.choice((-1.0, 1.0), at.size) * rng.uniform(0.1, 0.8, at.size)
    return columns


def record(run: Run, sensors: Sensors, rng: np.random.Generator) -> Recorded:
    """Record a run as the drive would."""
    n = run.position.size
    noise, measured = _coloured(sensors, n, rng), run.effort
    if sensors.anti_alias:
        noise = low_pass(noise, cutoff=0.4 * sensors.rate)
        measured = low_pass(measured, cutoff=0.4 * sensors.rate)
    effort = np.round((measured + noise) * 4096.0) / 4096.0
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
    columns = np.stack([stamp * (1.0 + sensors.clock), position, velocity, effort[pick]], axis=1)
    columns = _spoiled(columns, sensors, rng)
    keep = rng.random(pick.size) >= sensors.lost
    lengths = [(0.005, 0.04)] * sensors.gaps
    if 'bursts_lost' in sensors.faults:
        lengths += [(0.05, 0.25)] * int(rng.integers(1, 4))
    for least, most in lengths:
        length = max(2, int(rng.uniform(least, most) * sensors.rate))
        at = rng.integers(pick.size // 20, pick.size - pick.size // 20)
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
                    effort[pick] - measured[pick], sensors.rate, quantum)
