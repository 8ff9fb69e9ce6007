# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Does an effect begin within the recordings? Asked after those that act throughout.

Each named effect is screened by linear least squares with every moment as its onset; the most
promising ones are fitted, and their onsets found anew with what the fit says that they do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
import itertools
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import CLEAN_EXCESS, EDGE, NAMELESS_PRICE
from engb_core.diagnose.fitted import without_effects
from engb_core.diagnose.hypothesis import Variant
from engb_core.diagnose.onset import OnsetScreen
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.optimise.multistart import (
    best_promised,
    is_multimodal,
    promises_of,
    search_around,
)
from engb_core.diagnose.parallel_map import parallel_map
from engb_core.diagnose.score.ranking import price, simplest, worth_a_further_effect, worth_having
from engb_core.diagnose.score.reduced_chi_square import excess, reduced_chi_square_of
from engb_core.diagnose.search.every_effect import (
    in_richer_form,
    physics_effects,
    variants_and_starts,
)
from engb_core.diagnose.selection import Selection
from engb_core.effects.base import Effect
from engb_core.effects.catalogue import get_effect
from engb_core.physics.nominal_torque import (
    N_COULOMB,
    N_INERTIA,
    N_LOAD_CURVATURE,
    N_LOAD_GAIN,
    N_VISCOUS,
)

__all__ = ['with_onset']

Array = NDArray[np.float64]

# Numbers that may change at one moment, though a refit covers them throughout: of the load curve,
# of the sensor of effort; and what a payload, a seal or a lubricant changes, with its place among
# the nominal numbers, and with that of a number which only says what form such a change has.
_SUDDEN_NUMBERS = ('contact_shift', 'load_stiffness_error', 'effort_scale_error')
_SUDDEN_VALUES = {'coulomb_friction_error': N_COULOMB, 'viscous_friction_error': N_VISCOUS,
                  'inertia_error': N_INERTIA, 'load_dependent_friction': N_LOAD_GAIN}
_SHAPES = {'load_curvature': N_LOAD_CURVATURE}
# Effects that are fitted with an onset, the most promising ones, and how often it is found anew.
FITTED, ROUNDS, AGAIN = 4, 6, 3
# Starts of an effect with many narrow minima that are tried, each from its own onset.
SCREENED = 24
# Weight with which a number is held that stands at its bound.
HELD = 1e9


def with_onset(fitter: Fitter, selection: Selection, asked: Fit | None = None) -> Selection:
    """Return the selection, or one in which an effect begins within the recordings, where that is
    worth as much as a further effect would have to be.

    Args:
        fitter: of the problem.
        selection: in which all effects act throughout.
        asked: what was chosen when this was asked before, in nearly the same problem: where the
            same effects were, and none of them began, nothing new is to be expected.
    """
    chosen = selection.chosen
    if excess(chosen, fitter) <= CLEAN_EXCESS and _complexity(chosen) < 2:
        return selection
    if asked is not None and not asked.hypothesis.onsets \
            and set(asked.hypothesis.ids) == set(chosen.hypothesis.ids):
        return selection
    starts = [fitter.base()]
    if chosen.hypothesis.variants:
        count = len(chosen.hypothesis.variants)
        starts += [fitter.without(chosen, index) for index in range(count) if count > 1]
        starts.append(chosen)
    found = _of_those_chosen(fitter, chosen)
    for start in starts:
        found += _fitted(fitter, start, min(_bar(fitter, fit) for fit in (chosen, *found)))
    whole = selection.excess_before
    best, found = _best_begun(fitter, chosen, found, whole)
    if best is chosen:
        return selection
    if excess(best, fitter) > CLEAN_EXCESS or best.hypothesis.has_unnamed:
        # A blow, or a repair, may change more than one thing. Two that begin at two moments may be
        # steps of what grows.
        least = _bar(fitter, best)
        further = [_at_one_moment(fitter, fit) for start in _with_what_begins(fitter, best)
                   for fit in _fitted(fitter, start, least)]
        best, further = _best_begun(fitter, best, further, whole)
        found += further
    best = in_richer_form(fitter, best)
    rivals: dict[frozenset[str], Fit] = {}
    for fit in sorted((*found, chosen), key=lambda fit: fit.cost):
        if len(fit.hypothesis.variants) == len(best.hypothesis.variants):
            # The same effects in another form are no further rival.
            rivals.setdefault(frozenset(fit.hypothesis.ids), fit)
    rivals.pop(frozenset(best.hypothesis.ids), None)
    return Selection(best, tuple(rivals.values()), selection.nominal_excess, whole,
                     excess(best, fitter))


def _best_begun(fitter: Fitter, chosen: Fit, found: list[Fit], whole: float,
                ) -> tuple[Fit, list[Fit]]:
    """Return the best of some fits in which an effect begins, or the chosen one; and these fits
    with such as need fewer effects beside that one."""
    plainer = parallel_map(lambda fit: _without_idle(fitter, fit, whole), found, fitter.threads)
    found = found + [plain for plain, fit in zip(plainer, found, strict=True) if plain is not fit]
    best = chosen
    for claims in sorted(set(map(_complexity, found))):
        alike = [fit for fit in found if _complexity(fit) == claims
                 and _preferred(fit, best, fitter, whole)]
        if not alike:
            continue
        fit = _refined(fitter, simplest(sorted(alike, key=lambda fit: price(fit, fitter)), fitter))
        if _begins(fitter, fit, _refined(fitter, _throughout(fitter, fit)), whole):
            best = fit
    return best, found


def _with_what_begins(fitter: Fitter, fit: Fit) -> list[Fit]:
    """Return the fit, and one with no more than those of its effects that begin, not fitted anew:
    what acts throughout may stand for another one that begins with them."""
    gone = {index for index, variant in enumerate(fit.hypothesis.variants)
            if variant.onset is None}
    alone = [fitter.evaluate(*without_effects(fit, gone))] if gone else []
    return [fit, *alone]


def _at_one_moment(fitter: Fitter, fit: Fit) -> Fit:
    """Return the fit with its last effect begun when the one that begins before it in the list
    does."""
    *others, last = fit.hypothesis.variants
    onset = next(variant.onset for variant in reversed(others) if variant.onset is not None)
    if onset == last.onset:
        return fit
    variants = (*others, replace(last, onset=onset))
    return fitter.iterate(fitter.evaluate(
        replace(fit.hypothesis, variants=variants), fit.vector), ROUNDS)


def _without_idle(fitter: Fitter, fit: Fit, whole: float) -> Fit:
    """Return the fit without such effects as are not worth having beside the one that begins: what
    was chosen while all had to act throughout may have stood for that."""
    while True:
        fewer = [fitter.refine(fitter.without(fit, index))
                 for index, variant in enumerate(fit.hypothesis.variants) if variant.onset is None]
        plain = [entry for entry in fewer if entry.hypothesis.variants
                 and not worth_a_further_effect(excess(entry, fitter), excess(fit, fitter), whole)]
        if not plain:
            return fit
        fit = min(plain, key=lambda entry: entry.cost)


def _cost_of_all(fitter: Fitter, fit: Fit) -> float:
    """Return the weighted sum of squares over all values, also those that no fit may look at."""
    return float(np.sum((fit.residual / fitter.spread) ** 2))


def _bar(fitter: Fitter, fit: Fit) -> float:
    """Return the cost of all values that a named effect must promise to stay below: a description
    without a name may fit better by its price, and is not preferred."""
    nameless = sum(variant.effect.unnamed for variant in fit.hypothesis.variants)
    return _cost_of_all(fitter, fit) * math.exp(NAMELESS_PRICE * nameless)


def _complexity(fit: Fit) -> int:
    """Return how many things a fit claims. A description without a name claims that there is
    physics which nobody wrote down: no less than that a known effect has a beginning; and so does
    an effect that grows over the recording as suddenly as it can."""
    hypothesis = fit.hypothesis
    return len(hypothesis.variants) + len(hypothesis.onsets) + sum(
        variant.effect.unnamed or _grows_at_once(fit, index)
        for index, variant in enumerate(hypothesis.variants))


def _grows_at_once(fit: Fit, index: int) -> bool:
    """Whether the exponent by which an effect grows over the recording is driven to the end of its
    range: it stands for a change at one moment."""
    effect, named = fit.hypothesis.variants[index].effect, fit.hypothesis.named(fit.vector, index)
    return any(named[entry.name] > EDGE * entry.high for entry in effect.parameters
               if entry.name in effect.at_once and entry.kind == 'exponent')


def _preferred(fit: Fit, chosen: Fit, fitter: Fitter, whole: float) -> bool:
    """Whether a fit is preferred to the chosen one: what is richer must be worth it."""
    new, old = excess(fit, fitter), excess(chosen, fitter)
    if sorted(fit.hypothesis.ids) == sorted(chosen.hypothesis.ids):
        # It is no effect more: when it begins is a number, and `_begins` asks whether it does.
        return worth_having(1.0 + new, 1.0 + old, len(fit.hypothesis.onsets) or 1)
    if _complexity(fit) > _complexity(chosen):
        return worth_a_further_effect(old, new, whole)
    if _complexity(fit) == _complexity(chosen):
        return price(fit, fitter) < price(chosen, fitter)
    return not worth_a_further_effect(new, old, whole)


def _begins(fitter: Fitter, fit: Fit, throughout: Fit, whole: float) -> bool:
    """Whether effects begin where a fit says so, and do not act throughout: that they do must
    leave so much more before the onset as a further effect has to explain; or, where it gives
    them up so as not to, in all, and no less before the onset."""
    rows = np.logical_or.reduce([onset.before(fitter.problem.times)
                                 for _, onset in fit.hypothesis.onsets])
    old, new = (reduced_chi_square_of(entry, fitter, rows) - 1.0 for entry in (throughout, fit))
    if worth_a_further_effect(old, new, whole, float(np.mean(rows))):
        return True
    # Of what that explains half is for there being such an effect, half for its beginning.
    return new <= old and worth_a_further_effect(
        excess(throughout, fitter), excess(fit, fitter), whole, 0.5)


def _refined(fitter: Fitter, fit: Fit) -> Fit:
    """Return the fit at its minimum; where its cost has many, also of those around."""
    fit = fitter.refine(fit)
    return search_around(fitter, fit) if is_multimodal(fit) else fit


def _throughout(fitter: Fitter, fit: Fit) -> Fit:
    """Return the fit with the same effects acting from the recordings' begin."""
    variants = tuple(replace(variant, onset=None) for variant in fit.hypothesis.variants)
    return fitter.evaluate(fitter.hypothesis(variants, fit.hypothesis.numbers), fit.vector)


def _of_those_chosen(fitter: Fitter, chosen: Fit) -> list[Fit]:
    """Return fits of the chosen effects, of which one begins within the recordings: begun at what
    it does throughout, which screening from an effect's own starts may not come near."""
    found = []
    variants = chosen.hypothesis.variants
    for index, variant in enumerate(variants):
        if variant.effect.unnamed or variant.onset is not None:
            continue
        last = _with_last(fitter, chosen, index)
        begun = _moved(fitter, last)
        if begun is None:
            continue
        fit = _settled(fitter, fitter.iterate(begun, ROUNDS))
        found.append(fit)
        if variant.effect.at_once:
            sudden = _sudden(fitter, fit)
            found.append(_settled(fitter, fitter.iterate(sudden, ROUNDS)))
    return found


def _sudden(fitter: Fitter, fit: Fit) -> Fit:
    """Return the fit with its last effect there at once from its onset on.

    What says how it grows over the recording acts from the first sample on, where the onset hides
    it: the recording does not tell it, and the model would have it grow again in any other.
    """
    *others, last = fit.hypothesis.variants
    effect = _at_once(last.effect)
    held = tuple(last.effect.at_once[entry.name] for entry in last.effect.parameters
                 if entry.name in last.effect.at_once)
    variant = replace(last, effect=effect, constants=(*held, *last.constants))
    hypothesis = fitter.hypothesis((*others, variant), fit.hypothesis.numbers)
    return fitter.evaluate(hypothesis, fit.vector[:hypothesis.size])


def _with_last(fitter: Fitter, fit: Fit, index: int) -> Fit:
    """Return the fit with one of its effects at the end of its list."""
    variants = fit.hypothesis.variants
    order = [*(place for place in range(len(variants)) if place != index), index]
    count = len(fit.hypothesis.numbers)
    owners = np.array([owner for owner, _, _ in fit.hypothesis.places])
    vector = np.concatenate([fit.vector[:count], *(fit.vector[count:][owners == owner]
                                                   for owner in order)])
    return fitter.evaluate(fitter.hypothesis(tuple(variants[place] for place in order),
                                             fit.hypothesis.numbers), vector)


@dataclass(frozen=True)
class _Candidate:
    """An effect with an onset, where its fit may start, its sizes (p,), and the cost expected."""

    cost: float
    variant: Variant
    setting: dict[str, float]
    sizes: Array


def _fitted(fitter: Fitter, start: Fit, least: float) -> list[Fit]:
    """Return fits of what promises to lower the cost of all values below `least`, one effect with
    an onset more than `start`."""
    effects = [*(effect for effect in physics_effects(fitter) if not effect.unnamed),
               *map(get_effect, _SUDDEN_NUMBERS), *_sudden_values(start)]
    screen = _screen(fitter, start, fitter.columns(start, range(start.hypothesis.size)))

    def screened(effect: Effect) -> list[_Candidate]:
        return _screened(fitter, start, screen, effect)

    cases = [effect for effect in effects if effect.id not in start.hypothesis.ids
             and (effect.applies is None or effect.applies(fitter.problem.scene))]
    best: dict[str, list[_Candidate]] = {}
    parts: list[list[_Candidate]] = list(parallel_map(screened, cases, fitter.threads))
    for entry in itertools.chain.from_iterable(parts):
        best.setdefault(entry.variant.effect.id, []).append(entry)
    leading = sorted((sorted(entries, key=lambda entry: entry.cost)
                      for entries in best.values()), key=lambda entries: entries[0].cost)
    hopeful = [entries for entries in leading if entries[0].cost < least][:FITTED]

    def fitted(entries: list[_Candidate]) -> Fit:
        return _settled(fitter, _begun(fitter, start, entries))

    return list(parallel_map(fitted, hopeful, fitter.threads))


def _sudden_values(start: Fit) -> list[Effect]:
    """Return the nominal numbers as effects that begin: each from what a fit has before."""
    nominal = start.hypothesis.physics(start.vector, 0).nominal
    spreads = {number.place: number.spread for number in start.hypothesis.numbers
               if not number.effect and not number.logarithmic}
    found = []
    for name, place in _SUDDEN_VALUES.items():
        before, effect = float(nominal[place]), get_effect(name)
        value, *shapes = effect.parameters
        begun = 1.1 * before if before > value.low else before + 0.1 * spreads.get(place, 0.0)
        if begun > before:
            found.append(_held(replace(effect, parameters=(
                replace(value, none=before, starts=(begun,)), *shapes)), {
                    shape.name: float(nominal[_SHAPES[shape.name]]) for shape in shapes}))
    return found


def _screened(fitter: Fitter, start: Fit, screen: OnsetScreen, effect: Effect,
              ) -> list[_Candidate]:
    """Return the effect's starts, each with the onset that promises most."""
    found = []
    for variant, starts in variants_and_starts(fitter, start, _at_once(effect)):
        for entry in starts:
            cost, onset, sizes = screen.least(entry.columns)
            if onset is not None and variant.reaches(sizes):
                found.append(_Candidate(cost, replace(variant, onset=onset), entry.setting, sizes))
    return found


def _at_once(effect: Effect) -> Effect:
    """Return the effect as it is when it is there from one moment on: what says how it grows over
    the recording is held."""
    return _held(effect, effect.at_once)


def _held(effect: Effect, values: Mapping[str, float]) -> Effect:
    """Return the effect with the last of its parameters held at such values, by name."""
    if not values:
        return effect
    kept = tuple(entry for entry in effect.parameters if entry.name not in values)
    held = effect.parameters[len(kept):]
    given = effect.set_constants
    return replace(
        effect, parameters=kept,
        constants=(*((entry.name, entry.unit) for entry in held), *effect.constants),
        set_constants=lambda scene: {**values, **(given(scene) if given else {})})


def _screen(fitter: Fitter, start: Fit, columns: Array) -> OnsetScreen:
    """Return what effects that begin would take away of a fit's cost; `columns` (m, size) are its
    derivatives."""
    centre, spread = start.hypothesis.prior
    low, high = start.hypothesis.bounds
    held = (start.vector <= low) | (start.vector >= high)
    ridge = np.where(held, HELD * np.sum((columns / fitter.spread[:, None]) ** 2, axis=0) + 1.0,
                     spread ** -2.0)
    pull = np.where(held, 0.0, (centre - start.vector) / spread ** 2)
    return OnsetScreen(fitter.problem.times, columns, start.residual, 1.0 / fitter.spread, ridge,
                       pull)


def _begun(fitter: Fitter, start: Fit, entries: list[_Candidate]) -> Fit:
    """Return the fit of the effect from where it promises most."""
    first = entries[0]
    if first.variant.effect.multimodal:
        # Each from its own onset: where the first one is led astray, another may not be.
        promised = promises_of(fitter, start, [
            (fitter.hypothesis((*start.hypothesis.variants, entry.variant),
                               start.hypothesis.numbers), entry.setting)
            for entry in entries[:SCREENED]
            if entry.variant.constants == first.variant.constants])
        return best_promised(fitter, start, promised, ROUNDS, fitter.iterate)
    fits = [fitter.fit_from(start, entry.variant, entry.setting, entry.sizes, ROUNDS)
            for entry in entries[:2]]
    return min(fits, key=lambda fit: fit.cost)


def _settled(fitter: Fitter, fit: Fit) -> Fit:
    """Return the fit with the onset found anew until it stays."""
    for _ in range(AGAIN):
        moved = _moved(fitter, fit)
        if moved is None:
            break
        moved = fitter.iterate(moved, ROUNDS)
        if fit.hypothesis.variants[-1].effect.multimodal:
            # From another onset on other numbers fit, and derivatives do not lead there.
            moved = search_around(fitter, moved)
        if moved.cost >= fit.cost:
            break
        fit = moved
    return fit


def _moved(fitter: Fitter, fit: Fit) -> Fit | None:
    """Return the fit with the onset that is best for what the effect does there; None where that
    is where it stands."""
    *others, last = fit.hypothesis.variants
    without, kept = fit.hypothesis.before(last.effect.id, last.onset)
    rest = fitter.evaluate(without, fit.vector[kept])
    whole = fitter.predict(replace(
        fit.hypothesis, variants=(*others, replace(last, onset=None))), fit.vector)
    columns = fitter.columns(rest, range(without.size))
    _, onset, _ = _screen(fitter, rest, columns).least((whole - rest.predicted)[:, None])
    if onset is None or onset == last.onset:
        return None
    hypothesis = replace(fit.hypothesis, variants=(*others, replace(last, onset=onset)))
    return fitter.evaluate(hypothesis, fit.vector)
