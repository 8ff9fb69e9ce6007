# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How fits compare: what they leave above the noise, what they are ranked by, which is simpler.

Excess is the mean squared residual minus the noise's 1.
"""

from __future__ import annotations

import math

from engb_core.diagnose.constants import (
    CLEAN_EXCESS,
    FORMULA_ERROR,
    NAMELESS_PRICE,
    PARAMETER_PRICE,
    PHYSICS_FOR_NUMBER,
    WORTH_PART,
)
from engb_core.diagnose.formula import chance_part, further_odds, part_of_formula
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.score.reduced_chi_square import excess, reduced_chi_square

__all__ = ['little_more', 'number_price', 'plain_price', 'price', 'simplest', 'unlikeliness',
           'worth_a_further_effect', 'worth_having']


def price(fit: Fit, fitter: Fitter) -> float:
    """Return what fits of like size are ranked by: the plain price, less for wrong numbers and
    more for what has no name."""
    variants = fit.hypothesis.variants
    number = bool(variants) and all(variant.number_only for variant in variants)
    return plain_price(fit, fitter) - number_price() * number \
        + NAMELESS_PRICE * sum(variant.effect.unnamed for variant in variants)


def plain_price(fit: Fit, fitter: Fitter) -> float:
    """Return log mean square plus a price a parameter, and of what is far from what files are off
    by."""
    parameters = fit.hypothesis.size - len(fit.hypothesis.numbers)
    return math.log(max(reduced_chi_square(fit, fitter), 1e-12)) + PARAMETER_PRICE * (
        parameters + unlikeliness(fit, fitter))


def unlikeliness(fit: Fit, fitter: Fitter) -> float:
    """Return by how many nats wrong numbers of a fit that are as far off as they are are less
    likely beforehand than small ones, where it is known how far files are off."""
    low, high = fitter.problem.scene.position_range
    nats = 0.0
    for index, variant in enumerate(fit.hypothesis.variants):
        sizing = variant.sizing
        if variant.number_only and sizing.of_stroke > 0.0 and sizing.none is not None:
            value = fit.hypothesis.named(fit.vector, index)[sizing.name]
            nats += 0.5 * ((value - sizing.none) / (sizing.of_stroke * (high - low))) ** 2
    return nats


def number_price() -> float:
    """Return the log mean square by which one wrong number may fit worse than physics and is
    preferred: its odds beforehand, at the price that a parameter has."""
    return -PARAMETER_PRICE * math.log(PHYSICS_FOR_NUMBER)


def little_more(simple: float, rich: float) -> bool:
    """Whether the excess that a simpler hypothesis leaves is little more than that of one which
    contains it: then it is preferred."""
    return simple - rich < max(chance_part() * simple, FORMULA_ERROR)


def worth_a_further_effect(old: float, new: float, whole: float, share: float = 1.0) -> bool:
    """Return whether an excess that falls from `old` to `new` is worth one effect more: not little
    more, and more than other formulas of the other effects usually miss, or likelier physics than
    that for how little it leaves.

    Args:
        old, new: excess without and with the further effect.
        whole: excess without any effect, of all that was recorded.
        share: part of what was recorded of which `old` and `new` are.
    """
    old, new = max(old, 0.0), max(new, 0.0)
    if little_more(old, new):
        return False
    if share * (old - new) > part_of_formula() * whole:
        return True
    return further_odds(min(1.0, share * old / whole), new / old) > 1.0


def worth_having(rich: float, simple: float, parameters: int = 1) -> bool:
    """Whether a richer model is worth having: of the mean square that a simpler one leaves of what
    neither was fitted to it takes away a part for each of its further `parameters`."""
    return rich < (1.0 - WORTH_PART) ** parameters * simple


def simplest(candidates: list[Fit], fitter: Fitter) -> Fit:
    """Return the first of the candidates, or one contained in it that leaves little more. What has
    no name is not needed where physics leaves no more than noise may be."""
    best = candidates[0]
    if best.hypothesis.has_unnamed:
        best = next((fit for fit in candidates
                     if not fit.hypothesis.has_unnamed
                     and excess(fit, fitter) <= CLEAN_EXCESS), best)
    for other in candidates[1:]:
        if _contained(other, best) and little_more(excess(other, fitter), excess(best, fitter)):
            return other
    return best


def _contained(simple: Fit, rich: Fit) -> bool:
    """Whether each effect of `simple` is in `rich` or contained in one that is."""
    if len(simple.hypothesis.variants) != len(rich.hypothesis.variants):
        return False
    contains = {entry for variant in rich.hypothesis.variants
                for entry in (variant.effect.id, *variant.effect.contains)}
    return all(entry in contains for entry in simple.hypothesis.ids) \
        and simple.hypothesis.ids != rich.hypothesis.ids
