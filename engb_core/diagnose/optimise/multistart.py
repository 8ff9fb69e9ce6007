# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Fits of effects whose cost has many narrow minima, where derivatives lead nowhere.

Whether a flank is met one sample earlier or later changes the effort by a jump. So their own
parameters evolve from where they promise most, and are moved at random around the best so far,
while the nominal numbers follow by linear least squares; derivatives finish the work.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from engb_core.diagnose.fitted import Fit
from engb_core.diagnose.hypothesis import Hypothesis
from engb_core.diagnose.objective import Objective
from engb_core.diagnose.optimise.linear_start import start_vector
from engb_core.diagnose.optimise.normal_equations import normal_equations

__all__ = ['Promise', 'Settling', 'best_promised', 'followed', 'is_multimodal', 'moved_places',
           'promises', 'promises_of', 'search_around']

Array = NDArray[np.float64]
# Steps by derivatives: (begin, rounds) → fit.
Iterate = Callable[[Fit, int], Fit]

# Standard deviation of a move: of a logarithm, or of the parameter's range; and how it shrinks
# with every move in vain.
MOVE_OF_LOGARITHM = 0.25
MOVE_OF_RANGE = 0.1
SHRINK = 0.97
# Part of the entries that a move moves, each by chance.
PART_MOVED = 0.5
# Members and generations of an evolution, how far (part of a first move) all but the best of them
# stand from what is promised, and how many hypotheses, such as onsets, have one each.
POPULATION, GENERATIONS, STIRRED, EVOLVED = 40, 20, 0.3, 3
# Promising starts that are followed by derivatives alone, how many of the best fits are moved at
# random, and how often each and the best of them.
FOLLOWED, BASINS = 10, 2
FIRST_MOVES = 50
FURTHER_MOVES = 50
# Random moves around a leading fit.
MOVES = 100
# Part of the cost that the evolution must have taken away to be worth further ones.
HOPE = 0.02


def is_multimodal(fit: Fit) -> bool:
    """Whether any effect of a fit is one of those."""
    return any(variant.effect.multimodal for variant in fit.hypothesis.variants)


@dataclass(frozen=True)
class Promise:
    """The cost that a hypothesis would have with its numbers at their linear optimum, and the
    vector (size,) that promises it."""

    hypothesis: Hypothesis
    cost: float
    vector: Array


class Settling:
    """Brings the nominal numbers to their linear optimum, wherever the effects stand.

    Called with a hypothesis that has the numbers of `fit`, and a vector (size,), it returns the
    cost that is promised, and the vector (size,) that promises it.
    """

    def __init__(self, objective: Objective, fit: Fit) -> None:
        self.objective = objective
        count = self.count = len(fit.hypothesis.numbers)
        self.centre, self.spread = (part[:count] for part in fit.hypothesis.prior)
        columns, weight = objective.number_columns(fit), objective.weight
        gram, _ = normal_equations(columns, fit.residual, weight)
        self.inverse = np.linalg.inv(gram + np.diag(1.0 / self.spread ** 2))
        self.columns = columns * weight[:, None] ** 2

    def __call__(self, hypothesis: Hypothesis, place: Array) -> tuple[float, Array]:
        count = self.count
        low, high = hypothesis.bounds
        trial = self.objective.evaluate(hypothesis, np.clip(place, low, high))
        if not np.isfinite(trial.cost):
            return trial.cost, trial.vector
        right = np.einsum('ij,i->j', self.columns, trial.residual) \
            + (self.centre - trial.vector[:count]) / self.spread ** 2
        step = self.inverse @ right
        better = trial.vector.copy()
        better[:count] = np.clip(better[:count] + step, low[:count], high[:count])
        return trial.cost - float(right @ step), better


def promises(objective: Objective, start: Fit, hypothesis: Hypothesis,
             settings: list[dict[str, float]]) -> list[Promise]:
    """Return what is promised with one effect more than `start`, at each of `settings`, the least
    cost first."""
    return promises_of(objective, start, [(hypothesis, setting) for setting in settings])


def promises_of(objective: Objective, start: Fit,
                begun: Iterable[tuple[Hypothesis, dict[str, float]]]) -> list[Promise]:
    """Return what is promised with one effect more than `start`, the least cost first.

    The effect stands as each hypothesis and setting of `begun` has it, the numbers begin as in
    `start`, or as the model file has them: without the effect they have moved to make up for it,
    and may never find back.
    """
    settled = Settling(objective, start)
    found = []
    for hypothesis, setting in begun:
        place = start_vector(hypothesis, start, setting, None)
        as_in_file = np.concatenate([hypothesis.start_of_numbers(), place[settled.count:]])
        found += [Promise(hypothesis, *settled(hypothesis, entry))
                  for entry in (place, as_in_file)]
    return sorted(found, key=lambda promise: promise.cost)


def followed(objective: Objective, promised: list[Promise], rounds: int, iterate: Iterate,
             ) -> list[Fit]:
    """Return the fits that begin at what is promised, after so many rounds of `iterate`."""
    return [iterate(objective.evaluate(promise.hypothesis, promise.vector), rounds)
            for promise in promised]


def best_promised(objective: Objective, start: Fit, promised: list[Promise], rounds: int,
                  iterate: Iterate) -> Fit:
    """Return the best fit that evolves from what is promised, the least cost first, after so many
    rounds of `iterate`."""
    by_hypothesis: dict[int, list[Promise]] = {}
    for promise in promised:
        by_hypothesis.setdefault(id(promise.hypothesis), []).append(promise)
    evolved = [_evolved(objective, own) for own in list(by_hypothesis.values())[:EVOLVED]]
    # What promises most may be in the right basin already, which an evolution can leave.
    fits = [iterate(min(evolved, key=lambda fit: fit.cost), rounds),
            *followed(objective, promised[:FOLLOWED], rounds, iterate)]
    found = min((search_around(objective, fit, FIRST_MOVES)
                 for fit in sorted(fits, key=lambda fit: fit.cost)[:BASINS]),
                key=lambda fit: fit.cost)
    if found.cost > (1.0 - HOPE) * start.cost:
        return found
    return search_around(objective, found, FURTHER_MOVES)


def _evolved(objective: Objective, promised: list[Promise]) -> Fit:
    """Return the best fit of a differential evolution (Storn and Price, Journal of Global
    Optimization 11 (1997) 341; always the same one) from what is promised of one hypothesis: its
    members cross where their minima are many, and differ by as much as these do."""
    best = promised[0]
    hypothesis = best.hypothesis
    begin = objective.evaluate(hypothesis, best.vector)
    moved, scale = moved_places(begin)
    settled = Settling(objective, begin)
    members = np.resize([promise.vector[moved] for promise in promised[:POPULATION]],
                        (POPULATION, len(moved)))
    steps = STIRRED * scale * np.random.default_rng(0).standard_normal(members.shape)
    members[1:] += steps[1:]
    least, vector = begin.cost, begin.vector

    def cost(place: Array) -> float:
        nonlocal least, vector
        trial = vector.copy()
        trial[moved] = place
        promise, better = settled(hypothesis, trial)
        if promise < least:
            least, vector = promise, better
        # No number ranks below all others.
        return promise if np.isfinite(promise) else np.inf

    # Beyond its bounds an entry stands at them: many do, where there is no friction beyond a gap.
    low, high = hypothesis.bounds[0][moved] - scale, hypothesis.bounds[1][moved] + scale
    differential_evolution(
        cost, list(zip(low, high, strict=True)), strategy='currenttobest1bin', tol=0.0,
        maxiter=GENERATIONS, init=np.clip(members, low, high), polish=False, seed=0)
    return objective.evaluate(hypothesis, vector)


def moved_places(fit: Fit) -> tuple[list[int], Array]:
    """Return which entries of the vector are moved at random, those of the multimodal effects, or
    of all where none is, and the standard deviation (count,) of a first move."""
    hypothesis = fit.hypothesis
    count = len(hypothesis.numbers)
    low, high = hypothesis.bounds
    owners = [hypothesis.variants[owner].effect for owner, _, _ in hypothesis.places]
    moved = [count + entry for entry, effect in enumerate(owners)
             if effect.multimodal or not is_multimodal(fit)]
    scale = np.array([MOVE_OF_LOGARITHM if hypothesis.parameter(place - count).logarithmic
                      else MOVE_OF_RANGE * (high[place] - low[place]) for place in moved])
    return moved, scale


def search_around(objective: Objective, fit: Fit, moves: int = MOVES) -> Fit:
    """Return the best fit found around `fit` by so many random moves (always the same ones) of the
    multimodal effects, or of all where none is."""
    hypothesis = fit.hypothesis
    moved, scale = moved_places(fit)
    settled = Settling(objective, fit)
    generator = np.random.default_rng(0)
    best = fit
    for _ in range(moves):
        place = best.vector.copy()
        step = scale * generator.standard_normal(len(moved))
        # Not all at once: where many are right already few moves of all of them are better.
        place[moved] += step * (generator.random(len(moved)) < PART_MOVED)
        promised, better = settled(hypothesis, place)
        trial = objective.evaluate(hypothesis, better) if promised < best.cost else None
        if trial is not None and trial.cost < best.cost:
            best = trial
        else:
            scale = scale * SHRINK
    return best
