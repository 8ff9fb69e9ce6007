# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How well columns predict what was left out: blocks of time, recordings, kinds of motion.

Everything comes from sums of products over each block, so that thousands of candidate columns,
each with all free numbers fitted anew without the block, cost little more than one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
import itertools

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.optimise.fit import Fit, Fitter

__all__ = ['HEARD', 'Blocks', 'Score', 'derivatives_of', 'kinds_of_motion', 'noise_by_block',
           'numbers_and_sizes', 'stretches_of_time']

Array = NDArray[np.float64]
Labels = NDArray[np.int64]
Sums = tuple[Array, Array, Array]

# Parts of the recordings that are left out in turn.
PARTS = 6
# A stretch that has one kind of motion [s].
STRETCH = 2.0
_RELATIVE_RIDGE, _LEAST = 1e-9, 1e-10
# Weight with which a block that is left out still tells the model's own numbers where a law is
# judged. A number that all other blocks tell ten times less well than this one alone is not
# tested by them: without the block it runs away (a cubic load curve at the end of the stroke), and
# what it then misses would outweigh all that a law explains.
HEARD = 0.1


@dataclass(frozen=True)
class Score:
    """Squared errors of what was left out, by block (k,), in units of the noise's; the sizes of
    the columns fitted to everything, and by how much the free numbers move along (count,)."""

    by_block: Array
    sizes: Array
    moved: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def level(self) -> float:
        """Mean squared error of what was left out (noise = 1)."""
        return float(self.by_block.sum())


class Blocks:
    """The least squares of one fit, block by block.

    Args:
        fitter: weighs the values.
        fit: finished; its residual is to be explained.
        labels: (m,) block of each value.
        free: entries of the fit's vector that stay free (None: all).
        sizes: entries that stay free, of which a left-out block says nothing in any case.
        heard: weight with which it still tells the others (`HEARD`, or 0: not at all).
    """

    def __init__(self, fitter: Fitter, fit: Fit, labels: Labels,
                 free: Sequence[int] | None = None, sizes: Sequence[int] = (),
                 heard: float = 0.0) -> None:
        numbers = [entry for entry in (range(fit.hypothesis.size) if free is None else free)
                   if entry not in sizes]
        entries = [*numbers, *sizes]
        self._count, self._heard = len(numbers), heard
        columns = derivatives_of(fit)[:, entries]
        weight = fitter.weight
        rows = [np.flatnonzero((labels == label) & (weight > 0.0)) for label in np.unique(labels)]
        rows = [of_block for of_block in rows if of_block.size]
        # Values in the order of their blocks, each of them a stretch; a column's values side by
        # side, so that sums over them run through memory once.
        self._order = np.concatenate(rows) if rows else np.zeros(0, np.int64)
        ends = np.cumsum([0, *(of_block.size for of_block in rows)])
        self._blocks = [slice(begin, end) for begin, end in itertools.pairwise(ends)]
        self._weight = weight[self._order]
        self._noise = float(np.sum((fitter.sigma * weight) ** 2))
        columns = np.ascontiguousarray(columns[self._order].T) * self._weight
        norm = np.sqrt(np.sum(columns ** 2, axis=1))
        norm[norm == 0.0] = 1.0
        columns /= norm[:, None]
        self._norm = norm[:self._count]
        self._nuisance, self._sizes = np.split(columns, [self._count])
        self._target = fit.residual[self._order] * self._weight
        spread = fit.hypothesis.prior[1][entries]
        ridge = 1.0 / (spread * norm) ** 2 + _RELATIVE_RIDGE
        self._ridge, self._ridge_of_sizes = ridge[:self._count], ridge[self._count:]
        parts = [(self._nuisance[:, block], self._target[block]) for block in self._blocks]
        self._gram = [part @ part.T for part, _ in parts]
        self._right = [part @ target for part, target in parts]
        self._squares = [float(target @ target) for _, target in parts]
        self._whole = np.sum(self._gram, axis=0)
        self._whole_right = np.sum(self._right, axis=0)

    def without(self) -> Score:
        """Return the score of the free numbers and sizes alone."""
        sums = self._products(self._sizes[None])
        errors, _, _ = self._left_out(sums, self._ridge_of_sizes)
        return Score(errors[:, 0] / self._noise, np.zeros(0))

    def scores(self, columns: list[Array]) -> list[Score]:
        """Return the score of each candidate (m, 1) or (m, 2), fitted without each block."""
        if not columns:
            return []
        found: dict[int, Score] = {}
        for width in {column.shape[1] for column in columns}:
            places = [place for place, column in enumerate(columns) if column.shape[1] == width]
            columns_of_width = np.stack([columns[place].T[:, self._order] for place in places])
            found.update(zip(places, self._scored(columns_of_width), strict=True))
        return [found[place] for place in range(len(columns))]

    def _scored(self, columns: Array) -> list[Score]:
        """Columns (k, q, m) of k candidates, which are overwritten."""
        columns *= self._weight
        sums = self._products(columns)
        norm = np.sqrt(np.sum([np.trace(own, axis1=1, axis2=2) for _, own, _ in sums], axis=0))
        good = np.isfinite(norm) & (norm > 0.0)
        part = np.where(good, 1.0 / np.where(good, norm, 1.0), 0.0)
        sums = [(np.where(good[:, None], cross, 0.0) * part[:, None],
                 np.where(good[:, None, None], own, 0.0) * part[:, None, None] ** 2,
                 np.where(good[:, None], right, 0.0) * part[:, None])
                for cross, own, right in sums]
        errors, sizes, moved = self._left_out(sums, np.full(columns.shape[1], _LEAST))
        return [Score(errors[:, place] / self._noise if good[place]
                      else np.full(len(self._blocks), np.inf),
                      sizes[place] / (norm[place] or 1.0), moved[:, place] / self._norm)
                for place in range(good.size)]

    def _products(self, columns: Array) -> list[Sums]:
        """Return of every block what weighted candidates (k, q, m) are multiplied by the free
        numbers (count, k, q), by themselves (k, q, q) and by what is to be explained (k, q)."""
        count, width, values = columns.shape
        flat = columns.reshape(count * width, values)
        sums = []
        for block in self._blocks:
            part = flat[:, block]
            cross = (self._nuisance[:, block] @ part.T).reshape(self._count, count, width)
            own = np.empty((count, width, width))
            for one, other in itertools.combinations_with_replacement(range(width), 2):
                own[:, one, other] = own[:, other, one] = np.einsum(
                    'km,km->k', columns[:, one, block], columns[:, other, block])
            sums.append((cross, own, (part @ self._target[block]).reshape(count, width)))
        return sums

    def _left_out(self, sums: list[Sums], ridge: Array) -> tuple[Array, Array, Array]:
        """Return the squared errors (blocks, k) of k candidates, weighted, by what `_products`
        says of them; their sizes (k, q), and the numbers (count, k) beside each, where nothing is
        left out."""
        cross, own, right = (np.sum([entry[place] for entry in sums], axis=0)
                             for place in range(3))
        own = own + np.diag(ridge)
        whole = self._whole + np.diag(self._ridge)
        errors = np.empty((len(self._blocks), own.shape[0]))
        for place, (cross_out, own_out, right_out) in enumerate(sums):
            gram_out, number_right = self._gram[place], self._right[place]
            sizes, numbers = _solved(whole - gram_out, self._whole_right - number_right,
                                     cross - cross_out, own - own_out, right - right_out)
            if self._heard:
                unheard = 1.0 - self._heard
                told = (self._whole_right - unheard * number_right)[:, None] - np.einsum(
                    'pkq,kq->pk', cross - unheard * cross_out, sizes)
                numbers = np.linalg.solve(whole - unheard * gram_out, told)
            fitted = np.einsum('pk,pq,qk->k', numbers, gram_out, numbers)
            mixed = np.einsum('pk,pkq,kq->k', numbers, cross_out, sizes)
            squares = np.einsum('kp,kpq,kq->k', sizes, own_out, sizes)
            errors[place] = (self._squares[place] - 2.0 * (number_right @ numbers)
                             - 2.0 * np.sum(sizes * right_out, axis=1)
                             + fitted + 2.0 * mixed + squares)
        return errors, *_solved(whole, self._whole_right, cross, own, right)


def _solved(gram: Array, number_right: Array, cross: Array, own: Array, right: Array,
            ) -> tuple[Array, Array]:
    """Return sizes (k, q) of k candidates and the numbers (p, k) beside each."""
    count, width = right.shape
    both = np.linalg.solve(gram, np.concatenate(
        [cross.reshape(gram.shape[0], -1), number_right[:, None]], axis=1))
    through, alone = both[:, :-1].reshape(*cross.shape), both[:, -1]
    left = own - np.einsum('pkq,pkr->kqr', cross, through)
    target = right - np.einsum('pkq,p->kq', cross, alone)
    sizes = np.linalg.solve(left, target[:, :, None])[:, :, 0]
    return sizes, alone[:, None] - np.einsum('pkq,kq->pk', through, sizes)


def derivatives_of(fit: Fit) -> Array:
    """Return the derivatives (m, size) of a finished fit."""
    if fit.jacobian is None:
        raise ValueError('a law is judged by finished fits')
    return fit.jacobian


def numbers_and_sizes(fit: Fit) -> list[int]:
    """Return the entries of a fit's vector that least squares find anew without a block: the
    numbers and how large each effect is. What shapes an effect is beyond the linear where one
    block alone tells it."""
    hypothesis, count = fit.hypothesis, len(fit.hypothesis.numbers)
    return [*range(count), *(
        count + entry for entry, (owner, _, _) in enumerate(hypothesis.places)
        if hypothesis.parameter(entry).name == hypothesis.variants[owner].sizing.name)]


def stretches_of_time(fitter: Fitter) -> Labels:
    """Return the block of each value: whole recordings where there are several, else long
    stretches that follow one another."""
    runs = fitter.problem.runs
    if len(runs) >= 3:
        return np.concatenate([np.full(run.measured.size, index)
                               for index, run in enumerate(runs)])
    count = PARTS // len(runs)
    return np.concatenate([
        np.minimum((np.arange(run.measured.size) * count) // max(run.measured.size, 1), count - 1)
        + count * index for index, run in enumerate(runs)])


def noise_by_block(fitter: Fitter) -> Array:
    """Return the part (k,) of the noise's squares that each of the stretches of time holds."""
    by_block = np.bincount(stretches_of_time(fitter), (fitter.sigma * fitter.weight) ** 2)
    # A stretch that no fit may look at is no block.
    told: Array = by_block[by_block > 0.0] / by_block.sum()
    return told


def kinds_of_motion(fitter: Fitter) -> list[Labels]:
    """Return labels that split the values into two kinds of motion each: slow and fast
    stretches, and short and long ways."""
    runs = fitter.problem.runs
    stretch, speed, way = [], [], []
    first = 0
    for run in runs:
        time = run.motion.time[run.comparison.grid]
        place = (time / STRETCH).astype(int)
        _, place = np.unique(place, return_inverse=True)
        velocity, position = (values[run.comparison.grid] for values in (
            run.motion.velocity, run.motion.position))
        for label in range(int(place.max()) + 1 if place.size else 0):
            rows = place == label
            speed.append(float(np.sqrt(np.mean(velocity[rows] ** 2))))
            way.append(float(np.ptp(position[rows])))
        stretch.append(place + first)
        first += int(place.max()) + 1 if place.size else 0
    labels = np.concatenate(stretch)
    size = np.bincount(labels)
    return [_halves(np.array(values), size)[labels] for values in (speed, way)]


def _halves(values: Array, size: Labels) -> Labels:
    """Return 0 or 1 for each stretch: below or above the median, all values weighing alike."""
    order = np.argsort(values)
    above = np.cumsum(size[order]) > 0.5 * size.sum()
    found = np.zeros(values.size, np.int64)
    found[order] = above
    return found
