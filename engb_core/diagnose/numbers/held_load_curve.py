# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Fits once more with the model file's load curve, or with one number that moves all of it.

A free load curve takes in much of what other effects do; held as the file has it, it tells them
apart, if it is right.
"""

from __future__ import annotations

from collections.abc import Sequence

from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.nominal import LOAD_NUMBERS, NominalNumber
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.optimise.multistart import search_around
from engb_core.diagnose.parallel_map import parallel_map
from engb_core.diagnose.search.every_effect import each_alone, Search, with_variant
from engb_core.effects.catalogue import get_effect

__all__ = ['BY_ONE_NUMBER', 'MOVE_THE_LOAD', 'best_of_each', 'both_moved', 'load_held',
           'load_moved', 'load_scaled', 'numbers_without_load', 'singles_with_load_held']

# Effects that move the whole load curve: by one number, and each way by another.
SCALE = 'load_stiffness_error'
BY_ONE_NUMBER = (SCALE, 'contact_shift', 'torque_offset')
MOVE_THE_LOAD = (*BY_ONE_NUMBER, 'asymmetric_friction')


def load_held(result: Search, fits: list[Fit]) -> list[Fit]:
    """Return the fits once more with the load curve's numbers as the model file has them, and
    with them the effects that move the whole curve by one number.

    A free load curve absorbs much: friction that differs by direction is then the same as an
    offset and a scaled load. If the file's curve is right, one of these fits is as good.
    """
    fitter = result.fitter
    numbers = numbers_without_load(fitter)
    if len(numbers) == len(fitter.numbers):
        return []
    fitter.base(numbers)
    return best_of_each([*parallel_map(
        lambda fit: _refitted(result, fit, numbers), result.alike(fits), fitter.threads),
        *load_moved(result, None)])


def singles_with_load_held(result: Search) -> list[Fit]:
    """Return each effect alone with the load curve's numbers as the model file has them, as
    `load_held`. Where a free load curve leaves nothing to explain, what an effect was fitted to
    beside it is noise, and derivatives need not lead back from there: each is begun anew as well.
    """
    fitter, numbers = result.fitter, numbers_without_load(result.fitter)
    held = load_held(result, result.of_size(1))
    anew = each_alone(fitter, fitter.base(numbers), result.effects) if held else []
    return best_of_each([*held, *(fit for fits in anew for fit in fits)])


def both_moved(result: Search, firsts: list[Fit]) -> list[Fit]:
    """Return the best fit of each pair of one of the `firsts`, which hold the file's load curve,
    and one more number that moves it."""
    return best_of_each([moved for first in firsts for moved in load_moved(result, first)])


def best_of_each(fits: list[Fit]) -> list[Fit]:
    """Return the best fit of each set of effects."""
    best: dict[tuple[str, ...], Fit] = {}
    for fit in fits:
        key = tuple(sorted(fit.hypothesis.ids))
        if key not in best or fit.cost < best[key].cost:
            best[key] = fit
    return list(best.values())


def _refitted(result: Search, fit: Fit, numbers: tuple[NominalNumber, ...]) -> Fit:
    """Return the fit with other numbers free. One with many narrow minima stays where it is, so
    that a pair with a multimodal effect is fitted anew, that effect last, and looked for around
    where it stands: which of two happened to stop in the lower minimum decides nothing."""
    fitter = result.fitter
    again = fitter.refit(fit, numbers)
    multimodal = [variant for variant in fit.hypothesis.variants if variant.effect.multimodal]
    others = [variant for variant in fit.hypothesis.variants if not variant.effect.multimodal]
    alone = result.alone(others[0]) if len(multimodal) == len(others) == 1 else None
    if alone is not None:
        again = min(again, with_variant(fitter, fitter.refit(alone, numbers), multimodal[0]),
                    key=lambda entry: entry.cost)
    return search_around(fitter, again) if multimodal else again


def numbers_without_load(fitter: Fitter) -> tuple[NominalNumber, ...]:
    """Return the nominal numbers without those of the load curve."""
    return tuple(number for number in fitter.numbers if number.name not in LOAD_NUMBERS)


def load_moved(result: Search, fit: Fit | None) -> list[Fit]:
    """Return `fit` (None: no effect) with the file's load curve, moved by one number each; beside
    effects also with the asymmetry that a free load curve takes in."""
    return _moved(result, fit, BY_ONE_NUMBER if fit is None else MOVE_THE_LOAD)


def load_scaled(result: Search, fit: Fit) -> Fit | None:
    """Return `fit` with the file's load curve scaled as a whole; None where it is already."""
    return next(iter(_moved(result, fit, (SCALE,))), None)


def _moved(result: Search, fit: Fit | None, movers: Sequence[str]) -> list[Fit]:
    fitter = result.fitter
    numbers = numbers_without_load(fitter)
    start = fitter.base(numbers) if fit is None else fitter.refit(fit, numbers)
    effects = [effect for effect in map(get_effect, movers)
               if effect.id not in start.hypothesis.ids
               and (effect.applies is None or effect.applies(fitter.problem.scene))]
    variants = [variant for effect in effects
                for variant in variants_of(effect, fitter.problem.scene)]
    # A contact has a kink: derivatives from elsewhere lead astray.
    return list(parallel_map(
        lambda variant: fitter.refine(fitter.fit(variant, start, rounds=8, keep=2), 12),
        variants, fitter.threads))
