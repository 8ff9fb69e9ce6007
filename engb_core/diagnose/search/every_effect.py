# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Every effect, alone and together, fitted to one problem."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
import math

from engb_core.diagnose.constants import FORMULA_ERROR
from engb_core.diagnose.fitted import without_effects
from engb_core.diagnose.hypothesis import Hypothesis, Variant, variants_of
from engb_core.diagnose.optimise.fit import Fit, Fitter, StartColumns
from engb_core.diagnose.optimise.linear_start import frictionless
from engb_core.diagnose.optimise.multistart import (
    followed,
    is_multimodal,
    promises,
    search_around,
)
from engb_core.diagnose.parallel_map import parallel_map
from engb_core.diagnose.score.ranking import worth_having
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square
from engb_core.diagnose.search.more_orders import with_more_orders
from engb_core.diagnose.search.starts import settings_from_residual
from engb_core.effects.base import Effect
from engb_core.effects.catalogue import catalogue, get_effect

__all__ = ['Search', 'each_alone', 'extend', 'in_other_form', 'in_richer_form',
           'physics_effects', 'search', 'variants_and_starts', 'with_variant']

# Companions that are fitted for the best singles, best first: of two effects the greater one
# nearly always fits best alone.
COMPANIONS = (8, 4, 3)
# Starts of an effect alone that are followed.
KEPT = 2
# Variants of one effect among the companions of one.
ALIKE = 2
# Starts of a multimodal effect that are tried to see whether it may be a companion.
MULTIMODAL_COMPANION = 6
# Singles and pairs that are iterated on with derivatives at the fit itself.
REFINED = 5
# No fit is iterated on that costs this many times what the best one does: in 22 recordings further
# steps took away six tenths at most.
HOPELESS = 5.0
# Pairs that are fitted to the end before the others begin.
AHEAD = 2
# So many pairs are fitted the other way round as well; without a multimodal effect only those that
# lower the leading single's cost to this part of it.
OTHER_WAY_ROUND = 4
ASTRAY = 0.8
# Rounds after which the forms of an effect are compared, and how many of the places where one of
# more parameters may begin are followed so far.
IN_OTHER_FORM, PROMISED = 5, 4

# What refitting the nominal numbers covers already is not fitted again as an effect; the table
# is fitted elsewhere (flexible.py). A contact is a number of the load curve, and a polynomial in θ
# without one moves along θ by its own coefficients. The scale of effort is that of all numbers.
_NOT_SEARCHED = {'unexplained_surface', 'law', 'inertia_error', 'viscous_friction_error',
                 'coulomb_friction_error', 'load_stiffness_error', 'load_dependent_friction',
                 'sampling_delay', 'contact_shift', 'load_curve_shape', 'effort_scale_error',
                 'back_emf'}


@dataclass
class Search:
    """All fits: `base` (numbers only), by effect ids the best fit of each set in `fits`, and by
    variants as well in `variants`; `left_out` are effects that are tried no further."""

    fitter: Fitter
    base: Fit
    fits: dict[tuple[str, ...], Fit] = field(default_factory=dict)
    variants: dict[tuple[tuple[str, object], ...], Fit] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()

    @property
    def effects(self) -> list[Effect]:
        """The effects that may be tried further."""
        return [effect for effect in physics_effects(self.fitter)
                if effect.id not in self.left_out]

    def without(self, effect: str) -> Search:
        """Return the search with all sets that an effect is not in."""
        return Search(
            self.fitter, self.base,
            {key: fit for key, fit in self.fits.items() if effect not in key},
            {key: fit for key, fit in self.variants.items()
             if effect not in fit.hypothesis.ids}, (*self.left_out, effect))

    def add(self, fit: Fit) -> None:
        """Keep a fit if it is the best of its set of effects, or of its variants."""
        key = tuple(sorted(fit.hypothesis.ids))
        if key not in self.fits or fit.cost < self.fits[key].cost:
            self.fits[key] = fit
        kinds = tuple(sorted((variant.effect.id, variant.constants)
                             for variant in fit.hypothesis.variants))
        if kinds not in self.variants or fit.cost < self.variants[kinds].cost:
            self.variants[kinds] = fit

    def alone(self, variant: Variant) -> Fit | None:
        """Return the fit of one effect; None where it had no start without the other."""
        return self.variants.get(((variant.effect.id, variant.constants),))

    def alike(self, fits: list[Fit]) -> list[Fit]:
        """Return all variants of the fits' sets of effects."""
        wanted = {tuple(sorted(fit.hypothesis.ids)) for fit in fits}
        return [fit for fit in self.variants.values()
                if tuple(sorted(fit.hypothesis.ids)) in wanted]

    def of_size(self, size: int) -> list[Fit]:
        """Return the fits with that many effects, best first."""
        return sorted((fit for key, fit in self.fits.items() if len(key) == size),
                      key=lambda fit: fit.cost)


def physics_effects(fitter: Fitter) -> list[Effect]:
    """Return the effects that can be told in these recordings."""
    scene = fitter.problem.scene
    found = []
    for effect in catalogue().values():
        if effect.id in _NOT_SEARCHED or effect.id in fitter.problem.settled:
            continue
        if effect.applies is not None and not effect.applies(scene):
            continue
        found.append(effect)
    return found


def each_alone(fitter: Fitter, base: Fit, effects: Sequence[Effect]) -> list[list[Fit]]:
    """Return the fits of each effect alone on top of a fit of numbers, one for each variant."""
    return list(parallel_map(lambda effect: _with_effect(fitter, base, effect), effects,
                             fitter.threads))


def search(fitter: Fitter, progress: Callable[[str], None] | None = None,
           found: Fit | None = None) -> Search:
    """Fit every effect alone, then the promising ones in pairs; what was `found` before, in nearly
    the same problem, is fitted anew beside them, so that no search knows less than the last."""
    base = fitter.base()
    result = Search(fitter, base)
    effects = physics_effects(fitter)
    tell = progress or (lambda text: None)
    tell('fitting every effect alone')
    singles = each_alone(fitter, base, effects)
    for number, (effect, fits) in enumerate(zip(effects, singles, strict=True)):
        tell(f'fitted {number + 1} of {len(effects)}: {effect.title}')
        for fit in fits:
            result.add(fit)
    tell('refining the leading effects')
    _refine(result, 1)
    _add_orders(result)
    for fit in result.of_size(1)[:len(COMPANIONS)]:
        result.add(in_richer_form(fitter, fit))
    tell('choosing pairs')
    pairs = _companions(result, result.of_size(1)[:len(COMPANIONS)], effects)
    for number, fit in enumerate(_with_companions(fitter, pairs)):
        tell(f'fitted {number + 1} of {len(pairs)} pairs: {" and ".join(fit.hypothesis.ids)}')
        result.add(fit)
    for fit in parallel_map(_other_way_round(result), _led_astray(result), fitter.threads):
        result.add(fit)
    in_other_form(result, result.of_size(2))
    if found is not None and not found.hypothesis.onsets:
        # What is settled by now, or stood for that, is found no more.
        hypothesis, vector = without_effects(found, {
            index for index, effect in enumerate(found.hypothesis.ids)
            if effect in fitter.problem.settled})
        if hypothesis.variants:
            result.add(fitter.refit(replace(found, hypothesis=hypothesis, vector=vector),
                                    fitter.numbers))
    _refine(result, 2)
    return result


def _add_orders(result: Search) -> None:
    """Let cogging repeat at several orders, where it is among the leading effects."""
    fit = result.fits.get(('cogging_torque',))
    if fit is not None and fit in result.of_size(1)[:len(COMPANIONS)]:
        result.add(with_more_orders(result.fitter, fit))


def extend(result: Search, fits: Sequence[Fit], most: int = COMPANIONS[0]) -> None:
    """Fit the sets with one effect more than each of the `fits`, so many of each that are the most
    promising."""
    fitter = result.fitter
    further = _companions(result, fits, result.effects, [most] * len(fits))
    found = list(_with_companions(fitter, further))
    fitted = list(parallel_map(fitter.refine, found, fitter.threads))
    for entry in fitted:
        result.add(entry)
    in_other_form(result, sorted(fitted, key=lambda fit: fit.cost))


def _refine(result: Search, size: int) -> None:
    leading = result.of_size(size)[:REFINED]
    if size == 1:
        # In which form an effect is there may show at the end of a fit only.
        leading += [fit for fit in result.alike(leading[:len(COMPANIONS)])
                    if all(fit is not other for other in leading)]
    hopeful = [fit for fit in leading if fit.cost < HOPELESS * leading[0].cost]
    for fit in parallel_map(result.fitter.refine, hopeful, result.fitter.threads):
        result.add(fit)
    best = result.of_size(size)[0]
    if is_multimodal(best):
        # Far from its optimum it would leave room for one effect more.
        result.add(search_around(result.fitter, best))


def _with_companions(fitter: Fitter, companions: list[_Companion]) -> Iterator[Fit]:
    """Yield the fits with the companions, the most promising ones first: the others are given up
    early where they stay far behind."""
    def fitted(entry: _Companion, hopeless: float = math.inf) -> Fit:
        return fitter.fit(entry.variant, entry.first, entry.starts, rounds=5, hopeless=hopeless)

    ranked = sorted(companions, key=lambda entry: entry.cost)
    best = math.inf
    for fit in parallel_map(fitted, ranked[:AHEAD], fitter.threads):
        best = min(best, fit.cost)
        yield fit
    yield from parallel_map(lambda entry: fitted(entry, HOPELESS * best), ranked[AHEAD:],
                            fitter.threads)


def _led_astray(result: Search) -> list[Fit]:
    """Return the best pairs that grew from the leading single and may stand wrong: alone it took
    in what it could of its companion, and derivatives need not lead back from there, least of
    all where the cost has many narrow minima."""
    leading, pairs = result.of_size(1)[0], result.of_size(2)
    lower = leading.cost if is_multimodal(leading) else ASTRAY * leading.cost
    return [fit for fit in pairs if fit.cost < min(lower, HOPELESS * pairs[0].cost)
            and reduced_chi_square(fit, result.fitter) > 1.0 + FORMULA_ERROR
            and fit.hypothesis.variants[0] == leading.hypothesis.variants[0]
            and not fit.hypothesis.has_unnamed
            and result.alone(fit.hypothesis.variants[1]) is not None][:OTHER_WAY_ROUND]


def _other_way_round(result: Search) -> Callable[[Fit], Fit]:
    """Return what fits a pair anew, with the effect last that was first."""
    def fitted(pair: Fit) -> Fit:
        last, first = pair.hypothesis.variants
        alone = result.alone(first)
        assert alone is not None, 'pairs are chosen by that'
        return with_variant(result.fitter, alone, last)

    return fitted


def in_other_form(result: Search, fits: Sequence[Fit]) -> Fit | None:
    """Return and keep the first of the fits without what has no name with one of its effects in
    another form, if that is better and the fit leaves more than noise; else None. Beside others an
    effect may need another form than it had when they were added.
    """
    fitter = result.fitter
    fit = next((fit for fit in fits if not fit.hypothesis.has_unnamed), None)
    if fit is None or reduced_chi_square(fit, fitter) < 1.0 + FORMULA_ERROR:
        return None

    def begun(form: Hypothesis) -> Fit:
        return fitter.iterate(fitter.evaluate(form, fit.vector), IN_OTHER_FORM)

    others = parallel_map(begun, list(_other_forms(fit.hypothesis, fitter)), fitter.threads)
    best = min(others, key=lambda other: other.cost, default=fit)
    refined = fit if best.cost >= fit.cost else fitter.refine(best)
    refined = in_richer_form(fitter, refined)
    if refined is fit:
        return None
    result.add(refined)
    return refined


def in_richer_form(fitter: Fitter, fit: Fit) -> Fit:
    """Return the fit with an effect in a form of more parameters where it leaves more than noise,
    and these are worth having."""
    if reduced_chi_square(fit, fitter) < 1.0 + FORMULA_ERROR:
        return fit
    for index, variant in enumerate(fit.hypothesis.variants):
        plain = get_effect(variant.effect.id)
        if len(variant.effect.parameters) != len(plain.parameters):
            continue
        rest = fitter.without(fit, index)
        for effect in plain.richer:
            assert effect.begins is not None, 'a richer form says where it begins'
            added = len(effect.parameters) - len(plain.parameters)
            settings = effect.begins(fit.hypothesis.named(fit.vector, index))
            for form in variants_of(effect, fitter.problem.scene):
                hypothesis = fitter.hypothesis(
                    (*rest.hypothesis.variants, replace(form, onset=variant.onset)),
                    fit.hypothesis.numbers)
                promised = promises(fitter, rest, hypothesis, settings)[:PROMISED]
                begun = min(followed(fitter, promised, IN_OTHER_FORM, fitter.iterate),
                            key=lambda entry: entry.cost)
                richer = fitter.refine(begun)
                if worth_having(richer.cost, fit.cost, added):
                    # It stands last there now.
                    return richer
    return fit


def _other_forms(hypothesis: Hypothesis, fitter: Fitter) -> Iterator[Hypothesis]:
    """Yield a hypothesis with one of its effects in each other of its forms that has the same
    parameters."""
    for index, variant in enumerate(hypothesis.variants):
        for form in variants_of(get_effect(variant.effect.id), fitter.problem.scene):
            # One whose constants are fitted (further orders of a wave) has no other form.
            if form.constants != variant.constants \
                    and len(form.constants) == len(variant.constants):
                variants = list(hypothesis.variants)
                variants[index] = replace(variant, constants=form.constants)
                yield fitter.hypothesis(tuple(variants), hypothesis.numbers)


def with_variant(fitter: Fitter, fit: Fit, variant: Variant) -> Fit:
    """Return the fit with one effect more, wherever that may start."""
    starts = fitter.starts(variant, settings_from_residual(fitter, fit, variant.effect))
    return fitter.fit(variant, fit, starts or fitter.starts(variant), rounds=5)


@dataclass(frozen=True)
class _Companion:
    """An effect that may stand beside a fit, where its fit may start, and the cost expected."""

    cost: float
    first: Fit
    variant: Variant
    starts: list[StartColumns]

    @property
    def key(self) -> tuple[str, ...]:
        return tuple(sorted((*self.first.hypothesis.ids, self.variant.effect.id)))


def _companions(result: Search, firsts: Sequence[Fit], effects: list[Effect],
                companions: Sequence[int] = COMPANIONS) -> list[_Companion]:
    """Return the most promising companions of each of the fits, so many of each; no set of effects
    that is fitted already, or that an earlier one of them leads to.

    An effect whose cost has many narrow minima takes in alone what it can of its companion, and
    derivatives need not lead back. So a set that such an effect leads to may also be reached by
    adding it last; and so may a set that promises to come to clearly less from here than it came
    to before, where one of its effects may have been fitted in another form.
    """
    def screened(case: tuple[Fit, Effect]) -> list[_Companion]:
        return _screened(result.fitter, *case)

    cases = [(first, effect) for first in firsts for effect in effects
             if _goes_with(effect, first)]
    found = [entry for part in parallel_map(screened, cases, result.fitter.threads)
             for entry in part]
    # Each set of effects, and whether it may be reached once more, with its multimodal one last.
    taken, chosen = dict.fromkeys(result.fits, False), []
    for first, most in zip(firsts, companions, strict=False):
        best: list[_Companion] = []
        for entry in sorted((entry for entry in found
                             if entry.first is first and (
                                 entry.key not in taken or _came_to_more(result, entry) or (
                                     taken[entry.key] and entry.variant.effect.multimodal))),
                            key=lambda entry: entry.cost):
            alike = sum(other.key == entry.key for other in best)
            if alike < ALIKE and len(best) < most:
                best.append(entry)
        taken |= dict.fromkeys((entry.key for entry in best), is_multimodal(first))
        chosen += best
    return chosen


def _came_to_more(result: Search, entry: _Companion) -> bool:
    """Whether a set that was fitted came to clearly more than it promises from here."""
    fit = result.fits.get(entry.key)
    return fit is not None and worth_having(entry.cost, fit.cost)


def _goes_with(effect: Effect, first: Fit) -> bool:
    ids = first.hypothesis.ids
    return not (effect.id in ids or any(entry in ids for entry in _instead_of(effect))
                or any(effect.id in _instead_of(other.effect)
                       for other in first.hypothesis.variants))


def _instead_of(effect: Effect) -> tuple[str, ...]:
    return (*effect.contains, *effect.apart)


def _screened(fitter: Fitter, first: Fit, effect: Effect) -> list[_Companion]:
    found = []
    for variant, starts in variants_and_starts(fitter, first, effect):
        if variant.effect.multimodal:
            promise = fitter.promised(variant, first, starts, MULTIMODAL_COMPANION)[0]
            found.append(_Companion(promise.cost, first, variant, starts))
            continue
        promised = fitter.screen(first, starts)
        possible = [place for place, entry in enumerate(promised) if variant.reaches(entry.sizes)]
        if possible:
            place = min(possible, key=lambda place: promised[place].begun)
            found.append(_Companion(promised[place].cost, first, variant, [starts[place]]))
    return found


def _with_effect(fitter: Fitter, start: Fit, effect: Effect) -> list[Fit]:
    # Of numbers that have lost their friction linear least squares say little.
    lost = frictionless(fitter, start)
    return [fitter.fit(variant, start, starts, keep=len(starts) if lost else KEPT)
            for variant, starts in variants_and_starts(fitter, start, effect)]


def variants_and_starts(fitter: Fitter, start: Fit, effect: Effect,
                        ) -> list[tuple[Variant, list[StartColumns]]]:
    """Return each variant of an effect with where its fit on top of `start` may begin; none that
    has nowhere to."""
    found = []
    settings = settings_from_residual(fitter, start, effect)
    for variant in variants_of(effect, fitter.problem.scene):
        starts = fitter.starts(variant, settings)
        if starts:
            found.append((variant, starts))
    return found
