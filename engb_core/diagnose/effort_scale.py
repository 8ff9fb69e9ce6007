# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""One factor on inertia and load is one cause: the scale of effort, not two wrong numbers.

Inertia and load of a model are known apart from any effort (from masses and lengths). Where the
recordings want both changed, by factors that agree within their deviations, either effort is off
by one factor (torque constant); or two numbers are wrong and agree by chance; or the load is wrong
and a refit of the file around it moved the inertia, to agree with it by chance. Which it is is one
question: how far apart two factors usually are, how far these are, and whether the inertia is just
where such a refit would have moved it.

An axis without load has its friction instead, viscous and dry, which a file knows to no more than
what the right formulas leave (`FORMULA_ERROR`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from engb_core.diagnose.constants import FORMULA_ERROR, LARGER_PART, MEASURED, STANDS_OUT
from engb_core.diagnose.formula import part_of_formula
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.nominal import BELIEVED, LOAD_NUMBERS
from engb_core.diagnose.numbers.wrong_numbers import (
    refit_of_file,
    refitted,
    was_refitted,
)
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.score.reduced_chi_square import excess, reduced_chi_square
from engb_core.diagnose.selection import Selection
from engb_core.diagnose.uncertainty import vector_deviations
from engb_core.effects.catalogue import get_effect

__all__ = ['Factors', 'with_effort_scale']

SCALE, LOAD, INERTIA = 'effort_scale_error', 'load_stiffness_error', 'inertia_error'
# The numbers of friction that an axis without load has.
FRICTION = ('viscous_friction', 'coulomb')
# What says that the load curve is off as a whole, or that torque is lost from the smallest efforts
# on, which is a scale with two numbers more: judged anew beside the scale of effort.
SCALE_LIKE = (LOAD, 'contact_shift', 'torque_offset', 'torque_saturation')
# How far apart the logarithms of two wrong numbers' factors are at most usually.
APART = math.sqrt(2.0) * BELIEVED


@dataclass(frozen=True)
class Factors:
    """By what the recordings multiply inertia and load (of an axis without load: friction), as
    logarithms with deviations [-], and the probability that the inertia is off by itself, not
    moved by a refit of the file."""

    inertia: float
    inertia_std: float
    load: float
    load_std: float
    by_itself: float = 1.0

    @property
    def apart(self) -> float:
        """How far apart the two are, as a logarithm."""
        return self.inertia - self.load

    @property
    def std(self) -> float:
        """The deviation of that."""
        return math.hypot(self.inertia_std, self.load_std, MEASURED, MEASURED)

    @property
    def both_off_alike(self) -> bool:
        """Whether both are off by more than such numbers usually are, to the same side, and
        agree."""
        return (self.inertia * self.load > 0.0
                and abs(self.inertia) > STANDS_OUT * math.hypot(self.inertia_std, MEASURED)
                and abs(self.load) > STANDS_OUT * math.hypot(self.load_std, MEASURED)
                and abs(self.apart) < STANDS_OUT * self.std)

    def one_cause(self) -> float:
        """Return the probability that they agree for a reason, and not by chance: two numbers
        that are each off by so little are never far apart. The scale of effort, two wrong numbers
        and a wrong load around which the file was refitted are beforehand as likely."""
        usual = min(APART, math.hypot(self.inertia, self.load))
        by_reason = self.by_itself * norm.pdf(self.apart, scale=self.std)
        # Of what a refit moved, too, nothing says that it agrees with the load.
        by_chance = norm.pdf(self.apart, scale=math.hypot(self.std, usual))
        return float(by_reason / (by_reason + by_chance))


def with_effort_scale(fitter: Fitter, selection: Selection) -> Selection:
    """Return the selection with the scale of effort in the place of a wrong inertia and a wrong
    load, where their factors agree."""
    scene = fitter.problem.scene
    chosen = selection.chosen
    given = {entry.effect for entry in fitter.problem.model.effects}
    if {SCALE, LOAD} & given or chosen.hypothesis.onsets \
            or refitted(fitter) or was_refitted(fitter):
        return selection
    start = _without_scale_like(fitter, chosen)
    loaded = scene.largest_load > 0.0
    factors = (_factors if loaded else _factors_without_load)(fitter, start)
    if factors is None or factors.one_cause() < LARGER_PART:
        return selection
    fit = _scaled(fitter, start)
    left, before = (reduced_chi_square(entry, fitter) for entry in (fit, chosen))
    # No more than what another formulation of the right physics leaves.
    if left > (1.0 + part_of_formula()) * before:
        return selection
    return replace(selection, chosen=fit, rivals=(), further=(),
                   excess_after=excess(fit, fitter),
                   believed={SCALE: (factors.one_cause(), LOAD if loaded else INERTIA)})


def _without_scale_like(fitter: Fitter, fit: Fit) -> Fit:
    for place in reversed(range(len(fit.hypothesis.variants))):
        if fit.hypothesis.variants[place].effect.id in SCALE_LIKE:
            fit = fitter.without(fit, place)
    return fit


def _scaled(fitter: Fitter, start: Fit) -> Fit:
    """Return the fit with the scale of effort, inertia and load (or friction) as the file has
    them."""
    known = LOAD_NUMBERS if fitter.problem.scene.largest_load > 0.0 else FRICTION
    numbers = tuple(number for number in fitter.numbers
                    if number.name != 'inertia' and number.name not in known)
    variant, = variants_of(get_effect(SCALE), fitter.problem.scene)
    return fitter.refine(fitter.fit(variant, fitter.refit(start, numbers), rounds=8), 12)


def _factors(fitter: Fitter, start: Fit) -> Factors | None:
    """Return by what inertia and load must be multiplied, each by a number of its own; None where
    no factor does or they are not both off alike."""
    numbers = tuple(number for number in fitter.numbers if number.name not in LOAD_NUMBERS)
    names = [number.name for number in numbers]
    if 'inertia' not in names:
        return None
    variant, = variants_of(get_effect(LOAD), fitter.problem.scene)
    fit = fitter.finish(fitter.refine(fitter.fit(
        variant, fitter.refit(start, numbers), rounds=8), 12))
    deviations = vector_deviations(fit, fitter)
    scale = len(numbers) + next(entry for entry, place in enumerate(fit.hypothesis.places)
                                if place[0] == len(fit.hypothesis.variants) - 1)
    factor = float(fit.vector[scale])
    if factor <= 0.0:
        return None
    return _of_both(fitter, fit, deviations, (math.log(factor),
                                              float(deviations[scale]) / factor))


def _factors_without_load(fitter: Fitter, start: Fit) -> Factors | None:
    """Return by what inertia and friction must be multiplied; None where no factor does, viscous
    and dry friction want another one, or inertia and friction are not both off alike."""
    fit = fitter.finish(fitter.refine(start))
    names = [number.name for number in fit.hypothesis.numbers]
    if not {'inertia', *FRICTION} <= set(names):
        return None
    deviations = vector_deviations(fit, fitter)
    given = fit.hypothesis.start_of_numbers()
    told: list[tuple[float, float]] = []
    for name in FRICTION:
        place = names.index(name)
        value, file = float(fit.vector[place]), float(given[place])
        if min(value, file) <= 0.0:
            return None
        told.append((math.log(value / file),
                     math.hypot(float(deviations[place]) / value, FORMULA_ERROR)))
    (viscous, of_viscous), (dry, of_dry) = told
    if abs(viscous - dry) > STANDS_OUT * math.hypot(of_viscous, of_dry):
        return None
    weights = of_viscous ** -2, of_dry ** -2
    return _of_both(fitter, fit, deviations, (
        (weights[0] * viscous + weights[1] * dry) / sum(weights), sum(weights) ** -0.5))


def _of_both(fitter: Fitter, fit: Fit, deviations: NDArray[np.float64],
             other: tuple[float, float]) -> Factors | None:
    """Return the factors of inertia, from a finished fit with its deviations (size,), and of the
    other one (logarithm, deviation); None where they are not both off alike."""
    place = [number.name for number in fit.hypothesis.numbers].index('inertia')
    factors = Factors(float(fit.vector[place] - fit.hypothesis.start_of_numbers()[place]),
                      float(deviations[place]), *other)
    if not factors.both_off_alike:
        return None
    return replace(factors, by_itself=refit_of_file(fitter, fit).by_itself['inertia'])
