# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How well a motion parts the chosen fit from its rivals, and which segments to combine.

On a new motion a rival says another effort than the chosen fit. What refitted numbers and
parameters of the rival can make up for, held by what the recordings have already fixed, doesn't
count:

    E = min over x of |W (y_chosen − y_rival − A x)|² + xᵀ G x,   G = Jᵀ W² J + priors

with A and J the rival's derivatives on the new and on the recorded motion.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import Problem
from engb_core.errors import InputError

__all__ = ['Parts', 'alone', 'combined', 'known_of', 'parts_of']

Array = NDArray[np.float64]

SHORTEST = 15.0
# A segment is added if it gives this part of what those before it give per second.
WORTH_ADDING = 0.3


@dataclass(frozen=True)
class Parts:
    """What a rival's normal equations are made of, by segment.

    `distance` (s,) Σ w d²; `pull` (s, k) Aᵀ w d; `gram` (s, k, k) Aᵀ w A; `known` (k, k) what
    the recordings have fixed; `size` (s,) Σ w σ², the number of values, noise = 1.
    """

    distance: Array
    pull: Array
    gram: Array
    known: Array
    size: Array

    def energy(self, counts: Array) -> float:
        """Return E for `counts` (s,) of each segment."""
        pull = counts @ self.pull
        gram = self.known + np.tensordot(counts, self.gram, 1)
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        solution = np.linalg.solve(gram / np.outer(scale, scale) + 1e-9 * np.eye(scale.size),
                                   pull / scale)
        return max(float(counts @ self.distance - (pull / scale) @ solution), 0.0)

    def separation(self, counts: Array) -> float:
        """Return the rms difference that is left, in units of the noise."""
        return float(np.sqrt(self.energy(counts) / max(float(counts @ self.size), 1e-9)))


def known_of(fitter: Fitter, rival: Fit) -> Array:
    """Return what the recordings have fixed of a rival's numbers, (k, k)."""
    jacobian = fitter.finished(rival).jacobian
    assert jacobian is not None, 'a finished fit has one'
    scaled = (jacobian / fitter.spread[:, None])[fitter.fitted]
    known = scaled.T @ scaled
    numbers = rival.hypothesis.numbers
    places = range(len(numbers))
    known[places, places] += [number.spread ** -2.0 for number in numbers]
    for entry, (_, _, run) in enumerate(rival.hypothesis.places):
        if run >= 0:
            # Found anew in each recording: what is known of it is of no use in the next.
            known[len(numbers) + entry, :] = known[:, len(numbers) + entry] = 0.0
    return known


def parts_of(fitter: Fitter, chosen: Fit, rivals: list[Fit], known: list[Array], problem: Problem,
           spans: tuple[tuple[float, float], ...]) -> list[Parts]:
    """Return the parts of each rival's normal equations on the motion of `problem`.

    Args:
        fitter: of the recordings.
        chosen: the fit whose effort is expected.
        rivals: fits that are held against it.
        known: of each rival, from `known_of`.
        problem: one run on the new reference.
        spans: (begin, end) of its segments [s].

    Raises:
        InputError: an effort that is not finite.
    """
    run = problem.runs[0]
    there = copy.copy(fitter)
    there.problem = problem
    missed = max(float(np.median(fitter.spread ** 2 - fitter.sigma ** 2)), 0.0)
    variance = fitter.problem.noise_floor ** 2 + run.sigma ** 2 - run.noise ** 2
    weight = 1.0 / (variance + missed)
    expected = there.predict(chosen.hypothesis.throughout(), chosen.vector)
    time = run.motion.time[run.comparison.grid]
    rows = [slice(*np.searchsorted(time, span)) for span in spans]
    found = []
    for rival, fixed in zip(rivals, known, strict=True):
        hypothesis = rival.hypothesis.throughout()
        predicted = there.predict(hypothesis, rival.vector)
        distance = expected - predicted
        columns = there.finish(Fit(hypothesis, rival.vector, predicted, distance,
                                   0.0)).jacobian
        assert columns is not None, 'a finished fit has one'
        if not (np.isfinite(columns).all() and np.isfinite(distance).all()):
            raise InputError('a rival has no finite effort on the reference')
        weighted = columns * weight[:, None]
        found.append(Parts(
            np.array([weight[part] @ distance[part] ** 2 for part in rows]),
            np.array([weighted[part].T @ distance[part] for part in rows]),
            np.array([weighted[part].T @ columns[part] for part in rows]), fixed,
            np.array([weight[part] @ variance[part] for part in rows])))
    return found


def alone(parts: list[Parts], lengths: Array) -> Array:
    """Return what each segment gives by itself, per second, for the pair it parts least, (s,)."""
    each = np.eye(lengths.size)
    return np.array([min(part.energy(one) for part in parts) for one in each]) / lengths


def combined(parts: list[Parts], lengths: Array, allowed: NDArray[np.bool_], longest: float,
              ) -> Array:
    """Return how often to use each segment, (s,): added greedily, per second, to `longest` [s]."""
    counts = np.zeros(lengths.size)

    def worth(trial: Array) -> float:
        # The logarithm lets the pair that is parted least count most.
        return float(sum(np.log1p(part.energy(trial)) for part in parts))

    while True:
        spent = float(counts @ lengths)
        options = [index for index in np.flatnonzero(allowed & (counts < 2))
                   if spent + lengths[index] < longest]
        if not options:
            return counts
        one = np.eye(lengths.size)
        # A segment that is there already adds certainty, but nothing new.
        best = max(options, key=lambda index: (
            (worth(counts + one[index]) - worth(counts)) / lengths[index]
            / (1.0 + 2.0 * counts[index])))
        if spent >= SHORTEST:
            gain = min((part.energy(counts + one[best]) - part.energy(counts)) / lengths[best]
                       * spent / max(part.energy(counts), 1e-9) for part in parts)
            if gain < WORTH_ADDING:
                return counts
        counts[best] += 1
