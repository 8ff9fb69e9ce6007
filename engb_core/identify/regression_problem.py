# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The regression's problem: what is looked for, its residual and its derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.identify.confidence import Estimate
from engb_core.identify.giving_up import look_whether_to_give_up
from engb_core.identify.smoothing import Motion

__all__ = ['Form', 'load_torque', 'Problem']

Array = NDArray[np.float64]

# A current loop and a sampled drive put torque and position this far apart at most [s].
LONGEST_LAG = 0.01


@dataclass(frozen=True)
class Form:
    """What the regression looks for.

    `load` 'polynomial' (of `degree`, with or without a `contact` angle) or 'sinusoid';
    `orders` of the cogging [cycles/rev]; `held` names of numbers kept at the start's value;
    `turning` the recording in which the disc turns, '' for none: its load is that of the others
    times 1 − (1 − load_ratio)·v(θ), with `slope` the coefficients of the polynomial v, the wedge's
    mean slope over its slope at θ.
    """

    load: str = 'polynomial'
    degree: int = 3
    contact: bool = False
    orders: tuple[float, ...] = ()
    held: frozenset[str] = frozenset()
    turning: str = ''
    slope: tuple[float, ...] = (1.0,)

    @property
    def names(self) -> tuple[str, ...]:
        """All numbers of the form, in the regression's order."""
        load = ['amplitude', 'phase']
        if self.load == 'polynomial':
            # A load that begins at a contact begins at zero: no p0.
            load = [f'p{power}' for power in range(int(self.contact), self.degree + 1)]
            load += ['contact_angle'] * self.contact
        waves = [f'{kind}{number}' for number in range(len(self.orders))
                 for kind in ('sine', 'cosine')]
        return ('inertia', 'viscous_friction', 'lag', *load, 'coulomb', 'load_gain',
                'saturation_velocity', *waves, *(['load_ratio'] if self.turning else []))

    def units(self) -> dict[str, str]:
        """Return the unit of each number."""
        fixed = {'inertia': 'kg·m²', 'viscous_friction': 'N·m·s/rad', 'lag': 's', 'coulomb': 'N·m',
                 'load_gain': '-', 'load_ratio': '-', 'saturation_velocity': 'rad/s',
                 'contact_angle': 'rad', 'phase': 'rad', 'p0': 'N·m', 'p1': 'N·m/rad'}
        return {name: fixed.get(name) or (f'N·m/rad^{name[1:]}' if name[0] == 'p' else 'N·m')
                for name in self.names}


class Problem:
    """Residual and Jacobian of one form over several motions."""

    def __init__(self, pieces: Sequence[Motion], form: Form,
                 prior: Mapping[str, Estimate] | None = None, size: float = 1.0) -> None:
        self.pieces = [piece for piece in pieces if piece.rows.size]
        self.form = form
        self.measured = [piece.smooth(piece.effort) for piece in self.pieces]
        self.inertial = [piece.smooth_acceleration[piece.rows] for piece in self.pieces]
        # The recorded torque acted `lag` later: u(t − lag) = u − lag·u̇, so the model must match u
        # with lag·u̇ on its own side.
        self.change = [piece.kernel.apply(piece.effort, 1)[piece.rows] for piece in self.pieces]
        self.viscous = [piece.smooth_velocity[piece.rows] for piece in self.pieces]
        places, begin = [], 0
        for piece in self.pieces:
            places.append(begin + piece.rows // piece.stride)
            # Room, so that no correlation is counted from one piece to the next.
            begin = int(places[-1][-1]) + 1000
        self.rows = sum(place.size for place in places)
        self.prior = [(form.names.index(name), entry.value, size / entry.std)
                      for name, entry in (prior or {}).items()]
        # Each known number is one more row, on its own.
        places += [np.array([begin + 1000 * number]) for number in range(len(self.prior))]
        self.place = np.concatenate(places)
        self.reach = max(float(np.abs(piece.position).max()) for piece in self.pieces)
        self.speed = max(piece.top_speed for piece in self.pieces)
        # White noise through a Gaussian of width w is correlated as exp(−t²/4w²).
        first = self.pieces[0]
        spacing = first.stride * first.interval / first.kernel.width
        self.least_correlation = np.exp(-0.25 * (spacing * np.arange(6))**2)
        self._wave_tables: dict[int, Array] = {}
        self._last: tuple[Array, tuple[Array, Array]] | None = None

    def units_of_size(self) -> Array:
        """Return for each number the size that moves the torque by about 1 N·m (p,)."""
        acceleration = np.std(np.concatenate(self.inertial)) + 1e-12
        size = {'inertia': 1.0 / acceleration, 'viscous_friction': 1.0 / self.speed,
                'lag': 1.0 / (np.std(np.concatenate(self.change)) + 1e-12),
                'saturation_velocity': self.speed, 'contact_angle': self.reach}
        return np.array([size.get(name) or (self.reach ** -float(name[1:])
                                            if name[0] == 'p' and name[1:].isdigit() else 1.0)
                         for name in self.form.names])

    def bounds(self) -> tuple[Array, Array]:
        """Return lower and upper bounds (p,) each."""
        # Losses are losses: no friction pushes, and none falls as the load grows.
        low = {'inertia': 1e-12, 'viscous_friction': 0.0, 'coulomb': 0.0, 'load_gain': 0.0,
               'amplitude': 0.0, 'load_ratio': 0.0, 'lag': -LONGEST_LAG,
               'saturation_velocity': 1e-3 * self.speed,
               'contact_angle': min(float(piece.position.min()) for piece in self.pieces)}
        if self.form.contact:
            # What is touched pushes back, from the first touch on.
            low['p1'] = 0.0
        high = {'saturation_velocity': self.speed, 'lag': LONGEST_LAG,
                'contact_angle': max(float(piece.position.max()) for piece in self.pieces)}
        return (np.array([low.get(name, -np.inf) for name in self.form.names]),
                np.array([high.get(name, np.inf) for name in self.form.names]))

    def evaluate(self, values: Array) -> tuple[Array, Array]:
        """Return modelled less measured torque (m,) and its derivative by `values` (m, p)."""
        look_whether_to_give_up()
        if self._last is not None and np.array_equal(self._last[0], values):
            return self._last[1]
        named = dict(zip(self.form.names, values, strict=True))
        residuals, tables = [], []
        for piece, measured, change, inertial, viscous in zip(
                self.pieces, self.measured, self.change, self.inertial, self.viscous,
                strict=True):
            smooth = piece.smooth(self._pointwise(piece, named))
            residuals.append(named['inertia'] * inertial + named['viscous_friction'] * viscous
                             + named['lag'] * change + smooth[0] - measured)
            tables.append(np.column_stack([inertial, viscous, change, smooth[1:].T]))
        for index, known, weight in self.prior:
            residuals.append(np.array([weight * (values[index] - known)]))
            tables.append(weight * np.eye(1, values.size, index))
        result = np.concatenate(residuals), np.concatenate(tables)
        self._last = values.copy(), result
        return result

    def _pointwise(self, piece: Motion, named: dict[str, float]) -> Array:
        """Return load + friction + cogging and below it its derivatives (p − 2, n)."""
        load, slopes = load_torque(self.form, named, piece.position, piece.powers)
        form = self.form
        by_ratio = np.zeros(0)
        if form.turning and piece.name == form.turning:
            wedge = np.polynomial.polynomial.polyval(piece.position, form.slope)
            by_ratio, factor = wedge * load, 1.0 - (1.0 - named['load_ratio']) * wedge
            load, slopes = factor * load, factor * slopes
        ratio = piece.velocity / named['saturation_velocity']
        shape = np.clip(ratio, -1.0, 1.0)
        size = named['coulomb'] + named['load_gain'] * np.abs(load)
        below = np.where(np.abs(ratio) < 1.0, -ratio, 0.0)
        waves = self.waves(piece)
        table = np.zeros((1 + len(slopes) + 3 + len(waves) + bool(form.turning),
                          piece.time.size))
        carried = 1.0 + named['load_gain'] * np.sign(load) * shape
        table[0] = load + size * shape
        table[1:1 + len(slopes)] = slopes * carried
        table[1 + len(slopes):4 + len(slopes)] = (
            shape, np.abs(load) * shape, size * below / named['saturation_velocity'])
        if by_ratio.size:
            table[-1] = by_ratio * carried
        if len(waves):
            table[4 + len(slopes):4 + len(slopes) + len(waves)] = waves
            for number in range(len(form.orders)):
                table[0] += (named[f'sine{number}'] * waves[2 * number]
                             + named[f'cosine{number}'] * waves[2 * number + 1])
        return table

    def waves(self, piece: Motion) -> Array:
        """Return sine and cosine of each cogging order at the piece's samples (2·orders, n)."""
        key = id(piece)
        if key not in self._wave_tables:
            self._wave_tables[key] = np.array(
                [wave(order * piece.position) for order in self.form.orders
                 for wave in (np.sin, np.cos)])
        return self._wave_tables[key]


def load_torque(form: Form, named: dict[str, float], position: Array,
                powers: Array | None = None) -> tuple[Array, Array]:
    """Return T_L (n,) [N·m] and its derivatives by the load's numbers (k, n).

    Args:
        form: of the load.
        named: its numbers.
        position: (n,) [rad].
        powers: (≥ degree + 1, n) position^0 …, where they are at hand.
    """
    if form.load == 'sinusoid':
        angle = position + named['phase']
        wave = np.sin(angle)
        return (named['amplitude'] * wave,
                np.stack([wave, named['amplitude'] * np.cos(angle)]))
    first = int(form.contact)
    numbers = np.array([named[f'p{power}'] for power in range(first, form.degree + 1)])
    if not form.contact:
        if powers is None:
            powers = position ** np.arange(form.degree + 1)[:, None]
        basis = powers[:form.degree + 1]
        return numbers @ basis, basis
    beyond = np.maximum(position - named['contact_angle'], 0.0)
    basis = np.cumprod(np.broadcast_to(beyond, (form.degree, beyond.size)), axis=0)
    # d/ds Σ p_k·s^k = Σ k·p_k·s^(k−1)
    slope = (numbers[0] + (numbers[1:] * np.arange(2, form.degree + 1)) @ basis[:-1]) * (
        beyond > 0.0)
    return numbers @ basis, np.vstack([basis, -slope])
