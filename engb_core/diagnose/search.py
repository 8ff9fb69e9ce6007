"""Every effect, alone and together, fitted to one problem."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from engb_core.diagnose.fit import Fit, Fitter, StartColumns
from engb_core.diagnose.hypothesis import Variant, variants_of
from engb_core.diagnose.nominal import LOAD_NUMBERS, NominalNumber
from engb_core.diagnose.side_by_side import side_by_side
from engb_core.diagnose.starts import settings_from_residual
from engb_core.effects.base import Effect
from engb_core.effects.catalogue import catalogue, get_effect

__all__ = ['Search', 'extend', 'load_free', 'load_held', 'load_moved', 'physics_effects', 'search']

# Companions that are fitted for the best singles, best first: of two effects the greater one
# nearly always fits best alone.
COMPANIONS = (8, 4, 3)
# Variants of one effect among the companions of one.
ALIKE = 2
_MOVE_THE_LOAD = ('load_stiffness_error', 'contact_shift', 'torque_offset')
# Singles and pairs that are iterated on with derivatives at the fit itself.
REFINED = 5

# What refitting the nominal numbers covers already is not fitted again as an effect; the table
# is fitted elsewhere (flexible.py). A contact is a number of the load curve, and a polynomial in θ
# without one moves along θ by its own coefficients.
_NOT_SEARCHED = {'unexplained_surface', 'inertia_error', 'viscous_friction_error',
                 'coulomb_friction_error', 'load_stiffness_error', 'load_dependent_friction',
                 'sampling_delay', 'contact_shift'}


@dataclass
class Search:
    """All fits: `base` (numbers only), by effect ids the best fit of each set in `fits`, and by
    variants as well in `variants`."""

    fitter: Fitter
    base: Fit
    fits: dict[tuple[str, ...], Fit] = field(default_factory=dict)
    variants: dict[tuple, Fit] = field(default_factory=dict)

    def add(self, fit: Fit) -> None:
        """Keep a fit if it is the best of its set of effects, or of its variants."""
        key = tuple(sorted(fit.hypothesis.ids))
        if key not in self.fits or fit.cost < self.fits[key].cost:
            self.fits[key] = fit
        key = tuple(sorted((variant.effect.id, variant.constants)
                           for variant in fit.hypothesis.variants))
        if key not in self.variants or fit.cost < self.variants[key].cost:
            self.variants[key] = fit

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


def search(fitter: Fitter, progress: Callable[[str], None] | None = None) -> Search:
    """Fit every effect alone, then the promising ones in pairs."""
    base = fitter.base()
    result = Search(fitter, base)
    effects = physics_effects(fitter)
    tell = progress or (lambda text: None)
    tell('fitting every effect alone')
    singles = side_by_side(lambda effect: _with_effect(fitter, base, effect), effects,
                           fitter.threads)
    for number, (effect, fits) in enumerate(zip(effects, singles, strict=True)):
        tell(f'fitted {number + 1} of {len(effects)}: {effect.title}')
        for fit in fits:
            result.add(fit)
    tell('refining the leading effects')
    for fit in side_by_side(fitter.refine, result.of_size(1)[:REFINED], fitter.threads):
        result.add(fit)
    tell('choosing pairs')
    pairs = _companions(result, result.of_size(1)[:len(COMPANIONS)], effects)
    for number, fit in enumerate(side_by_side(_fitted_beside(fitter), pairs, fitter.threads)):
        tell(f'fitted {number + 1} of {len(pairs)} pairs: {" and ".join(fit.hypothesis.ids)}')
        result.add(fit)
    for fit in side_by_side(fitter.refine, result.of_size(2)[:REFINED], fitter.threads):
        result.add(fit)
    return result


def extend(result: Search, fit: Fit) -> None:
    """Fit the most promising sets with one effect more than `fit`."""
    fitter = result.fitter
    further = _companions(result, [fit], physics_effects(fitter))
    found = side_by_side(_fitted_beside(fitter), further, fitter.threads)
    for entry in side_by_side(fitter.refine, found, fitter.threads):
        result.add(entry)


def _fitted_beside(fitter: Fitter) -> Callable[[_Companion], Fit]:
    return lambda entry: fitter.fit(entry.variant, entry.first, [entry.start], rounds=5)


@dataclass(frozen=True)
class _Companion:
    """An effect that may stand beside a fit, where its fit starts, and the cost expected."""

    cost: float
    first: Fit
    variant: Variant
    start: StartColumns

    @property
    def key(self) -> tuple[str, ...]:
        return tuple(sorted((*self.first.hypothesis.ids, self.variant.effect.id)))


def _companions(result: Search, firsts: list[Fit], effects: list[Effect]) -> list[_Companion]:
    """Return the most promising companions of each of the fits; no set of effects that is fitted
    already, or that an earlier one of them leads to."""
    def screened(case: tuple[Fit, Effect]) -> list[_Companion]:
        return _screened(result.fitter, *case)

    cases = [(first, effect) for first in firsts for effect in effects
             if _goes_with(effect, first)]
    found = [entry for part in side_by_side(screened, cases, result.fitter.threads)
             for entry in part]
    taken, chosen = set(result.fits), []
    for first, most in zip(firsts, COMPANIONS, strict=False):
        best: list[_Companion] = []
        for entry in sorted((entry for entry in found
                             if entry.first is first and entry.key not in taken),
                            key=lambda entry: entry.cost):
            alike = sum(other.key == entry.key for other in best)
            if alike < ALIKE and len(best) < most:
                best.append(entry)
        taken |= {entry.key for entry in best}
        chosen += best
    return chosen


def _goes_with(effect: Effect, first: Fit) -> bool:
    ids = first.hypothesis.ids
    return not (effect.id in ids or any(entry in ids for entry in effect.contains)
                or any(effect.id in other.effect.contains for other in first.hypothesis.variants))


def _screened(fitter: Fitter, first: Fit, effect: Effect) -> list[_Companion]:
    found = []
    for variant, starts in _variants_and_starts(fitter, first, effect):
        costs, sizes = fitter.screen(first, starts)
        possible = [place for place in range(len(starts)) if variant.reaches(sizes[place])]
        if possible:
            place = min(possible, key=lambda place: costs[place])
            found.append(_Companion(costs[place], first, variant, starts[place]))
    return found


def _with_effect(fitter: Fitter, start: Fit, effect: Effect) -> list[Fit]:
    return [fitter.fit(variant, start, starts, keep=2)
            for variant, starts in _variants_and_starts(fitter, start, effect)]


def _variants_and_starts(fitter: Fitter, start: Fit, effect: Effect,
                         ) -> list[tuple[Variant, list[StartColumns]]]:
    found = []
    settings = settings_from_residual(fitter, start, effect)
    for variant in variants_of(effect, fitter.problem.scene):
        starts = fitter.starts(variant, settings)
        if starts:
            found.append((variant, starts))
    return found


def load_held(result: Search, fits: list[Fit]) -> list[Fit]:
    """Return the fits once more with the load curve's numbers as the model file has them, and
    with them the effects that move the whole curve by one number.

    A free load curve absorbs much: friction that differs by direction is then the same as an
    offset and a scaled load. If the file's curve is right, one of these fits is as good.
    """
    fitter = result.fitter
    numbers = load_free(fitter)
    if len(numbers) == len(fitter.numbers):
        return []
    fitter.base(numbers)
    held = [*side_by_side(lambda fit: fitter.refit(fit, numbers), result.alike(fits),
                          fitter.threads), *load_moved(result, None)]
    best: dict[tuple[str, ...], Fit] = {}
    for fit in held:
        if fit.hypothesis.ids not in best or fit.cost < best[fit.hypothesis.ids].cost:
            best[fit.hypothesis.ids] = fit
    return list(best.values())


def load_free(fitter: Fitter) -> tuple[NominalNumber, ...]:
    """Return the nominal numbers without those of the load curve."""
    return tuple(number for number in fitter.numbers if number.name not in LOAD_NUMBERS)


def load_moved(result: Search, fit: Fit | None) -> list[Fit]:
    """Return `fit` (None: no effect) with the file's load curve, moved by one number each."""
    fitter = result.fitter
    numbers = load_free(fitter)
    start = fitter.base(numbers) if fit is None else fitter.refit(fit, numbers)
    effects = [effect for effect in map(get_effect, _MOVE_THE_LOAD)
               if effect.id not in start.hypothesis.ids
               and (effect.applies is None or effect.applies(fitter.problem.scene))]
    variants = [variant for effect in effects
                for variant in variants_of(effect, fitter.problem.scene)]
    # A contact has a kink: derivatives from elsewhere lead astray.
    return list(side_by_side(
        lambda variant: fitter.refine(fitter.fit(variant, start, rounds=8, keep=2), 12),
        variants, fitter.threads))
