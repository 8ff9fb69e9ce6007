# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Was a number of the file wrong, or did a refit of the file move it?

A file that was refitted on a machine with physics that it does not have has moved numbers, to make
up for the physics. Along all the numbers that such a refit moved together the file is at a minimum
of what it misses: they are off by just what the missing effects pull them. One that is wrong by
itself is off by anything, and to be off by just that is a coincidence. Which numbers a refit
moved, and whether there was one at all, is one question for all of them: those that stand, or are
off by something else, a refit must have held. A load curve is moved number by number, or as a
whole: by an effect of the explanation that does what its numbers can do together.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
import itertools
import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as student

from engb_core.diagnose.constants import FORMULA_MISSES, FORMULA_TAILS
from engb_core.diagnose.formula import little_apart
from engb_core.diagnose.hypothesis import Hypothesis, Variant
from engb_core.diagnose.nominal import BELIEVED, LOAD_NUMBERS, NominalNumber
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.uncertainty import vector_deviations

__all__ = ['Refit', 'posterior', 'refit_of', 'wrong_beside_others']

Array = NDArray[np.float64]
_Item = TypeVar('_Item')


@dataclass(frozen=True)
class Refit:
    """What is known of a refit of the file.

    Attributes:
        probability: that the file was refitted at all.
        by_itself: number, or effect that moves the load curve as a whole → probability that it
            is off by itself, and was not moved by the refit, given that it is off.
    """

    probability: float
    by_itself: Mapping[str, float]


def refit_of(fitter: Fitter, explained: Fit, kept: Mapping[str, float]) -> Refit:
    """Return what is known of a refit of the file around effects that it does not have.

    Args:
        fitter: of the problem; what a refit saw is its first round of fits.
        explained: with effects that the file misses; finished.
        kept: number of the file, none of the load curve → probability that it is as it should be.
    """
    hypothesis = explained.hypothesis
    minimum = _Minimum.of(fitter.earlier or fitter, wrong_beside_others(explained))
    deviations = vector_deviations(explained, fitter)
    numbers = {number.name: (number, place) for place, number in enumerate(hypothesis.numbers)}
    start, low = hypothesis.start_of_numbers(), hypothesis.bounds[0]
    fixed, movable = {}, []
    for name in kept:
        place = numbers[name][1]
        if name not in minimum.places:
            fixed[name] = 1.0
        elif start[place] <= low[place]:
            # The file does not have it at all: no refit leaves it there, unless the bound held it.
            fixed[name] = 1.0 if minimum.step((name,))[name] > 0.0 else 0.5
        else:
            movable.append(name)

    off = {name: float(explained.vector[place] - start[place])
           for name, (_, place) in numbers.items()
           if name in minimum.places and (name in kept or name in minimum.load)}
    for number in minimum.movers:
        place = len(hypothesis.numbers) + next(
            entry for entry, (owner, _, _) in enumerate(hypothesis.places)
            if hypothesis.ids[owner] == number.name)
        numbers[number.name] = number, place
        off[number.name] = float(explained.vector[place] - hypothesis.prior[0][place])
    movers = [number.name for number in minimum.movers]
    # A curve that was moved as a whole was not moved number by number.
    groups = [group for group in (() if movers else minimum.load, minimum.saturation) if group]

    def coincidence(name: str, step: float, by_held: float = 0.0) -> float:
        number, place = numbers[name]
        whole = number.spread / BELIEVED if name in movers else start[place]
        return _likelier_moved(number, whole, off[name], step, by_held, float(deviations[place]))

    def coincidences(moved: Collection[str], others: Collection[tuple[str, ...]],
                     ) -> dict[str, float]:
        free = [*moved, *itertools.chain.from_iterable(others)]
        step = minimum.step(free)
        by_held = minimum.step_towards(free, {
            name: value for name, value in off.items() if name not in free})
        found = {name: coincidence(name, step[name], by_held[name]) for name in moved}
        if not _numbers_alone(hypothesis):
            return found
        # What makes up for a number is shared out by another measure in another way: along each
        # alone the file is at its minimum all the same.
        return {name: max(ratio, alone[name]) for name, ratio in found.items()}

    alone = {name: coincidence(name, minimum.step((name,))[name]) for name in (*movable, *movers)}
    found = posterior({**{name: kept[name] for name in movable}, **dict.fromkeys(movers, 0.0)},
                      coincidences, groups, movers if _numbers_alone(hypothesis) else ())
    return Refit(found.probability, {**found.by_itself, **fixed})


def _numbers_alone(hypothesis: Hypothesis) -> bool:
    """Whether nothing but numbers is wrong."""
    return all(variant.number_only for variant in hypothesis.variants)


def wrong_beside_others(explained: Fit) -> tuple[Variant, ...]:
    """Return the effects of an explanation that say that a number is wrong, beside another one."""
    variants = explained.hypothesis.variants
    return tuple(variant for variant in variants if variant.number_only) \
        if len(variants) > 1 else ()


def posterior(kept: Mapping[str, float],
              coincidences: Callable[[Collection[str], Collection[tuple[str, ...]]],
                                     Mapping[str, float]],
              groups: Sequence[tuple[str, ...]], not_all: Collection[str] = ()) -> Refit:
    """Return what follows from each set of numbers that a refit may have moved. Beforehand a file
    was refitted or not, and a refit held or moved each number, and each group as one, the one as
    likely as the other.

    Args:
        kept: number → probability that it is as it should be, which none is that a refit moved.
        coincidences: the numbers that a refit moved, and the groups that it moved beside → how
            much likelier each of the numbers is to be off by as much as it is than by itself.
        groups: of numbers that a refit may have moved as well, of which nothing is asked.
        not_all: names of which a refit held one at least: else it would have left nothing.
    """
    names = list(kept)
    held = dict.fromkeys(names, 1.0)    # Weight of all sets that a refit did not move it in,
    moved = dict.fromkeys(names, 0.0)   # and of those that it did, given that it is off.
    refit = 0.0
    each = 0.5 ** (len(names) + len(groups))
    for chosen, others in itertools.product(_subsets(names), _subsets(groups)):
        if not_all and set(not_all) <= set(chosen):
            continue
        ratios = coincidences(chosen, others)
        parts = {name: (1.0 - kept[name]) * ratios[name] for name in chosen}
        weight = each * math.prod(parts.values())
        refit += weight
        for name in names:
            if name not in chosen:
                held[name] += weight
            else:
                moved[name] += each * ratios[name] * math.prod(
                    part for other, part in parts.items() if other != name)
    return Refit(refit / (1.0 + refit),
                 {name: held[name] / (held[name] + moved[name]) for name in names})


def _subsets(items: Sequence[_Item]) -> list[tuple[_Item, ...]]:
    return [chosen for count in range(len(items) + 1)
            for chosen in itertools.combinations(items, count)]


def _likelier_moved(number: NominalNumber, start: float, off: float, step: float, by_held: float,
                    known: float) -> float:
    """Return how much likelier a number is off by as much as it is if a refit moved it than if it
    is off by itself.

    Both say by how much: by itself by anything of the order of what files are off; by a refit,
    which looks for the minimum in plain torque and knows no delay between the samples of effort
    and position, by as much as the effects, and what it held wrongly, pull it. The formula of the
    effects is another one, so that their part is known to what formulas miss; and so is all of it,
    as the measure of the refit is.

    Args:
        number: of the file.
        start: what the file has.
        off: what the fit has, less that.
        step: from the file to the minimum, without effects.
        by_held: the part of it that would be made up for what the refit held wrongly.
        known: deviation of the number in the fit.
    """
    pulled = off - step
    by_effects = pulled + by_held
    scale = math.sqrt((FORMULA_MISSES * by_effects) ** 2 + (FORMULA_MISSES * pulled) ** 2
                      + known ** 2)
    refit = student.pdf(off, FORMULA_TAILS, loc=pulled,
                        scale=max(scale, np.finfo(float).tiny))
    # A number is off by no more than it is, or by as much as files are.
    likely = {number.spread} if number.logarithmic or start == 0.0 else {
        number.spread, abs(start)}
    wrong = np.mean([norm.pdf(off, scale=entry) for entry in likely])
    return float(refit / max(wrong, np.finfo(float).tiny))


@dataclass(frozen=True)
class _Minimum:
    """Where the file is from the minimum in plain torque of what it misses without effects: the
    normal equations over its numbers, `places` of each, and which of them are the load curve's
    and say how friction turns with the direction. Effects that move the load curve as a whole,
    `movers`, are numbers as well."""

    places: Mapping[str, int]
    load: tuple[str, ...]
    saturation: tuple[str, ...]
    movers: tuple[NominalNumber, ...]
    gram: Array
    right: Array

    @classmethod
    def of(cls, fitter: Fitter, wrong: Sequence[Variant]) -> _Minimum:
        # Derivatives beside no effect: where flanks meet, those beside a gap tell nothing.
        base = fitter.finished_base
        columns = base.jacobian
        assert columns is not None, 'the base is finished'
        names = [number.name for number in base.hypothesis.numbers]
        load = tuple(name for name in names if name in LOAD_NUMBERS)
        curve = columns[:, [names.index(name) for name in load]]
        movers = []
        for variant in wrong:
            column = _moves(fitter, base, variant)
            if not _is_made_of(column, curve):
                continue
            columns = np.column_stack([columns, column])
            movers.append(NominalNumber(
                variant.effect.id, len(names), variant.sizing.unit,
                BELIEVED * float(np.linalg.norm(base.predicted) / np.linalg.norm(column)),
                variant.sizing.low, variant.sizing.high))
            names.append(variant.effect.id)
        return cls({name: place for place, name in enumerate(names)}, load,
                   tuple(name for name in names if name == 'saturation_velocity'), tuple(movers),
                   columns.T @ columns, columns.T @ fitter.file_residual)

    def step(self, moved: Sequence[str]) -> dict[str, float]:
        """Return the step of each of these numbers to the minimum over all of them."""
        return self._solved(moved, self.right)

    def step_towards(self, moved: Sequence[str], others: Mapping[str, float]) -> dict[str, float]:
        """Return the step of each of these numbers that does most of what steps of others do."""
        steps = np.zeros(self.right.size)
        for name, step in others.items():
            steps[self.places[name]] = step
        return self._solved(moved, self.gram @ steps)

    def _solved(self, moved: Sequence[str], right: Array) -> dict[str, float]:
        places = [self.places[name] for name in moved]
        gram = self.gram[np.ix_(places, places)]
        norms = np.sqrt(np.diag(gram))
        norms[norms == 0.0] = 1.0
        solution = np.linalg.lstsq(gram / np.outer(norms, norms), right[places] / norms,
                                   rcond=np.sqrt(np.finfo(float).eps))[0] / norms
        return dict(zip(moved, solution.tolist(), strict=True))


def _moves(fitter: Fitter, base: Fit, variant: Variant) -> Array:
    """Return what the torque (m,) of the file's load curve, with the friction that it makes of the
    load in the base, changes by with the size of an effect that is none."""
    beside = fitter.hypothesis((variant,), base.hypothesis.numbers)
    count = len(beside.numbers)
    vector = beside.prior[0].copy()
    for place, number in enumerate(beside.numbers):
        if number.name not in LOAD_NUMBERS:
            vector[place] = base.vector[place]
    none = fitter.evaluate(beside, vector)
    return fitter.columns(none, range(count, count + 1))[:, 0]


def _is_made_of(column: Array, others: Array) -> bool:
    """Whether a column (m,) is one that others (m, k) make up, as far as any are told apart."""
    made = others @ np.linalg.lstsq(others, column, rcond=None)[0]
    return bool(np.sum((column - made) ** 2) < little_apart() * np.sum(column ** 2))
