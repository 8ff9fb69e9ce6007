# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Cogging of several unrelated orders: one effect with a list, not several names.

Left with one order, what repeats at another would pass for a torque ripple, a spot on the stroke
or an eccentric encoder. So the orders are added before any other effect is tried beside it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from engb_core.diagnose.constants import CLEAN_EXCESS
from engb_core.diagnose.hypothesis import scaled, Variant
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.score.ranking import worth_having
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square, reduced_chi_square_of
from engb_core.diagnose.search.starts import settings_from_residual
from engb_core.diagnose.uncertainty import stands_out
from engb_core.effects.cogging_torque import EFFECT, MORE_ORDERS, with_orders

__all__ = ['amplitudes_of', 'orders_of', 'with_more_orders', 'with_orders_only',
           'without_idle_orders']

# An order is another one if it lies this part off all that are there, and off their harmonics.
APART = 0.02
HARMONICS = (1.0, 2.0, 3.0)
ROUNDS = 8


def with_more_orders(fitter: Fitter, fit: Fit) -> Fit:
    """Return a fit whose only effect is cogging, with as many orders as each take away a part of
    what the others leave."""
    for count in range(2, 2 + MORE_ORDERS):
        left = reduced_chi_square(fit, fitter) - 1.0
        if left <= 0.0:
            break
        found = [_with_order(fitter, fit, count, setting['order'])
                 for setting in settings_from_residual(fitter, fit, EFFECT) or ()
                 if _is_new(fit, setting['order'])]
        best = min(found, key=lambda entry: entry.cost, default=None)
        if best is None or not worth_having(reduced_chi_square(best, fitter) - 1.0, left) \
                or not _better_unseen(fitter, fit, best):
            break
        fit = fitter.refine(best)
    return fit


def without_idle_orders(fitter: Fitter, fit: Fit) -> Fit:
    """Return a fit without the orders whose amplitude the data do not tell from none; the leading
    one stays where no other does.

    Orders that were found while cogging stood alone described what an effect that was found beside
    it later says better, or a load curve that was freed since; left in, they would be no list of
    orders, and the size of the whole would not stand out.
    """
    for index, variant in enumerate(fit.hypothesis.variants):
        if variant.effect.id != EFFECT.id:
            continue
        sizes = {int(parameter.name.removeprefix('amplitude').removeprefix('_') or 1):
                 parameter.name for parameter in variant.effect.parameters
                 if parameter.name.startswith('amplitude')}
        finished = fitter.finish(fit) if len(sizes) > 1 else fit
        kept = [number for number, name in sizes.items()
                if len(sizes) == 1 or stands_out(finished, fitter, index, name)]
        if len(kept) == len(sizes):
            return _without_twins(fitter, fit, index)
        if 1 not in kept:
            fewer = fitter.refine(with_orders_only(fitter, fit, index, kept)) if kept else None
            if fewer is not None and _as_good(fitter, fewer, fit):
                return _without_twins(fitter, fewer, index)
            # Two orders side by side are told together, and neither of them alone.
            kept = [1, *kept]
        fewer = fitter.refine(with_orders_only(fitter, fit, index, kept))
        return _without_twins(fitter, fewer, index)
    return fit


def _without_twins(fitter: Fitter, fit: Fit, index: int) -> Fit:
    """Return a fit without the second of two orders that are less than one period apart along the
    stroke: they are one wave there (Rayleigh's criterion), and where both grow to cancel, each
    stands out. Where the wave does grow along the stroke both are kept."""
    orders = orders_of(fit.hypothesis.named(fit.vector, index))
    low, high = fitter.problem.scene.position_range
    apart = 2.0 * np.pi / (high - low) if high > low else np.inf
    for number in reversed(orders):
        if any(abs(orders[number] - order) < apart
               for other, order in orders.items() if other < number):
            kept = [other for other in orders if other != number]
            fewer = fitter.refine(with_orders_only(fitter, fit, index, kept))
            if _as_good(fitter, fewer, fit):
                return without_idle_orders(fitter, fewer)
    return fit


def _as_good(fitter: Fitter, fewer: Fit, fit: Fit) -> bool:
    return reduced_chi_square(fewer, fitter) < reduced_chi_square(fit, fitter) + CLEAN_EXCESS


def orders_of(values: Mapping[str, float]) -> dict[int, float]:
    """Return the orders of a cogging torque by their number in its list, the leading one first."""
    more = {number: values[f'order_{number}'] for number in range(2, 2 + MORE_ORDERS)
            if values.get(f'amplitude_{number}', 0.0) > 0.0}
    return {1: values['order'], **more}


def amplitudes_of(values: Mapping[str, float]) -> dict[int, float]:
    """Return the amplitudes [N·m] of a cogging torque's orders by their number in its list."""
    return {number: values['amplitude' if number == 1 else f'amplitude_{number}']
            for number in orders_of(values)}


def with_orders_only(fitter: Fitter, fit: Fit, index: int, kept: Sequence[int]) -> Fit:
    """Return a fit, not fitted anew, whose cogging (the effect at `index`) has only some of its
    orders, by their numbers; the first of them leads, with harmonics where it led before."""
    effect = scaled(with_orders(len(kept)), fitter.problem.scene)
    sources = {parameter.name: parameter.name for parameter in EFFECT.parameters
               if kept[0] == 1} | {
        name if place == 0 else f'{name}_{1 + place}': name if number == 1 else f'{name}_{number}'
        for place, number in enumerate(kept) for name in ('amplitude', 'order', 'phase')}
    variants = list(fit.hypothesis.variants)
    variants[index] = replace(variants[index], effect=effect, constants=tuple(
        EFFECT.defaults[name] for name, _ in effect.constants))
    hypothesis = fitter.hypothesis(tuple(variants), fit.hypothesis.numbers)
    numbers = len(fit.hypothesis.numbers)
    before = {(owner, fit.hypothesis.parameter(entry).name, run): fit.vector[numbers + entry]
              for entry, (owner, _, run) in enumerate(fit.hypothesis.places)}
    values = []
    for entry, (owner, _, run) in enumerate(hypothesis.places):
        name = hypothesis.parameter(entry).name
        source = sources.get(name) if owner == index else name
        values.append(0.0 if source is None else before[owner, source, run])
    return fitter.evaluate(hypothesis, np.concatenate([fit.vector[:numbers], values]))


def _is_new(fit: Fit, order: float) -> bool:
    values = fit.hypothesis.named(fit.vector, 0)
    leading, *others = orders_of(values).values()
    there = [leading * harmonic for harmonic in HARMONICS] + others
    return all(abs(order - other) > APART * other for other in there)


def _with_order(fitter: Fitter, fit: Fit, count: int, order: float) -> Fit:
    """Return the fit with one order more, begun at what linear least squares say of its sine and
    cosine."""
    effect = scaled(with_orders(count), fitter.problem.scene)
    constants = fit.hypothesis.variants[0].constants[-len(effect.constants):] \
        if effect.constants else ()
    hypothesis = fitter.hypothesis((Variant(effect, constants),), fit.hypothesis.numbers)
    unit = float(fit.hypothesis.named(fit.vector, 0)['amplitude']) or 1.0

    def at(size: float, phase: float) -> Fit:
        return fitter.evaluate(hypothesis, np.concatenate([
            fit.vector, [size, np.log(order), phase]]))

    columns = np.stack([(at(unit, phase).predicted - fit.predicted) / unit
                        for phase in (0.0, 0.5 * np.pi)], axis=1)
    weight = fitter.weight
    sizes, *_ = np.linalg.lstsq(columns * weight[:, None], fit.residual * weight, rcond=None)
    return fitter.iterate(at(float(np.hypot(*sizes)), float(np.arctan2(sizes[1], sizes[0]))),
                          ROUNDS)


def _better_unseen(fitter: Fitter, fit: Fit, other: Fit) -> bool:
    unseen = ~fitter.fitted
    if not unseen.any():
        return True
    before, after = (reduced_chi_square_of(entry, fitter, unseen) for entry in (fit, other))
    return worth_having(after, before)
