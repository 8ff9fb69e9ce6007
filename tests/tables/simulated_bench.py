# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Tables of a simulated bench, with a plant of its own: no formula of the library is used.

A motor under a PD loop, stepped at 10 kHz with set-valued friction, an encoder that counts, and a
noisy current; each table hides one effect and is written as another bench would write it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
import math
from pathlib import Path

import numpy as np

__all__ = ['TABLES', 'BenchTable', 'rows_of', 'write_table']

STEP, DURATION = 1e-4, 16.0
TORQUE_CONSTANT = 0.05


@dataclass(frozen=True)
class BenchTable:
    """A table: what it hides (None: nothing), how it is written, and what has to be said."""

    effect: str | None
    write: Callable[[Path, dict[str, np.ndarray]], None]
    name: str
    every: int                      # plant steps a sample
    said: tuple[str, ...] = ('--torque-constant', '0.05')

    @property
    def questions(self) -> int:
        """How many things the table doesn't tell."""
        return sum(1 for word in self.said if not word.startswith('--'))

    def sampled(self, seed: int) -> dict[str, np.ndarray]:
        """Simulate; returns t [s], phi [rad] and i [A] as the bench records them."""
        return sampled(self.effect, self.every, seed)


def run(effect: str | None, seed: int) -> dict[str, np.ndarray]:
    """Simulate; returns t [s], phi [rad], i [A] at every plant step."""
    rng = np.random.default_rng(seed)
    inertia, viscous, coulomb = 2e-4 * rng.uniform(0.8, 1.2), 1.2e-3, 0.02 * rng.uniform(0.8, 1.2)
    gravity = 0.08 if effect == 'load_dependent_friction' else 0.0
    waves = list(zip((11.0, 4.0, 1.5), rng.uniform(0.9, 1.1, 3) * (0.23, 0.67, 1.7),
                     rng.uniform(0, 6.28, 3), strict=True))
    count = int(DURATION / STEP)
    out = np.zeros((3, count))
    angle = speed = bristle = 0.0
    delay = [0.0] * 80
    for k in range(count):
        t = k * STEP
        goal = sum(a * math.sin(6.2832 * f * t + p) - a * math.sin(p) for a, f, p in waves)
        rate = sum(6.2832 * a * f * math.cos(6.2832 * f * t + p) for a, f, p in waves)
        asked = max(-0.6, min(0.6, 0.6 * (goal - angle) + 0.02 * (rate - speed)))
        given = asked
        if effect == 'actuation_lag':
            delay.append(asked)
            given = delay.pop(0)
        if effect == 'torque_saturation':
            given = 0.4 * math.tanh(asked / 0.4)
        other = gravity * math.sin(angle)
        if effect == 'cogging_torque':
            other += 0.012 * math.sin(7.0 * angle + 0.4)
        if effect == 'nonlinear_viscous_friction':
            other += 6e-5 * speed * abs(speed)
        level, drag = coulomb, viscous
        if effect == 'stribeck_friction':
            level *= 1.0 + 1.2 / (1.0 + (speed / 3.0) ** 2)
        if effect == 'asymmetric_friction':
            # Drag as well: of dry friction alone, without a load, it would be an offset.
            level *= 1.35 if speed > 0 else 0.65
            drag *= 1.35 if speed > 0 else 0.65
        if effect == 'friction_drift':
            level *= 1.8 - 1.0 * (1.0 - math.exp(-t / 6.0))
        if effect == 'load_dependent_friction':
            level += 0.35 * abs(other)
        if effect == 'presliding_friction':
            bristle += STEP * (speed - abs(speed) * bristle / 0.6)
            speed += STEP * (given - drag * speed - other - level * bristle / 0.6) / inertia
        else:
            free = speed + STEP * (given - drag * speed - other) / inertia
            limit = STEP * level / inertia
            speed = 0.0 if abs(free) <= limit else free - math.copysign(limit, free)
        angle += speed * STEP
        out[:, k] = t, angle, asked / TORQUE_CONSTANT
    return {'t': out[0], 'phi': out[1], 'i': out[2]}


def sampled(effect: str | None, every: int, seed: int) -> dict[str, np.ndarray]:
    """Return what the bench records: counts, noise, every so many steps."""
    whole = run(effect, seed)
    rng = np.random.default_rng(seed + 1000)
    found = {name: values[::every] for name, values in whole.items()}
    found['phi'] = np.round(found['phi'] / (2 * np.pi) * 8192) / 8192 * 2 * np.pi
    found['i'] = found['i'] + rng.normal(0.0, 0.02, found['i'].size)
    return found


def write_table(table: BenchTable, folder: Path, seed: int = 0) -> Path:
    """Simulate and write a table; returns its path."""
    path = folder / table.name
    table.write(path, table.sampled(seed))
    return path


def rows_of(columns: list, forms: str, delimiter: str) -> str:
    """Return a line for each row, its numbers in one form or each in its own."""
    parts = forms.split()
    parts *= len(columns) // len(parts)
    return ''.join(delimiter.join(form % value for form, value in zip(parts, row, strict=True))
                   + '\n' for row in zip(*columns, strict=True))


def _rows(path: Path, titles: str, columns: list, form: str, delimiter: str = ',',
          comma: bool = False, encoding: str = 'utf-8') -> None:
    text = rows_of(columns, form, delimiter)
    path.write_text(titles + (text.replace('.', ',') if comma else text), encoding=encoding)


def _german(path, run):
    _rows(path, 'Pruefstand 7; Müller\nDatum: 23.11.2026\n\nZeit [s];Drehwinkel [°];Strom [A]\n',
          [run['t'], np.rad2deg(run['phi']), run['i']], '%.5f', ';', True, 'cp1252')


def _plain(path, run):
    _rows(path, 't,angle,current\n', [run['t'], np.rad2deg(run['phi']), run['i']], '%.5f')


def _millis(path, run):
    _rows(path, 'time_ms\tpos_deg\tiq_A\n', [1e3 * run['t'], np.rad2deg(run['phi']), run['i']],
          '%.5f', '\t')


def _din(path, run):
    _rows(path, 't/s;phi/rad;n/min⁻¹;I/mA\n',
          [run['t'], run['phi'], np.gradient(run['phi'], run['t']) * 9.5493, 1e3 * run['i']],
          '%.6f', ';')


def _nanos(path, run):
    _rows(path, 'timestamp,motor_position [rev],motor_current [A]\n',
          [1.7e18 + np.round(1e9 * run['t']), run['phi'] / (2 * np.pi), run['i']], '%.6f')


def _iso(path, run):
    start = datetime(2026, 11, 23, 10, 15, 0)
    lines = ['# bench 3, run 12', 'Timestamp,Position (deg),Torque (mNm)']
    for t, phi, i in zip(run['t'], run['phi'], run['i'], strict=True):
        stamp = (start + timedelta(seconds=float(t))).isoformat(timespec='microseconds')
        lines.append(f'{stamp},{math.degrees(phi):.5f},{1e3 * TORQUE_CONSTANT * i:.4f}')
    path.write_text('\n'.join(lines) + '\n', encoding='utf-8')


def _units_below(path, run):
    _rows(path, 'Time,Reference,ActPos,I_d,I_q\ns,deg,deg,A,A\n',
          [run['t'], np.rad2deg(run['phi']) + 1.0, np.rad2deg(run['phi']), 0 * run['i'],
           run['i']], '%.6f')


def _counts(path, run):
    _rows(path, 't [us];encoder [counts];torque [Nm]\n',
          [1e6 * run['t'], np.round(run['phi'] / (2 * np.pi) * 8192), TORQUE_CONSTANT * run['i']],
          '%.6f', ';')


def _juggler(path, run):
    _rows(path, '__time,/drive/position_deg,/drive/current_A\n',
          [1.7e9 + run['t'], np.rad2deg(run['phi']), run['i']], '%.6f')


def _mat(path, run):
    from scipy.io import savemat
    savemat(path, {'log': {'t_s': run['t'], 'q_deg': np.rad2deg(run['phi']), 'i_A': run['i']}})


TABLES = (
    BenchTable(None, _german, 'clean.csv', 10),
    BenchTable('stribeck_friction', _plain, 'stribeck.csv', 10,
               ('--torque-constant', '0.05', '--unit', 'position=deg')),
    BenchTable('asymmetric_friction', _millis, 'asymmetric.txt', 20),
    BenchTable('cogging_torque', _din, 'cogging.csv', 10),
    BenchTable('nonlinear_viscous_friction', _nanos, 'drag.csv', 20),
    BenchTable('friction_drift', _iso, 'drift.csv', 10, ()),
    BenchTable('actuation_lag', _units_below, 'lag.csv', 10),
    BenchTable('torque_saturation', _counts, 'saturation.csv', 10,
               ('--unit', 'position=8192/rev')),
    BenchTable('load_dependent_friction', _juggler, 'load.csv', 40),
    BenchTable('presliding_friction', _mat, 'presliding.mat', 10),
)
