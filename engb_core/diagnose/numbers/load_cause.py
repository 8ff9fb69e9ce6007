# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What moved the file's load curve, and which hypothesis needs none of the file's numbers changed.

A free load curve takes in much of what other effects do. Where the file's curve is right, or wrong
by one number, it tells rivals apart; where all of the file's numbers are right, they do.
"""

from __future__ import annotations

from collections.abc import Sequence

from engb_core.diagnose.constants import CLEAN_EXCESS, FORMULA_ERROR
from engb_core.diagnose.formula import as_refitted, chance_part, formula_error, part_of_formula
from engb_core.diagnose.held_parameters import LOAD
from engb_core.diagnose.numbers.held_load_curve import (
    best_of_each,
    both_moved,
    load_held,
    load_moved,
    load_scaled,
    MOVE_THE_LOAD,
    numbers_without_load,
    singles_with_load_held,
)
from engb_core.diagnose.numbers.wrong_numbers import refitted, was_refitted
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.parallel_map import parallel_map
from engb_core.diagnose.score.ranking import number_price, plain_price, price, simplest
from engb_core.diagnose.score.reduced_chi_square import excess, reduced_chi_square
from engb_core.diagnose.search.every_effect import Search

__all__ = ['moved_by', 'standing', 'selected_by_load_curve']

# Single causes of a moved load curve that may have a second one beside them.
LEADING = 4
# Further rounds of a fit that leads.
MORE_ROUNDS = 12
# Hypotheses that are tried with the file's numbers as they stand.
CLOSE = 8


def selected_by_load_curve(result: Search, chosen: Fit) -> tuple[Fit, list[Fit]]:
    """Tell rivals apart by the file's load curve, where the file's curve is right."""
    fitter = result.fitter
    size = len(chosen.hypothesis.variants)
    others = [fit for fit in result.of_size(max(size, 1))
              if fit.hypothesis.ids != chosen.hypothesis.ids]
    if size == 0:
        # Nothing is worth a name beside a free load curve, which may have taken it in.
        return moved_by(result, excess(fitter.nominal(), fitter))
    near = excess(chosen, fitter) / (1.0 - chance_part()) + CLEAN_EXCESS
    close = [chosen, *(fit for fit in others if excess(fit, fitter) < near)]
    limit = reduced_chi_square(chosen, fitter) + max(
        FORMULA_ERROR, chance_part() * excess(chosen, fitter))
    held = [fit for fit in load_held(result, close) if len(fit.hypothesis.variants) == size]
    decided, rivals = _decided(fitter, chosen, held, others, limit)
    if decided is chosen:
        return _with_load_moved(result, chosen, rivals, limit)
    return _or_two(result, decided, rivals, held)


def _with_load_moved(result: Search, chosen: Fit, rivals: list[Fit], limit: float,
                     ) -> tuple[Fit, list[Fit]]:
    """Return the effects together with one number that moves the file's whole load curve, if
    the data insist that the curve is wrong and this one number mends it."""
    fitter = result.fitter
    before, nominal = excess(result.base, fitter), excess(fitter.nominal(), fitter)
    kept = LOAD in fitter.held
    if not kept and (as_refitted(nominal, before) or was_refitted(fitter)) or _made_up(fitter):
        return chosen, rivals
    held = fitter.refit(chosen, numbers_without_load(fitter))
    rise = reduced_chi_square(held, fitter) - reduced_chi_square(chosen, fitter)
    moved = _led(fitter, load_moved(result, chosen)) if rise >= CLEAN_EXCESS else []
    if not moved:
        return chosen, rivals
    best = moved[0]
    if reduced_chi_square(best, fitter) >= limit + formula_error(rise):
        # A refit that scaled the curve around what moves it has left it scaled.
        scaled = [both for fit in moved if (both := load_scaled(result, fit)) is not None]
        moved = _led(fitter, scaled) if scaled else moved
        best = moved[0]
    # What the fit leaves is the noise that the curve has to stand out of, and what other formulas
    # of the effects miss may lie along it.
    least = max(CLEAN_EXCESS * reduced_chi_square(chosen, fitter), part_of_formula() * before)
    if rise < least and not _as_it_stands(best, chosen, fitter, rise):
        return chosen, rivals
    if reduced_chi_square(best, fitter) >= limit + formula_error(rise):
        return chosen, rivals
    near = reduced_chi_square(best, fitter) + FORMULA_ERROR
    others = [fit for fit in rivals if reduced_chi_square(fit, fitter) < near
              and len(fit.hypothesis.variants) == len(chosen.hypothesis.variants)]
    alike = best_of_each([*moved, *both_moved(result, others[:LEADING - 1])])
    best = _better(best, alike, fitter)
    return best, [fit for fit in alike
                  if set(fit.hypothesis.ids) != set(best.hypothesis.ids)]


def _led(fitter: Fitter, moved: list[Fit]) -> list[Fit]:
    """Return fits with one more number that moves the load curve, the best first, those that lead
    fitted on: what comes to its minimum slowly is not to lose for that."""
    def ranked(fits: Sequence[Fit]) -> list[Fit]:
        return sorted(fits, key=lambda fit: price(fit, fitter)
                      - number_price() * fit.hypothesis.variants[-1].number_only)

    leading = ranked(moved)
    return ranked([*parallel_map(lambda fit: fitter.refine(fit, MORE_ROUNDS), leading[:LEADING],
                                 fitter.threads), *leading[LEADING:]])


def _as_it_stands(fit: Fit, chosen: Fit, fitter: Fitter, rise: float) -> bool:
    """Whether a fit needs none of the file's numbers changed to be nearly as good as the chosen
    effects with all numbers free, seen beside the `rise` with the load curve unmoved: no refit
    has moved them."""
    with_file = reduced_chi_square(fitter.with_file(fit), fitter)
    return with_file < reduced_chi_square(chosen, fitter) + formula_error(rise)


def moved_by(result: Search, nominal: float) -> tuple[Fit, list[Fit]]:
    """Refitted numbers suffice; if it is the load curve that must change, ask what moved it."""
    fitter, base = result.fitter, result.base
    if _made_up(fitter) or (was_refitted(fitter) and LOAD not in fitter.held):
        return base, []
    with_curve = fitter.refit(base, numbers_without_load(fitter))
    rise = reduced_chi_square(with_curve, fitter) - reduced_chi_square(base, fitter)
    if rise < max(CLEAN_EXCESS, part_of_formula() * nominal):
        return base, []
    limit = reduced_chi_square(base, fitter) + formula_error(rise)
    held = singles_with_load_held(result)
    if fitter.load_shape:
        # Where any curve over the position leaves nothing, there is no loop.
        held = [fit for fit in held if not any(variant.effect.knows_reversals
                                               for variant in fit.hypothesis.variants)]
    decided, rivals = _decided(fitter, base, held, [], limit)
    if decided is not base:
        return _or_two(result, decided, rivals, held)
    ranked = sorted(held, key=lambda fit: price(fit, fitter))
    # Two that move the curve may each be far off alone.
    firsts = [fit for place, fit in enumerate(ranked)
              if place < LEADING or fit.hypothesis.ids[0] in MOVE_THE_LOAD]
    return _decided(fitter, base, both_moved(result, firsts), [], limit)


def _or_two(result: Search, decided: Fit, rivals: list[Fit], held: list[Fit],
            ) -> tuple[Fit, list[Fit]]:
    """Return two causes of the moved load curve in place of the one that was decided on, where
    they fit better than any one does."""
    fitter = result.fitter
    if len(decided.hypothesis.variants) != 1 or decided.hypothesis.ids[0] not in MOVE_THE_LOAD:
        return decided, rivals
    single = [fitter.refine(fit) for fit in held if fit.hypothesis.ids[0] in MOVE_THE_LOAD]
    free = [fit for fit in result.of_size(1) if fit.hypothesis.ids[0] in MOVE_THE_LOAD]
    least = min((result.base, *free), key=lambda fit: plain_price(fit, fitter))
    if not _clearly_better(least, min(single, key=lambda fit: plain_price(fit, fitter)), fitter):
        # No second one can move it to where it were better.
        return decided, rivals
    pairs = both_moved(result, single)
    best = _better(min(single, key=lambda fit: plain_price(fit, fitter)), pairs, fitter)
    if len(best.hypothesis.variants) == 1:
        return decided, rivals
    return best, [fit for fit in pairs if fit is not best]


def _better(best: Fit, others: list[Fit], fitter: Fitter) -> Fit:
    """Return the best of the `others`, where it is clearly better than `best`."""
    other = min(others, key=lambda fit: plain_price(fit, fitter), default=best)
    return other if _clearly_better(other, best, fitter) else best


def _clearly_better(fit: Fit, than: Fit, fitter: Fitter) -> bool:
    """Whether a fit leaves so much less than another one as another formulation of the same
    physics usually misses, at the price of its parameters."""
    return plain_price(fit, fitter) + part_of_formula() < plain_price(than, fitter)


def _made_up(fitter: Fitter) -> bool:
    """Whether the load curve moved to make up for another number that a refit of the file held."""
    return len(fitter.held) == 1 and LOAD not in fitter.held


def _decided(fitter: Fitter, chosen: Fit, held: list[Fit], others: list[Fit], limit: float,
             ) -> tuple[Fit, list[Fit]]:
    """Return the best of the fits with the load curve held, and the others of them as rivals;
    what was `chosen` before, and its rivals, where none of those fits as well. That a description
    without a name needs no other load curve says nothing against a name that needs one."""
    told = price(chosen, fitter)
    ranked = sorted((fit for fit in held if chosen.hypothesis.has_unnamed
                     or not fit.hypothesis.has_unnamed or price(fit, fitter) < told),
                    key=lambda fit: price(fit, fitter))
    if not ranked or reduced_chi_square(ranked[0], fitter) > limit:
        return chosen, others
    best = simplest(ranked, fitter)
    return best, [fit for fit in ranked if fit is not best]


def standing(fitter: Fitter, chosen: Fit, rivals: list[Fit]) -> tuple[Fit, list[Fit]]:
    """Prefer what needs none of the file's numbers changed, if anything fits so: then no refit
    has moved them, and whoever needs them moved is wrong. Such rivals come back as they fit with
    the file's numbers."""
    size = len(chosen.hypothesis.variants)
    near = reduced_chi_square(chosen, fitter) + FORMULA_ERROR
    close = [fit for fit in (chosen, *rivals) if len(fit.hypothesis.variants) == size
             and reduced_chi_square(fit, fitter) < near
             and not fit.hypothesis.has_unnamed][:CLOSE]
    if size == 0 or len(close) < 2 or chosen not in close or refitted(fitter) or _made_up(fitter):
        return chosen, rivals
    stand = list(parallel_map(lambda fit: fitter.refine(fitter.with_file(fit)), close,
                              fitter.threads))
    least = min(reduced_chi_square(fit, fitter) for fit in stand)
    if least > near:
        return chosen, rivals
    own = reduced_chi_square(stand[0], fitter)
    others = [fit for fit in rivals if fit not in close]
    if own < least + formula_error(excess(fitter.nominal(), fitter)):
        return chosen, [*stand[1:], *others]
    place = min(range(len(stand)), key=lambda entry: price(stand[entry], fitter))
    if close[place].hypothesis.size > chosen.hypothesis.size and reduced_chi_square(
            close[place], fitter) >= reduced_chi_square(chosen, fitter):
        # What has more to be fitted by stands more easily.
        return chosen, rivals
    return close[place], [*(fit for entry, fit in enumerate(stand) if entry != place), *others]
