# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""An effect that begins within the recordings: a part that breaks, slips or comes loose.

Up to its onset it does not act; from there on it acts as everywhere else. Where it may have begun
is asked by linear least squares for every moment at once: what an effect adds to the effort after
a moment needs running sums of products only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import itertools
import math

import numpy as np
from numpy.typing import NDArray

__all__ = ['Onset', 'OnsetScreen', 'onsets_tried']

Array = NDArray[np.float64]

# Values of the filtered effort that a moment must leave on both sides of it, of one recording: a
# stroke and back. Fewer tell no effect from an episode.
LEAST_VALUES = 40


@dataclass(frozen=True)
class Onset:
    """From when on an effect acts.

    Attributes:
        begins: for each recording, in seconds from its first sample: −inf where the effect acts
            throughout, inf where it never does. One of them is finite.
    """

    begins: tuple[float, ...]

    @property
    def run(self) -> int:
        """The recording within which it begins."""
        return next(run for run, begin in enumerate(self.begins) if math.isfinite(begin))

    @property
    def time(self) -> float:
        """When it begins, in seconds from the first sample of that recording."""
        return self.begins[self.run]

    def before(self, times: Sequence[Array]) -> NDArray[np.bool_]:
        """Return which of the values (m,) lie before the onset; `times` [s] are those of each
        recording's values."""
        return np.concatenate([time < begin
                               for time, begin in zip(times, self.begins, strict=True)])


def onsets_tried(times: Sequence[Array], run: int) -> list[tuple[float, ...]]:
    """Return for which recordings beside `run` an effect that begins within that one may act:
    −inf or inf for each, nan for `run` itself.

    The recordings are given in the order in which they were made, or in none: later ones may show
    it, all others, or none.
    """
    count = len(times)
    orders = {
        tuple(math.inf if other < run else -math.inf for other in range(count)),
        (-math.inf,) * count, (math.inf,) * count}
    return [tuple(math.nan if other == run else begin for other, begin in enumerate(entry))
            for entry in dict.fromkeys(
                tuple(0.0 if other == run else begin for other, begin in enumerate(order))
                for order in sorted(orders))]


class OnsetScreen:
    """What effects that begin within the recordings would take away of one fit's cost, at every
    moment at which they may begin, by linear least squares with its numbers fitted along.

    Args:
        times: each recording's times of the values, [(m_r,)…], m in all [s].
        numbers: (m, k) derivatives by what is fitted along.
        residual: (m,) what is to be explained.
        weight: (m,) of each value.
        ridge, pull: (k,) of the prior: its precision, and precision times distance.
    """

    def __init__(self, times: Sequence[Array], numbers: Array, residual: Array, weight: Array,
                 ridge: Array, pull: Array) -> None:
        self._times, self._weight, self._target = times, weight, residual * weight
        scaled = numbers * weight[:, None]
        gram = scaled.T @ scaled + np.diag(ridge + 1e-12 * np.sum(scaled ** 2, axis=0) + 1e-300)
        # Combinations of the numbers of which each is told by itself, as well as any: what is left
        # of an effect beside the numbers is then a sum of squares.
        norm = np.sqrt(np.diag(gram))
        size, axes = np.linalg.eigh(gram / norm / norm[:, None])
        told = size > size.size * np.finfo(float).eps
        whitened = axes[:, told] / np.sqrt(size[told]) / norm[:, None]
        self._numbers = scaled @ whitened
        self._right = whitened.T @ (scaled.T @ self._target + pull)
        self._floor = float(self._target @ self._target - self._right @ self._right)
        ends = np.cumsum([0, *(time.size for time in times)])
        self._rows = [slice(begin, end) for begin, end in itertools.pairwise(ends)]

    def least(self, columns: Array) -> tuple[float, Onset | None, Array]:
        """Return the least cost that an effect reaches which begins within the recordings, its
        onset (None: too short a recording), and its sizes (p,) there.

        Args:
            columns: (m, p) what the effect adds to the effort, per unit of its sizes.
        """
        effect = columns * self._weight[:, None]
        size = columns.shape[1]
        sums = [self._sums(effect[rows], rows) for rows in self._rows]
        best: tuple[float, Onset | None, Array] = (self._floor, None, np.zeros(size))
        for run, time in enumerate(self._times):
            if time.size <= 2 * LEAST_VALUES:
                continue
            tried = np.arange(LEAST_VALUES, time.size - LEAST_VALUES)
            for begins in onsets_tried(self._times, run):
                cross, own, with_target = (part[tried].copy() for part in sums[run])
                for other, begin in enumerate(begins):
                    if begin == -math.inf:
                        cross += sums[other][0][0]
                        own += sums[other][1][0]
                        with_target += sums[other][2][0]
                gain, sizes = _gains(cross, own, with_target, self._right)
                place = int(np.argmax(gain))
                if self._floor - gain[place] < best[0]:
                    moment = 0.5 * float(time[tried[place] - 1] + time[tried[place]])
                    best = (self._floor - float(gain[place]),
                            Onset(tuple(moment if other == run else begin
                                        for other, begin in enumerate(begins))), sizes[place])
        return best

    def _sums(self, effect: Array, rows: slice) -> tuple[Array, Array, Array]:
        """Return the products of an effect (m_r, p) with the numbers (m_r + 1, p, k), itself
        (m_r + 1, p, p) and the target (m_r + 1, p), summed from each value to the recording's
        end."""
        return (_from_here(effect[:, :, None] * self._numbers[rows][:, None, :]),
                _from_here(effect[:, :, None] * effect[:, None, :]),
                _from_here(effect * self._target[rows][:, None]))


def _from_here(products: Array) -> Array:
    """Return the sums from each value to the last, with that of none at the end."""
    total = np.zeros((products.shape[0] + 1, *products.shape[1:]))
    np.cumsum(products[::-1], axis=0, out=total[-2::-1])
    return total


def _gains(cross: Array, own: Array, with_target: Array, right: Array) -> tuple[Array, Array]:
    """Return what the effect takes away of the cost at each moment (t,), and its sizes (t, p), by
    the Schur complement of the numbers, which are told one by one."""
    left = own - np.einsum('tik,tjk->tij', cross, cross)
    wanted = with_target - cross @ right
    # A column that the numbers make up for altogether explains nothing.
    diagonal = np.einsum('tii->ti', own)
    left = left + 1e-9 * np.einsum('ti,ij->tij', diagonal + 1e-300, np.eye(own.shape[1]))
    sizes = wanted / left[:, 0] if own.shape[1] == 1 \
        else np.linalg.solve(left, wanted[..., None])[..., 0]
    return np.sum(sizes * wanted, axis=1), sizes
