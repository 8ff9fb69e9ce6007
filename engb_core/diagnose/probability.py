# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How sure: probabilities of the chosen effects, their rivals and of something else altogether.

The weights of hypotheses of like size come from their mean squares, tempered, because the
residual of a formula that is only nearly right is no noise. That the cause has no name is one
hypothesis more beside those of the library, in nothing privileged: where a name explains all that
there is, data cannot tell it from physics that nobody wrote down and that looks alike, and the
odds are those beforehand. They are no better where a part is left, or a flexible model explains
more; how much worse was counted on generated cases whose formulas differ from the library's
(README, section on the proof).
"""

from __future__ import annotations

import math

from engb_core.diagnose.constants import (
    CLEAN_EXCESS,
    CONTAINING,
    FORMULA_ERROR,
    PHYSICS_FOR_NUMBER,
    TEMPER,
    UNNAMED,
)
from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.numbers import level
from engb_core.effects.base import Scene
from engb_core.effects.catalogue import catalogue

__all__ = ['causes', 'rival_weights', 'something_known']


def rival_weights(chosen: Fit, rivals: list[Fit], fitter: Fitter, before: float) -> list[float]:
    """Return normalised weights of the chosen fit and its rivals, [chosen, *rivals].

    Args:
        chosen, rivals: fits of like size.
        fitter: of the problem.
        before: excess that the chosen fit's numbers leave without effects.
    """
    floor = 1.0 + FORMULA_ERROR + 0.01 * before
    size = chosen.hypothesis.size

    def score(fit: Fit) -> float:
        excess = max(level(fit, fitter) - 1.0, 0.0)
        return math.log(excess + floor - 1.0) + 0.02 * (fit.hypothesis.size - size)

    best = score(chosen)
    weights = [1.0] + [min(1.0, math.exp(-TEMPER * (score(fit) - best))) * _prior(fit, chosen)
                       for fit in rivals]
    total = sum(weights)
    return [weight / total for weight in weights]


def _prior(fit: Fit, chosen: Fit) -> float:
    """Return how much rarer a rival is beforehand: without a name, physics where one wrong number
    of the chosen fit says it all, or an effect that contains a chosen one and is no better."""
    prior = UNNAMED ** sum(variant.effect.unnamed for variant in fit.hypothesis.variants)
    number = all(variant.number_only for variant in chosen.hypothesis.variants)
    if number and not all(variant.number_only for variant in fit.hypothesis.variants):
        prior *= PHYSICS_FOR_NUMBER
    contained = {entry for variant in fit.hypothesis.variants for entry in variant.effect.contains}
    if contained & set(chosen.hypothesis.ids):
        prior *= CONTAINING
    return prior


def causes(scene: Scene) -> int:
    """Return how many causes with a name the library could tell in such recordings."""
    return sum(not effect.unnamed and (effect.applies is None or effect.applies(scene))
               for effect in catalogue().values())


def something_known(adequacy: float, after: float, before: float, known: int) -> float:
    """Return the probability that the chosen effects are physics of the library at all.

    Args:
        adequacy: part of all that can be explained that they account for (openset.py).
        after: excess that is left (noise = 1).
        before: excess of the model file or of its refitted numbers, the larger one.
        known: causes with a name, each as likely beforehand as that there is none for it.
    """
    odds = math.log(known)
    if after >= CLEAN_EXCESS:
        left = after / max(before, 1e-9)
        odds = min(odds, 16.0 * adequacy - 12.0 - 12.0 * max(0.0, left - 0.15))
    return 1.0 / (1.0 + math.exp(-odds))
