# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Where a mismatch lies: stretches of time, and ranges of the coordinates that carry it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.diagnosis import Interval, Zone
from engb_core.diagnose.problem import Run
from engb_core.model import Model
from engb_core.physics.nominal_torque import nominal_vector
from engb_core.physics.plant import load_torques

__all__ = ['coordinates', 'intervals', 'zones']

Array = NDArray[np.float64]

# Together the reported intervals hold this part of the mismatch's energy: by definition, what a
# mismatch "lies in" is the least time that holds four fifths of it.
HELD = 0.8
# Shorter pauses in between are no pauses.
BRIDGED = 0.05       # s
BINS = 24


def coordinates(run: Run, model: Model) -> dict[str, tuple[Array, str]]:
    """Return the coordinates of each filtered value: name → ((m,), unit)."""
    motion, grid = run.motion, run.comparison.grid
    angle = 'rad' if model.joint.type == 'revolute' else 'm'
    torque = 'N·m' if model.joint.type == 'revolute' else 'N'
    nominal = nominal_vector(model)
    position = motion.position[grid]
    load = load_torques(nominal, position)
    found = {
        'position': (position, angle),
        'velocity': (motion.velocity[grid], f'{angle}/s'),
        'acceleration': (motion.acceleration[grid], f'{angle}/s²'),
        'load': (load, torque),
        'since_reversal': (_since_reversal(run), angle),
        'effort': (motion.effort[grid], torque),
        'time': (motion.time[grid], 's'),
    }
    if model.joint.type == 'revolute':
        found['motor_angle'] = (np.mod(position, 2.0 * np.pi), 'rad')
    if motion.has_disc:
        found['disc_speed'] = (motion.disc_speed[grid], 'rad/s')
        found['disc_angle'] = (np.mod(motion.disc_angle[grid], 2.0 * np.pi), 'rad')
    if motion.has_temperature:
        found['pad_temperature'] = (motion.pad_temperature[grid], '°C')
    return found


def _since_reversal(run: Run) -> Array:
    """Return the travel since the last change of direction [rad]."""
    motion = run.motion
    moving = run.comparison.weight > 0
    sign = np.where(moving, np.sign(motion.velocity), 0.0)
    held = np.maximum.accumulate(np.where(sign != 0, np.arange(sign.size), 0))
    sign = sign[held]
    turn = np.concatenate([[True], sign[1:] != sign[:-1]])
    at = motion.position[np.maximum.accumulate(np.where(turn, np.arange(sign.size), 0))]
    return np.abs(motion.position - at)[run.comparison.grid]


def intervals(run: Run, mismatch: Array, real: NDArray[np.bool_]) -> list[Interval]:
    """Return the stretches that hold the energy of `mismatch` (m,) [N·m] where there is any.

    Args:
        run: the recording.
        mismatch: (m,) [N·m].
        real: (m,) where there is a mismatch at all (false_discovery.py); nothing else is told.
    """
    time = run.motion.time[run.comparison.grid]
    step = float(np.median(np.diff(time)))
    grid = np.round((time - time[0]) / step).astype(int)
    # What can't be judged, at standstill, holds nothing.
    energy, told = np.zeros(grid[-1] + 1), np.zeros(grid[-1] + 1)
    energy[grid], told[grid] = mismatch ** 2, np.where(real, mismatch ** 2, 0.0)
    whole = energy.sum()
    there = int(np.count_nonzero(told))
    if there == 0:
        return []
    order = np.argsort(told)[::-1]
    enough = min(int(np.searchsorted(np.cumsum(told[order]), HELD * whole)) + 1, there)
    chosen = np.zeros(energy.size, bool)
    chosen[order[:enough]] = True
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(int), [0]])))
    found: list[list[int]] = []
    for begin, end in edges.reshape(-1, 2):
        if found and (begin - found[-1][1]) * step < BRIDGED:
            found[-1][1] = int(end)
        else:
            found.append([int(begin), int(end)])
    return [Interval(run.recording.name, float(time[0] + (begin - 0.5) * step),
                     float(time[0] + (end - 0.5) * step),
                     float(energy[begin:end].sum() / whole)) for begin, end in found]


def zones(runs: list[Run], mismatches: list[Array], model: Model, most: int = 4) -> list[Zone]:
    """Return the coordinate ranges in which the mismatch's energy is concentrated most.

    A range is reported if it holds at least 1.5 times the energy that its share of the time
    would; ranked by the information that the coordinate gives about where the energy is.
    """
    tables = [coordinates(run, model) for run in runs]
    names = set(tables[0]).intersection(*tables)
    energy = np.concatenate([values ** 2 for values in mismatches])
    total = energy.sum()
    if total <= 0.0:
        return []
    ranked = []
    for name in sorted(names):
        values = np.concatenate([table[name][0] for table in tables])
        edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)))
        if edges.size < 4:
            continue
        place = np.clip(np.searchsorted(edges, values, side='right') - 1, 0, edges.size - 2)
        share = np.bincount(place, energy, edges.size - 1) / total
        part = np.bincount(place, minlength=edges.size - 1) / values.size
        used = share > 0
        information = float(np.sum(share[used] * np.log(share[used] / part[used])))
        begin, end = _densest(share, part)
        held, time = share[begin:end].sum(), part[begin:end].sum()
        if held / max(time, 1e-9) >= 1.5:
            ranked.append((information, Zone(name, float(edges[begin]), float(edges[end]),
                                             tables[0][name][1], float(held))))
    ranked.sort(key=lambda entry: -entry[0])
    return [zone for _, zone in ranked[:most]]


def _densest(share: Array, part: Array) -> tuple[int, int]:
    """Return the narrowest range of bins (in time) that holds at least 60 % of the energy."""
    best = (0, share.size)
    for begin in range(share.size):
        cumulated = np.cumsum(share[begin:])
        end = int(np.searchsorted(cumulated, 0.6)) + begin + 1
        if end <= share.size and part[begin:end].sum() < part[best[0]:best[1]].sum():
            best = (begin, end)
    return best
