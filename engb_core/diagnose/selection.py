"""Which effects the data call for: parsimony before likelihood, and none rather than a wrong one.

A recording holds thousands of values, so that any imperfection of a formula is significant: what
counts is how much of the mismatch an effect takes away, not whether it does. Excess is the mean
squared residual minus the noise's 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
import math

import numpy as np

from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.fitted import mean_square
from engb_core.diagnose.held_load import load_held, load_moved, numbers_without_load
from engb_core.diagnose.kept_number import LOAD
from engb_core.diagnose.nominal import DELAY
from engb_core.diagnose.numbers import BESIDE_EFFECTS, INSISTED, INSISTED_PART, level, REFITTED
from engb_core.diagnose.search import extend, Search
from engb_core.diagnose.wide_band import RESONANCE

__all__ = ['Selection', 'select']

# Excess that a clean recording may show through errors of noise level and derivatives.
CLEAN_EXCESS = 0.30
# A further effect must take away this part of the remaining excess, this much in units of the
# noise, and this part of the whole mismatch.
FURTHER_PART = 0.28
FIRST_PART = 0.15
FURTHER_LEAST = 0.15
FURTHER_OF_WHOLE = 0.02
THIRD_OF_WHOLE = 0.06
# How little of the whole does not matter if a second effect takes away more than the noise itself,
# and this part of what is left, and if any other leaves this multiple of what it leaves: errors
# of the first one's formula suit no other effect so well.
UNMISTAKABLE, MOST_OF_REST, NEXT_LEAVES = 1.0, 0.7, 2.0
# An effect that contains another one is preferred only if it takes away this part of what the
# simpler one leaves.
CONTAINING_PART = 0.30
MOST_EFFECTS = 3
# Refitted numbers suffice if they leave no more than this part of the file's excess, and no
# more than this in units of the noise.
NUMBERS_PART = 0.02
NUMBERS_MOST = 0.7
# What refitted numbers leave in plain torque, in units of the noise's mean square, from which on
# an effect may be named that leaves no more than this part of it. A resonance is judged elsewhere
# (wide_band.py): it follows every error of timing.
PLAIN_NOISE = 2.5
PLAIN_PART = 0.5
# Log mean square by which one wrong number may fit worse than physics and is preferred.
NUMBER_BONUS = 0.08
# Log mean square by which a description without a name must fit better than physics.
NAMELESS_PRICE = 0.2
# A further effect may raise the plain mean square by this factor at most.
HARM = 1.02
# Beside effects a moved load curve must matter as much as this part of what the file loses, or of
# what refitted numbers leave (numbers.py).
BESIDE_LOAD = 0.2
# Held by a refit of the file, it must raise the mean square by this part.
KEPT_RISE = 0.45
# With the file's load curve held a fit may be this much worse, and is preferred all the same.
HELD_LOSS = 0.12
# Part of what a moved load curve gains that the file's other numbers may cost where they stand.
STANDING_PART = 0.1
# Each fitted parameter must lower the logarithm of the mean square by this much.
PARAMETER_PRICE = 0.004


@dataclass(frozen=True)
class Selection:
    """What was chosen.

    Attributes:
        chosen: the fit of the chosen effects (the base where none is).
        rivals: (effects, fit) of other sets of the same size, best first.
        nominal_excess: of the model file as it stands.
        excess_before: of the refitted nominal model.
        excess_after: of the chosen.
    """

    chosen: Fit
    rivals: tuple[Fit, ...]
    nominal_excess: float
    excess_before: float
    excess_after: float

    @property
    def share(self) -> float:
        """Part of the base's excess that the chosen effects take away."""
        if self.excess_before <= 0.0:
            return 0.0
        return min(1.0, max(0.0, 1.0 - self.excess_after / self.excess_before))


def excess(fit: Fit, fitter: Fitter) -> float:
    """Return the mean squared residual above the noise's."""
    return max(level(fit, fitter) - 1.0, 0.0)


def price(fit: Fit, fitter: Fitter) -> float:
    """Return what fits of like size are ranked by: log mean square plus a price a parameter."""
    parameters = fit.hypothesis.size - len(fit.hypothesis.numbers)
    variants = fit.hypothesis.variants
    number = bool(variants) and all(variant.effect.number_only for variant in variants)
    return math.log(max(level(fit, fitter), 1e-12)) + PARAMETER_PRICE * parameters \
        - NUMBER_BONUS * number \
        + NAMELESS_PRICE * sum(variant.effect.unnamed for variant in variants)


def select(result: Search) -> Selection:
    """Choose the effects, one after another, each with all that is chosen fitted anew."""
    fitter = result.fitter
    before = excess(result.base, fitter)
    nominal = excess(fitter.nominal(), fitter)
    if nominal <= CLEAN_EXCESS:
        return Selection(result.base, (), nominal, before, before)
    if before <= max(CLEAN_EXCESS, min(NUMBERS_PART * nominal, NUMBERS_MOST)):
        plain = _in_plain_torque(result)
        if plain is not None:
            chosen, rivals = plain, [fit for fit in result.of_size(1) if fit is not plain]
        else:
            chosen, rivals = _by_numbers(result, nominal)
    else:
        chosen, rivals = _with_load_held(result, _forward(result, before))
    return Selection(chosen, tuple(rivals), nominal, before, excess(chosen, fitter))


def _in_plain_torque(result: Search) -> Fit | None:
    """Return the effect that takes away most of what refitted numbers leave in plain torque.

    Where effort changes fast the weights forgive what timing alone could do, and with it physics
    that acts at every reversal. An effect may be named by that if the numbers leave far more than
    noise, and it clearly less.
    """
    fitter, base = result.fitter, result.base
    noise = np.concatenate([run.noise for run in fitter.problem.runs])
    left = mean_square(base)
    known = [fit for fit in result.of_size(1) if fit.hypothesis.ids != (RESONANCE,)
             and not fit.hypothesis.variants[0].effect.unnamed]
    if not known or left < PLAIN_NOISE * float(np.mean(noise ** 2)):
        return None
    best = min(known, key=mean_square)
    return best if mean_square(best) < PLAIN_PART * left else None


def _forward(result: Search, before: float) -> Fit:
    fitter = result.fitter
    chosen = result.base
    for size in range(1, MOST_EFFECTS + 1):
        if size > 2:
            extend(result, chosen)
        candidates = sorted((fit for fit in result.of_size(size) if _harmless(fit, chosen)),
                            key=lambda fit: price(fit, fitter))
        if not candidates:
            break
        best = _simplest(candidates, fitter)
        wanted = partial(_worth, fitter=fitter, whole=before, others=candidates)
        if size > 1 and wanted(chosen, best):
            chosen = _begun_again(result, chosen, best)
        if not wanted(chosen, best):
            break
        chosen = best
        if excess(chosen, fitter) < FURTHER_LEAST:
            break
    return chosen


def _begun_again(result: Search, chosen: Fit, larger: Fit) -> Fit:
    """Return the best fit with one effect less than `larger`, also of those begun where it stands:
    what seems to need a companion may have been led astray alone."""
    fitter = result.fitter
    begun = [fitter.refine(fitter.without(larger, index))
             for index in range(len(larger.hypothesis.variants))]
    for fit in begun:
        result.add(fit)
    fits = [chosen, *(fit for fit in begun if _harmless(fit, chosen))]
    return min(fits, key=lambda fit: price(fit, fitter))


def _with_load_held(result: Search, chosen: Fit) -> tuple[Fit, list[Fit]]:
    """Tell rivals apart by the file's load curve, where the file's curve is right."""
    fitter = result.fitter
    size = len(chosen.hypothesis.variants)
    others = [fit for fit in result.of_size(max(size, 1))
              if fit.hypothesis.ids != chosen.hypothesis.ids]
    if size == 0:
        # Nothing is worth a name beside a free load curve, which may have taken it in.
        return _by_numbers(result, excess(fitter.nominal(), fitter))
    near = excess(chosen, fitter) * 1.5 + 0.3
    close = [chosen, *(fit for fit in others if excess(fit, fitter) < near)]
    limit = level(chosen, fitter) + max(HELD_LOSS, 0.3 * excess(chosen, fitter))
    decided, rivals = _decided(result, chosen, close, others, limit)
    if decided is chosen:
        decided = _with_load_moved(result, chosen, limit)
    return decided, rivals


def _with_load_moved(result: Search, chosen: Fit, limit: float) -> Fit:
    """Return the effects together with one number that moves the file's whole load curve, if
    the data insist that the curve is wrong and this one number mends it."""
    fitter = result.fitter
    before, nominal = excess(result.base, fitter), excess(fitter.nominal(), fitter)
    kept = fitter.kept == LOAD
    if (nominal < REFITTED * before and not kept) or _made_up(fitter):
        return chosen
    held = fitter.refit(chosen, numbers_without_load(fitter))
    rise = level(held, fitter) - level(chosen, fitter)
    moved = load_moved(result, chosen) if rise >= INSISTED else []
    if not moved:
        return chosen
    best = min(moved, key=lambda fit: price(fit, fitter)
               - NUMBER_BONUS * fit.hypothesis.variants[-1].effect.number_only)
    lost = min(nominal - before, BESIDE_EFFECTS * before)
    least = KEPT_RISE * level(chosen, fitter) if kept else BESIDE_LOAD * lost
    if rise < least and not _as_it_stands(best, chosen, fitter, rise):
        return chosen
    return best if level(best, fitter) < limit + min(0.02 * rise, 0.3) else chosen


def _as_it_stands(fit: Fit, chosen: Fit, fitter: Fitter, rise: float) -> bool:
    """Whether a fit needs none of the file's numbers changed to be nearly as good as the chosen
    effects with all numbers free, seen beside the `rise` with the load curve unmoved: no refit
    has moved them."""
    held = fitter.refit(fit, tuple(number for number in fitter.numbers if number.name == DELAY))
    return level(held, fitter) < level(chosen, fitter) + max(HELD_LOSS, STANDING_PART * rise)


def _by_numbers(result: Search, nominal: float) -> tuple[Fit, list[Fit]]:
    """Refitted numbers suffice; if it is the load curve that must change, ask what moved it."""
    fitter, base = result.fitter, result.base
    if _made_up(fitter):
        return base, []
    rise = level(fitter.refit(base, numbers_without_load(fitter)), fitter) - level(base, fitter)
    if rise < max(INSISTED, INSISTED_PART * nominal):
        return base, []
    return _decided(result, base, result.of_size(1), [],
                    level(base, fitter) + max(HELD_LOSS, min(0.1 * rise, 0.3)))


def _made_up(fitter: Fitter) -> bool:
    """Whether the load curve moved to make up for another number that a refit of the file held."""
    return fitter.kept not in (None, LOAD)


def _decided(result: Search, chosen: Fit, close: list[Fit], others: list[Fit], limit: float,
             ) -> tuple[Fit, list[Fit]]:
    fitter = result.fitter
    held = sorted(load_held(result, close), key=lambda fit: price(fit, fitter))
    held = [fit for fit in held
            if len(fit.hypothesis.variants) == max(1, len(chosen.hypothesis.variants))]
    if not held or level(held[0], fitter) > limit:
        return chosen, others
    best = _simplest(held, fitter)
    return best, [fit for fit in held if fit is not best]


def _harmless(fit: Fit, chosen: Fit) -> bool:
    """Whether a fit is no worse in plain torque: the weights forgive much where effort changes
    fast, and no effect may live on that."""
    for entry in range(fit.hypothesis.size - len(fit.hypothesis.numbers)):
        parameter = fit.hypothesis.parameter(entry)
        value = fit.vector[len(fit.hypothesis.numbers) + entry]
        if parameter.name == 'frequency' and value > math.log(0.97 * parameter.high):
            # Driven to the edge of what can be seen, it stands for something else.
            return False
    return mean_square(fit) <= HARM * mean_square(chosen)


def _worth(chosen: Fit, best: Fit, fitter: Fitter, whole: float, others: list[Fit]) -> bool:
    """Whether `best` with its further effect is worth more than `chosen`; `whole` is the excess
    without effects, `others` are all fits of the size of `best`."""
    old, new = excess(chosen, fitter), excess(best, fitter)
    gain = old - new
    if not chosen.hypothesis.variants:
        return gain > FURTHER_LEAST and gain > FIRST_PART * old
    pair = len(best.hypothesis.variants) == 2
    least = FURTHER_OF_WHOLE if pair else THIRD_OF_WHOLE
    unmistakable = pair and gain > max(UNMISTAKABLE, MOST_OF_REST * old) and all(
        excess(other, fitter) > NEXT_LEAVES * new for other in others if other is not best)
    return gain > FURTHER_LEAST and gain > FURTHER_PART * old and (
        gain > least * whole or unmistakable)


def _simplest(candidates: list[Fit], fitter: Fitter) -> Fit:
    best = candidates[0]
    for other in candidates[1:]:
        if _contained(other, best):
            left, right = excess(other, fitter), excess(best, fitter)
            if left - right < max(CONTAINING_PART * left, 0.08):
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
