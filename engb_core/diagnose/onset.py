# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""An effect that begins within the recordings: a part that breaks, slips or comes loose.

Up to its onset it does not act; from there on it acts as everywhere else. Where it may have begun
is asked by linear least squares for every moment at once: what an effect adds to the effort after
a moment needs running sums of products only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

__all__ = ['Onset', 'cost_by_onset', 'onsets_tried']

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


def cost_by_onset(times: Sequence[Array], numbers: Array, columns: Array, residual: Array,
                  weight: Array, ridge: Array, pull: Array) -> tuple[float, Onset | None, Array]:
    """Return the least cost that an effect reaches which begins within the recordings, its onset
    (None: too short a recording), and its sizes (p,) there.

    Args:
        times: each recording's times of the values, [(m_r,)…], m in all [s].
        numbers: (m, k) derivatives by what is fitted along.
        columns: (m, p) what the effect adds to the effort, per unit of its sizes.
        residual: (m,) what is to be explained.
        weight: (m,) of each value.
        ridge, pull: (k,) of the prior: its precision, and precision times distance.
    """
    scaled = numbers * weight[:, None]
    effect = columns * weight[:, None]
    target = residual * weight
    gram = scaled.T @ scaled + np.diag(ridge + 1e-12 * np.sum(scaled ** 2, axis=0) + 1e-300)
    right = scaled.T @ target + pull
    inverse = np.linalg.pinv(gram, hermitian=True)
    floor = float(target @ target - right @ inverse @ right)
    ends = np.cumsum([0, *(time.size for time in times)])
    size = columns.shape[1]
    # Products of each value, summed from it to the recording's end: (m_r + 1, …).
    sums = []
    for begin, end in zip(ends[:-1], ends[1:], strict=True):
        rows = slice(begin, end)
        cross = np.einsum('mi,mj->mij', effect[rows], scaled[rows])
        own = np.einsum('mi,mj->mij', effect[rows], effect[rows])
        with_target = effect[rows] * target[rows, None]
        sums.append(tuple(_from_here(part) for part in (cross, own, with_target)))
    best: tuple[float, Onset | None, Array] = (floor, None, np.zeros(size))
    for run, time in enumerate(times):
        if time.size <= 2 * LEAST_VALUES:
            continue
        tried = np.arange(LEAST_VALUES, time.size - LEAST_VALUES)
        for begins in onsets_tried(times, run):
            cross, own, with_target = (part[tried].copy() for part in sums[run])
            for other, begin in enumerate(begins):
                if begin == -math.inf:
                    cross += sums[other][0][0]
                    own += sums[other][1][0]
                    with_target += sums[other][2][0]
            gain, sizes = _gains(cross, own, with_target, np.asarray(inverse, float), right)
            place = int(np.argmax(gain))
            if floor - gain[place] < best[0]:
                moment = 0.5 * float(time[tried[place] - 1] + time[tried[place]])
                best = (floor - float(gain[place]),
                        Onset(tuple(moment if other == run else begin
                                    for other, begin in enumerate(begins))), sizes[place])
    return best


def _from_here(products: Array) -> Array:
    """Return the sums from each value to the last, with that of none at the end."""
    total = np.cumsum(products[::-1], axis=0)[::-1]
    return np.concatenate([total, np.zeros((1, *products.shape[1:]))])


def _gains(cross: Array, own: Array, with_target: Array, inverse: Array, right: Array,
           ) -> tuple[Array, Array]:
    """Return what the effect takes away of the cost at each moment (t,), and its sizes (t, p), by
    the Schur complement of the numbers."""
    through = cross @ inverse
    left = own - np.einsum('tik,tjk->tij', through, cross)
    wanted = with_target - through @ right
    # A column that the numbers make up for altogether explains nothing.
    diagonal = np.einsum('tii->ti', own)
    left = left + 1e-9 * np.einsum('ti,ij->tij', diagonal + 1e-300, np.eye(own.shape[1]))
    sizes = np.linalg.solve(left, wanted[..., None])[..., 0]
    return np.sum(sizes * wanted, axis=1), sizes
