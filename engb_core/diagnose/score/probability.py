# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How sure: probabilities of the chosen effects, their rivals and of something else altogether.

The weights of hypotheses of like size come from how surely one leaves less than the other, by the
scatter over stretches of time. That the cause has no name is one hypothesis more beside those of
the library, in nothing privileged: where a name explains all that there is, data cannot tell it
from physics that nobody wrote down and that looks alike, and the odds are those beforehand. The
more is left on what no fit has seen, the less it is what another formula of the same physics
leaves, by the priors in `constants.py`.
"""

from __future__ import annotations

import math

import numpy as np

from engb_core.diagnose.constants import (
    CLEAN_EXCESS,
    CONTAINING,
    FORMULA_ERROR,
    PHYSICS_FOR_NUMBER,
    UNNAMED,
)
from engb_core.diagnose.formula import formula_error, further_odds, probability
from engb_core.diagnose.objective import added_by
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.score.ranking import unlikeliness
from engb_core.diagnose.score.reduced_chi_square import (
    excess,
    reduced_chi_square_of,
    unseen_rows,
)
from engb_core.diagnose.score.stretch_odds import odds_of_less, stretches

__all__ = ['closer_odds', 'further_known', 'own_part_left', 'part_left', 'rival_weights']

# Nats from which on odds are as good as certain.
SURELY = 50.0


def rival_weights(chosen: Fit, rivals: list[Fit], fitter: Fitter, before: float) -> list[float]:
    """Return normalised weights of the chosen fit and its rivals, [chosen, *rivals].

    Args:
        chosen, rivals: fits of like size.
        fitter: of the problem.
        before: excess that the chosen fit's numbers leave without effects.
    """
    floor = formula_error(before)
    # A rival that stands on fewer numbers is held against the chosen effects on just these.
    alike = {chosen.hypothesis.numbers: chosen}
    for fit in rivals:
        numbers = fit.hypothesis.numbers
        if numbers not in alike and set(numbers) < set(chosen.hypothesis.numbers):
            alike[numbers] = fitter.refine(fitter.refit(chosen, numbers))
    weights = [1.0] + [closer_odds(fit, alike.get(fit.hypothesis.numbers, chosen), fitter, floor)
                       * _prior(fit, chosen) * math.exp(min(SURELY, unlikeliness(
                           chosen, fitter) - unlikeliness(fit, fitter))) for fit in rivals]
    total = sum(weights)
    return [weight / total for weight in weights]


def closer_odds(rival: Fit, chosen: Fit, fitter: Fitter, floor: float) -> float:
    """Return the odds, 1 at most, that a rival is nearer to the truth than the chosen fit: that
    its excess over the noise is the smaller one, by how the ratio of both scatters over stretches
    of time. What a nearly right formula leaves is no noise, and its values are not independent;
    its stretches are.

    Args:
        rival, chosen: fits of like size.
        fitter: of the problem.
        floor: excess that even the right formulas leave, in units of the noise as it is thought
            to be.
    """
    weight = 1.0 / fitter.spread ** 2
    noise = weight * fitter.sigma ** 2
    stretch = stretches(fitter)
    share = np.bincount(stretch, noise) / noise.sum()
    first, second = (np.bincount(stretch, weight * fit.residual ** 2) / noise.sum()
                     for fit in (rival, chosen))
    # Noise is no more than what the better one leaves, whatever it was thought to be.
    level = min(1.0, float(first.sum()), float(second.sum()))
    return odds_of_less(first - level * share, second - level * share, share,
                        floor - FORMULA_ERROR * (1.0 - level))


def _prior(fit: Fit, chosen: Fit) -> float:
    """Return how much rarer a rival is beforehand: without a name, physics where wrong numbers of
    the file say it all, or an effect that contains a chosen one and is no better."""
    prior = UNNAMED ** sum(variant.effect.unnamed for variant in fit.hypothesis.variants)
    number = all(variant.number_only and not variant.effect.not_in_file
                 for variant in chosen.hypothesis.variants)
    if number and not all(variant.number_only for variant in fit.hypothesis.variants):
        prior *= PHYSICS_FOR_NUMBER
    contained = {entry for variant in fit.hypothesis.variants for entry in variant.effect.contains}
    if contained & set(chosen.hypothesis.ids):
        prior *= CONTAINING
    return prior


def part_left(fitter: Fitter, before: Fit, after: Fit) -> float:
    """Return the part (0 to 1) of one fit's excess over the noise that another one leaves, on what
    no fit has seen.

    What is fitted takes away more of the stretches that it is fitted to than it explains: with
    enough effects nearly all. Where what is left out holds nothing to explain (a thing that
    happened once), all that was recorded is asked. The noise may be so much more than it is
    thought to be, in what is left as in what there was: a fit that takes away next to nothing
    leaves all.
    """
    unseen = ~fitter.fitted
    for rows in (unseen, np.ones_like(unseen)):
        missed = reduced_chi_square_of(before, fitter, rows) - 1.0
        if missed > CLEAN_EXCESS:
            left = reduced_chi_square_of(after, fitter, rows) - 1.0
            return min(1.0, max(0.0, left - CLEAN_EXCESS) / (missed - CLEAN_EXCESS))
    return 0.0


def further_known(fitter: Fitter, whole: Fit, without: Fit, with_it: Fit,
                  own: float | None = None) -> float:
    """Return the probability that an effect beside others is physics, and no makeshift for what
    their formulas miss: from how much of the `whole` is left `without` it, and how much of that
    `with_it`, of all and of what shows over its `own` coordinate (`flexible.form_left`)."""
    rest = excess(without, fitter) / max(excess(whole, fitter), 1e-9)
    left = part_left(fitter, without, with_it)
    return probability(further_odds(min(1.0, rest), left, own))


def own_part_left(fitter: Fitter, fit: Fit, index: int) -> float:
    """Return the part (0 to 1) of what one effect of a fit says that isn't there on what no fit
    has seen: 0 where its part of the residual is gone with it, 1 where it takes nothing away."""
    said = added_by(fitter, fit, index)
    unseen = unseen_rows(fitter)
    said, left = (values[unseen] / fitter.sigma[unseen] for values in (said, fit.residual))
    size = float(said @ said)
    if size == 0.0:
        return 1.0
    gone = float((left + said) @ (left + said) - left @ left) / size
    return float(np.clip(1.0 - gone, 0.0, 1.0))
