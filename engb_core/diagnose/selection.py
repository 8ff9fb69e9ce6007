# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which effects the data call for: parsimony before likelihood, and none rather than a wrong one.

A recording holds thousands of values, so that any imperfection of a formula is significant: what
counts is how much of the mismatch an effect takes away, not whether it does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
import math

import numpy as np

from engb_core.diagnose.constants import (
    CLEAN_EXCESS,
    EDGE,
    FORMULA_ERROR,
    LARGER_PART,
    MOST_NOISE,
    WORTH_PART,
)
from engb_core.diagnose.fitted import mean_square
from engb_core.diagnose.formula import formula_odds, no_more, part_of_formula
from engb_core.diagnose.numbers.load_cause import moved_by, selected_by_load_curve, standing
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.resonance.wide_band import RESONANCE, rings, silent_shafts
from engb_core.diagnose.score.noise_like import is_noise
from engb_core.diagnose.score.probability import part_left
from engb_core.diagnose.score.ranking import (
    little_more,
    price,
    simplest,
    worth_a_further_effect,
)
from engb_core.diagnose.score.recording_folds import better_on_others
from engb_core.diagnose.score.reduced_chi_square import excess
from engb_core.diagnose.search.every_effect import extend, in_other_form, Search
from engb_core.diagnose.smoothed_noise import only_smooth

__all__ = ['Selection', 'makeshifts', 'select']

# Others that are fitted in the place of each of several chosen effects.
IN_PLACE = 3


@dataclass(frozen=True)
class Selection:
    """What was chosen.

    Attributes:
        chosen: the fit of the chosen effects (the base where none is).
        rivals: fits of other sets that may be instead, best first.
        nominal_excess: of the model file as it stands.
        excess_before: of the refitted nominal model.
        excess_after: of the chosen.
        believed: effect → (its probability, its rival), where it follows from other evidence than
            how much of the mismatch is taken away.
        consistent: whether the model file leaves but noise.
        further: (effect, part of what the chosen leave that it would take away) of known effects
            beside them, most first.
    """

    chosen: Fit
    rivals: tuple[Fit, ...]
    nominal_excess: float
    excess_before: float
    excess_after: float
    believed: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    consistent: bool = False
    further: tuple[tuple[str, float], ...] = ()


def select(result: Search) -> Selection:
    """Choose the effects, one after another, each with all that is chosen fitted anew. Where one
    turns out to be a makeshift once all is fitted together the others are chosen without it."""
    selection = _select(result)
    fitter, chosen = result.fitter, selection.chosen
    if RESONANCE in chosen.hypothesis.ids or only_smooth(fitter, chosen):
        refined = fitter.finish(fitter.refine(chosen))
        for index in makeshifts(fitter, refined):
            return select(result.without(chosen.hypothesis.ids[index]))
    return selection


def makeshifts(fitter: Fitter, fit: Fit) -> set[int]:
    """Return which effects of a finished fit are none: shafts that do not ring, and what smooths
    the noise of the motion and no more."""
    return silent_shafts(fitter, fit) | only_smooth(fitter, fit)


def _select(result: Search) -> Selection:
    fitter = result.fitter
    before = excess(result.base, fitter)
    nominal = excess(fitter.nominal(), fitter)
    if is_noise(fitter, fitter.nominal()):
        return Selection(result.base, (), nominal, before, before, consistent=True)
    named = result.base if before <= CLEAN_EXCESS else _forward(result, before)
    if before <= CLEAN_EXCESS or _a_miss_of_numbers(before, excess(named, fitter), nominal):
        plain = _in_plain_torque(result)
        if plain is not None:
            chosen, rivals = plain, [fit for fit in result.of_size(1) if fit is not plain]
        else:
            chosen, rivals = moved_by(result, nominal)
    else:
        chosen, rivals = selected_by_load_curve(result, named)
    chosen, rivals = standing(fitter, chosen, rivals)
    return Selection(chosen, tuple(rivals), nominal, before, excess(chosen, fitter),
                     further=_further(result, chosen))


def _further(result: Search, chosen: Fit) -> tuple[tuple[str, float], ...]:
    """Return the known effects that would take away a part of what the chosen ones leave, and
    which part, most first."""
    fitter, left = result.fitter, excess(chosen, result.fitter)
    if not chosen.hypothesis.variants or left <= CLEAN_EXCESS:
        return ()
    ids, parts = set(chosen.hypothesis.ids), dict[str, float]()
    for fit in _candidates(result, len(ids) + 1, chosen):
        others = set(fit.hypothesis.ids)
        part = 1.0 - excess(fit, fitter) / left
        if ids < others and not fit.hypothesis.has_unnamed and part >= WORTH_PART:
            (effect,) = others - ids
            parts[effect] = max(part, parts.get(effect, 0.0))
    return tuple(sorted(parts.items(), key=lambda entry: -entry[1]))


def _a_miss_of_numbers(before: float, named: float, nominal: float) -> bool:
    """Whether what refitted numbers leave, `before`, is what other formulas miss of the file's
    excess `nominal`: no more than that, nor than may be noise, and effects beside the numbers,
    which leave `named`, are no likelier to be physics."""
    return before <= min(part_of_formula() * nominal, MOST_NOISE) \
        and not worth_a_further_effect(before, named, nominal)


def _in_plain_torque(result: Search) -> Fit | None:
    """Return the effect that takes away most of what refitted numbers leave in plain torque.

    Where effort changes fast the weights forgive what timing alone could do, and with it physics
    that acts at every reversal. An effect may be named by that if the numbers leave more than may
    be noise, and it takes away the larger part. A resonance is judged elsewhere (wide_band.py): it
    follows every error of timing.
    """
    fitter, base = result.fitter, result.base
    noise = np.concatenate([run.noise for run in fitter.problem.runs])
    left = mean_square(base)
    known = [fit for fit in result.of_size(1) if fit.hypothesis.ids != (RESONANCE,)
             and not fit.hypothesis.variants[0].effect.unnamed]
    if not known or left < (1.0 + MOST_NOISE) * float(np.mean(noise ** 2)):
        return None
    best = min(known, key=mean_square)
    return best if mean_square(best) < LARGER_PART * left else None


def _forward(result: Search, before: float) -> Fit:
    fitter = result.fitter
    chosen = result.base
    while True:
        size = len(chosen.hypothesis.variants) + 1
        if size > 2:
            extend(result, [chosen])
        candidates = _candidates(result, size, chosen)
        if not candidates:
            break
        best = simplest(candidates, fitter)
        wanted = partial(_worth, fitter=fitter, whole=before, others=candidates)
        if size > 1 and _needed(chosen, best, fitter, before):
            chosen = _begun_again(result, chosen, best)
        elif size == 1 and not wanted(chosen, best):
            # Alone each may be in the wrong place, or hide behind the other.
            best = _of_best_pair(result, best, before)
        if not wanted(chosen, best):
            further = _two_further(result, chosen, before)
            if further is None:
                break
            best = further
        chosen = best
        if excess(chosen, fitter) < FORMULA_ERROR:
            break
    return _of_all_in_place(result, chosen)


def _two_further(result: Search, chosen: Fit, before: float) -> Fit | None:
    """Return the best fit of two effects more than what is chosen, where one more does harm alone
    but takes away what is worth it of the excess `before`: it may do for both what each does in
    another place. None where there is none that is worth it, each beside the other."""
    fitter, count = result.fitter, len(chosen.hypothesis.variants)
    ids, least = set(chosen.hypothesis.ids), excess(chosen, fitter)
    harmful = [fit for fit in result.of_size(count + 1)
               if count and ids < set(fit.hypothesis.ids) and not fit.hypothesis.has_unnamed
               and not _harmless(fit, chosen, fitter)]
    one = min(harmful, key=lambda fit: price(fit, fitter), default=None)
    if one is None or not worth_a_further_effect(least, excess(one, fitter), before):
        return None
    extend(result, [one], IN_PLACE)
    both = [fit for fit in _candidates(result, count + 2, chosen)
            if set(one.hypothesis.ids) < set(fit.hypothesis.ids)
            and not fit.hypothesis.has_unnamed]
    if not both or not worth_a_further_effect(
            excess(one, fitter), excess(both[0], fitter), before):
        return None
    other = fitter.without(both[0], both[0].hypothesis.ids.index(
        next(iter(set(one.hypothesis.ids) - ids))))
    return both[0] if worth_a_further_effect(
        excess(other, fitter), excess(both[0], fitter), before) else None


def _of_all_in_place(result: Search, chosen: Fit) -> Fit:
    """Return the best fit of as many effects as are chosen, once for each of them others have been
    fitted in its place beside the rest: an effect that was the best of the first may be another's
    makeshift beside the last, and how sure it is follows from those others."""
    fitter, count = result.fitter, len(chosen.hypothesis.variants)
    if count < 2:
        return chosen
    extend(result, [fitter.without(chosen, index) for index in range(count)], IN_PLACE)
    candidates = _candidates(result, count, chosen)
    if not candidates:
        # Fitted anew, even what was chosen may be driven to its edge.
        return chosen
    best = simplest(candidates, fitter)
    return best if price(best, fitter) < price(chosen, fitter) else chosen


def _candidates(result: Search, size: int, chosen: Fit) -> list[Fit]:
    """Return the fits with so many effects that do no harm beside what is chosen, best first."""
    return sorted((fit for fit in result.of_size(size) if _harmless(fit, chosen, result.fitter)),
                  key=lambda fit: price(fit, result.fitter))


def _of_best_pair(result: Search, single: Fit, before: float) -> Fit:
    """Return the best fit of one effect, also of those begun where the best pair has them, if that
    is likelier all that is missing than a makeshift, by what it leaves on what no fit has seen;
    the pair itself, where neither of it is worth much of the excess `before` alone. Two that are
    worth nothing alone can be bent to each other, and a wrong pair keeps other causes from being
    asked."""
    fitter = result.fitter
    pairs = _candidates(result, 2, result.base)
    if not pairs:
        return single
    pair = simplest(pairs, fitter)
    if formula_odds(part_left(fitter, result.base, pair)) < 1.0:
        return single
    again = _begun_again(result, single, pair)
    return again if before - excess(again, fitter) > WORTH_PART * before else pair


def _begun_again(result: Search, chosen: Fit, larger: Fit) -> Fit:
    """Return the best fit with one effect less than `larger`, also of those begun where it stands:
    what seems to need a companion may have been led astray alone."""
    fitter = result.fitter
    begun = [fitter.refine(fitter.without(larger, index))
             for index in range(len(larger.hypothesis.variants))]
    for fit in begun:
        result.add(fit)
    # Without the companion an effect may have another form.
    begun += filter(None, [in_other_form(result, [fit]) for fit in begun])
    fits = [chosen, *(fit for fit in begun if _harmless(fit, chosen, fitter))]
    return min(fits, key=lambda fit: price(fit, fitter))


def _harmless(fit: Fit, chosen: Fit, fitter: Fitter) -> bool:
    """Whether a fit is no worse in plain torque: the weights forgive much where effort changes
    fast, and no effect may live on that; nor on smoothing noise and timing."""
    for index, variant in enumerate(fit.hypothesis.variants):
        if variant.effect.id == RESONANCE and not rings(
                fit.hypothesis.named(fit.vector, index), fitter.problem.bandwidth):
            return False
    for entry in range(fit.hypothesis.size - len(fit.hypothesis.numbers)):
        parameter = fit.hypothesis.parameter(entry)
        value = fit.vector[len(fit.hypothesis.numbers) + entry]
        if parameter.kind in ('frequency', 'natural_frequency') \
                and value > math.log(EDGE * parameter.high):
            # Driven to the edge of what can be seen, it stands for something else.
            return False
    return not _at_the_edge(fit, chosen) and no_more(mean_square(fit), mean_square(chosen))


def _at_the_edge(fit: Fit, chosen: Fit) -> bool:
    """Whether an effect beside the chosen ones is as large as any that is possible: it stands for
    something else."""
    if not chosen.hypothesis.variants:
        return False
    for index, variant in enumerate(fit.hypothesis.variants):
        sizing = variant.sizing
        if sizing.none is None or math.isinf(sizing.none) \
                or variant.effect.id in chosen.hypothesis.ids:
            continue
        size = fit.hypothesis.named(fit.vector, index)[sizing.name]
        most = sizing.high if size > sizing.none else sizing.low
        if abs(size - sizing.none) > EDGE * abs(most - sizing.none):
            return True
    return False


def _worth(chosen: Fit, best: Fit, fitter: Fitter, whole: float, others: list[Fit]) -> bool:
    """Whether `best` with its further effect is worth more than `chosen`; `whole` is the excess
    without effects, `others` are all fits of the size of `best`."""
    old, new = excess(chosen, fitter), excess(best, fitter)
    if not chosen.hypothesis.variants:
        return old - new > FORMULA_ERROR and old - new > WORTH_PART * old
    if not _needed(chosen, best, fitter, whole):
        return False
    # What another formula of the first one misses may suit it by chance, but hardly it alone of
    # all known effects, and not on recordings that it was not fitted to.
    return old - new > part_of_formula() * whole or _alone(chosen, best, fitter, others) \
        or better_on_others(fitter, chosen, best)


def _needed(chosen: Fit, best: Fit, fitter: Fitter, whole: float) -> bool:
    """Whether something is missing beside the chosen effects that the further effect of `best`
    takes away, be it this one or another: it is worth it, or recordings that it was not fitted to
    are better with it."""
    old, new = excess(chosen, fitter), excess(best, fitter)
    return worth_a_further_effect(old, new, whole) or (
        not little_more(old, new) and better_on_others(fitter, chosen, best))


def _alone(chosen: Fit, best: Fit, fitter: Fitter, others: list[Fit]) -> bool:
    """Whether no other known effect beside the chosen ones leaves little more than `best`."""
    ids, least = set(chosen.hypothesis.ids), excess(best, fitter)
    return not any(little_more(excess(fit, fitter), least) for fit in others
                   if ids < set(fit.hypothesis.ids) and not fit.hypothesis.has_unnamed
                   and fit.hypothesis.ids != best.hypothesis.ids)
