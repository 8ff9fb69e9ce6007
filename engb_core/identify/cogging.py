# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Torque periodic in the motor's angle: orders and phases found in what a fit leaves over."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from engb_core.identify.giving_up import look_whether_to_give_up
from engb_core.identify.smoothing import Motion

__all__ = ['find_orders', 'order_spectrum']

Array = NDArray[np.float64]

# Lines of a motor lie at multiples of slots and poles; higher ones a slow stroke can't resolve.
HIGHEST_ORDER = 60.0

# A line stands this much above the neighbourhood's median power, the line itself taken out: among
# some hundred orders of a noise spectrum (exponential powers) that happens once in 2000
# recordings.
LEAST_PROMINENCE = 24.0
CHANCE = 1.0 / 2000.0

# A line explains at least this part of the residual's energy: less is not worth a term.
LEAST_SHARE = 0.02


def order_spectrum(pieces: Sequence[Motion], residual: Array, orders: Array) -> Array:
    """Return how much of Σ residual² a wave of each order explains (k,) [(N·m)²].

    The wave is weakened as the residual's kernel weakens it: a wave of order k at speed ω has the
    frequency k·ω, of which a Gaussian of width w lets exp(−(k·ω·w)²/2) pass.

    Args:
        pieces: the motions.
        residual: (m,) [N·m] at all their rows, one after the other.
        orders: (k,) [cycles per motor revolution].
    """
    used = [piece for piece in pieces if piece.rows.size]
    angle = np.concatenate([piece.position[piece.rows] for piece in used])
    blur = np.concatenate([piece.kernel.width * piece.smooth_velocity[piece.rows]
                           for piece in used])
    power = np.zeros(orders.size)
    block = max(1, 200000 // angle.size)
    for first in range(0, orders.size, block):
        look_whether_to_give_up()
        some = orders[first:first + block, None]
        passed = np.exp(-0.5 * (some * blur)**2)
        sine, cosine = passed * np.sin(some * angle), passed * np.cos(some * angle)
        ss, cc = np.sum(sine**2, 1), np.sum(cosine**2, 1)
        sc, sr, cr = np.sum(sine * cosine, 1), sine @ residual, cosine @ residual
        determinant = ss * cc - sc**2
        # Too little of the wave passes the kernel: it can't be told from nothing.
        smaller = 0.5 * (ss + cc - np.sqrt((ss - cc)**2 + 4.0 * sc**2))
        seen = smaller > 1e-3 * residual.size
        energy = cc * sr**2 - 2.0 * sc * sr * cr + ss * cr**2
        power[first:first + block][seen] = energy[seen] / determinant[seen]
    return power


def find_orders(pieces: Sequence[Motion], residual: Array, at_most: int = 6) -> tuple[float, ...]:
    """Return the orders [cycles/rev] of the lines that stand out of the residual, strongest first.

    Args:
        pieces: the motions.
        residual: (m,) [N·m], the load and friction fitted out.
        at_most: lines looked for.
    """
    used = [piece for piece in pieces if piece.rows.size]
    turns = max(float(np.ptp(piece.position)) for piece in used) / (2.0 * np.pi)
    if turns < 1.0:
        return ()
    # Below some cycles per range a wave is another piece of load curve.
    lowest = max(1.0, 4.0 / turns)
    orders = np.arange(lowest, HIGHEST_ORDER, 0.25 / turns)
    # So many times does noise get the chance to look like a line, and so much (χ² of two numbers,
    # in units of the noise) has the largest of them once in 2000 recordings.
    chances = max((HIGHEST_ORDER - lowest) * turns, 1.0)
    expected = 2.0 * np.log(chances / CHANCE)
    samples = residual.size / _correlation_length(used[0])
    found: list[float] = []
    left = residual.copy()
    for _ in range(at_most):
        power = order_spectrum(used, left, orders)
        best = int(np.argmax(power))
        energy = float(left @ left)
        # Neighbours that a range of so few turns can't part: a curve misfitted, not a line.
        if (power[best] <= LEAST_SHARE * energy or power[best] >= energy
                or any(abs(orders[best] - other) < 2.0 / turns for other in found)):
            break
        fine = orders[best] + np.linspace(-0.5, 0.5, 21) * 0.5 / turns
        order = float(fine[int(np.argmax(order_spectrum(used, left, fine)))])
        # A motor's cogging is locked to its revolution: a whole number where it fits as well.
        if abs(order - round(order)) < 0.1 / turns:
            order = float(round(order))
        rest = residual - _fitted(used, residual, [*found, order])
        # Strokes show a line only where they are slow, so it has sidelobes all around: the floor
        # is what stands there once it is taken out.
        near = np.abs(orders - orders[best]) < max(6.0, 12.0 / turns)
        floor = float(np.median(order_spectrum(used, rest, orders[near])))
        gained = samples * np.log(energy / float(rest @ rest))
        if power[best] <= LEAST_PROMINENCE * floor or gained <= expected:
            break
        found.append(order)
        left = rest
    return tuple(found)


def _fitted(pieces: Sequence[Motion], residual: Array, orders: Sequence[float]) -> Array:
    """Return what waves of these orders explain of `residual` (m,)."""
    waves = np.concatenate([piece.smooth(np.stack(
        [wave(number * piece.position) for number in orders for wave in (np.sin, np.cos)])).T
        for piece in pieces])
    fitted: Array = waves @ np.linalg.lstsq(waves, residual, rcond=None)[0]
    return fitted


def _correlation_length(piece: Motion) -> float:
    """Return how many rows hold one independent value of white noise that passed the kernel."""
    spacing = piece.stride * piece.interval / piece.kernel.width
    return float(1.0 + 2.0 * np.exp(-0.25 * (spacing * np.arange(1, 20))**2).sum())
