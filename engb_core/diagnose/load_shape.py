# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Does the load curve have another form than the model file can give it?

A polynomial or a sinusoid need not follow a real load. What it leaves lies along the angle,
whatever else is missing, and hides it: so the question is put beside the best effects found with
the file's form, and where a table is worth having, all effects are asked for again beside it. A
free table takes in any error of the curve; where one number moves all of it to within what such a
number's formula misses, that is said, and the rest left to what describes the remainder.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from engb_core.diagnose.constants import CLEAN_EXCESS, LARGER_PART, SURE
from engb_core.diagnose.diagnosis import EffectFinding, Unexplained
from engb_core.diagnose.fitted import without_effects
from engb_core.diagnose.formula import formula_error, something_known
from engb_core.diagnose.nominal import first_knot, Knots, nominal_numbers, SHAPE_NUMBERS
from engb_core.diagnose.numbers.held_load_curve import (
    BY_ONE_NUMBER,
    MOVE_THE_LOAD,
    numbers_without_load,
    singles_with_load_held,
)
from engb_core.diagnose.numbers.wrong_numbers import NumberFinding
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.optimise.normal_equations import normal_equations
from engb_core.diagnose.score.probability import part_left
from engb_core.diagnose.score.ranking import price, worth_a_further_effect, worth_having
from engb_core.diagnose.score.reduced_chi_square import (
    excess,
    reduced_chi_square,
    unseen_rows,
)
from engb_core.diagnose.search.every_effect import Search
from engb_core.diagnose.search.more_orders import (
    orders_of,
    with_orders_only,
)
from engb_core.diagnose.selection import Selection
from engb_core.diagnose.waves import comes_often, wave_known
from engb_core.effects.base import POSITION, SAMPLE_SIZE, STATE_SIZE
from engb_core.effects.load_curve_shape import EFFECT, KNOTS
from engb_core.physics.compiled import PARAMETER_SIZE

__all__ = ['LOAD_SHAPE', 'in_files_form', 'load_shape_finding', 'moved_as_a_whole',
           'nameless_curve', 'with_free_load_curve', 'with_table']

LOAD_SHAPE = EFFECT.id
# Places along the stroke about which knots are laid, within which parts of it, and what part of
# them: half of the knots have to tell the rest of the curve.
PLACES, WIDTHS, DENSE = 24, (0.1, 0.04, 0.015), 0.5


def with_free_load_curve(fitter: Fitter, selection: Selection) -> Fitter | None:
    """Return what fits with a table beside the file's load curve, where that is worth as much
    beside the chosen effects as a further effect would have to be, or does what waves do that
    hardly repeat along the stroke, or a description of one place; None where it is not."""
    scene = fitter.problem.scene
    if fitter.load_shape or EFFECT.applies is None or not EFFECT.applies(scene):
        return None
    chosen, after, whole = selection.chosen, selection.excess_after, selection.excess_before
    instead = _may_be_the_curve(fitter, chosen)
    if not instead and after <= CLEAN_EXCESS:
        return None
    fewer = _without_slow_waves(fitter, chosen, instead)
    free = with_table(fitter, fewer)
    # By the one measure of noise for both.
    if instead:
        left = reduced_chi_square(_freed(free, fewer), fitter) - 1.0
        if not worth_a_further_effect(left, after, whole):
            return free
    if after <= CLEAN_EXCESS:
        return None
    beside = reduced_chi_square(_freed(free, chosen), fitter) - 1.0
    left = reduced_chi_square(chosen, fitter) - 1.0
    return free if worth_a_further_effect(left, beside, whole) else None


def with_table(fitter: Fitter, fit: Fit) -> Fitter:
    """Return what fits with a table beside the file's load curve, its knots about the place where
    the curve bends: if it does so at one place beside the effects of a fit and without them, since
    what is missing, or wrong in its stead, may bend what is left anywhere."""
    knots = _best_knots(fitter, fit)
    if knots != Knots() and fit.hypothesis.variants:
        alone = _best_knots(fitter, fitter.base())
        if alone == Knots() or abs(knots.at - alone.at) > max(knots.width, alone.width):
            knots = Knots()
    return Fitter(fitter.problem, fitter.threads, fitter.earlier or fitter, load_shape=knots)


def _best_knots(fitter: Fitter, fit: Fit) -> Knots:
    """Return the knots with which a table takes away most of what a fit leaves of what no fit has
    seen, by linear least squares; evenly spaced ones, unless others are worth three numbers more.
    """
    columns = fitter.columns(fit, range(fit.hypothesis.size))
    positions = np.concatenate([run.comparison(run.motion.position)
                                for run in fitter.problem.runs])
    low, high = fitter.problem.scene.position_range
    unseen = unseen_rows(fitter)
    first = first_knot(fitter.problem.model, (low, high))

    def left(knots: Knots) -> float:
        table = _table_columns(positions, (low, high), knots)[:, first:]
        design = np.concatenate([columns, table], axis=1)
        gram, right = normal_equations(design, fit.residual, fitter.weight)
        # What hardly any value tells must not run away.
        gram += np.diag(1e-8 * np.diag(gram) + 1e-300)
        rest = fit.residual - design @ np.linalg.solve(gram, right)
        return float(np.sum((rest / fitter.spread)[unseen] ** 2))

    tried = [Knots(at, part * (high - low), DENSE)
             for at in np.linspace(low, high, PLACES + 2)[1:-1].tolist() for part in WIDTHS]
    least, best = min(((left(knots), knots) for knots in tried), key=lambda entry: entry[0])
    return best if worth_having(least, left(Knots()), 3) else Knots()


def _table_columns(positions: np.ndarray, stroke: tuple[float, float], knots: Knots) -> np.ndarray:
    """Return what each knot of a table adds to the load at positions (m,), (m, KNOTS)."""
    samples = np.zeros((positions.size, SAMPLE_SIZE))
    samples[:, POSITION] = positions
    found = []
    for knot in range(KNOTS):
        parameters = np.zeros(PARAMETER_SIZE)
        parameters[knot] = 1.0
        parameters[KNOTS:KNOTS + 5] = *stroke, knots.at, knots.width, knots.part
        found.append(EFFECT.stages['load'].values(parameters, np.zeros(STATE_SIZE), samples))
    return np.stack(found, axis=1)


def moved_as_a_whole(result: Search, selection: Selection) -> Selection | None:
    """Return the selection with one number that moves the file's whole load curve, in place of
    what may be the form of the curve, where that number is likelier the cause than a makeshift
    for another form, and nothing else leaves clearly less; None where it is not so, or other
    effects are chosen: what their formulas miss along the angle would be put into the number.

    Args:
        result: the search with the file's form, beside which a table is worth having.
        selection: of it.
    """
    fitter, chosen = result.fitter, selection.chosen
    numbers, forms = numbers_without_load(fitter), _may_be_the_curve(fitter, chosen)
    if len(numbers) == len(fitter.numbers) or not all(
            effect in MOVE_THE_LOAD or index in forms
            for index, effect in enumerate(chosen.hypothesis.ids)):
        return None
    every = singles_with_load_held(result)
    held = fitter.refine(fitter.base(numbers))
    near = min((excess(fit, fitter) for fit in every), default=0.0) + formula_error(
        excess(held, fitter))
    # What may be the form of the curve is no rival of the number: either leaves the other room.
    rivals = [fit for fit in every if not _may_be_the_curve(fitter, fit)]
    best = min((fit for fit in rivals if excess(fit, fitter) < near
                and fit.hypothesis.ids[0] in BY_ONE_NUMBER),
               key=lambda fit: price(fit, fitter), default=None)
    if best is None or something_known(part_left(fitter, held, best)) < LARGER_PART:
        return None
    return replace(selection, chosen=best, rivals=tuple(
        fit for fit in sorted(rivals, key=lambda fit: fit.cost) if fit is not best),
        excess_before=excess(held, fitter), excess_after=excess(best, fitter), further=())


def _without_slow_waves(fitter: Fitter, fit: Fit, instead: set[int]) -> Fit:
    """Return a fit, not fitted anew, without the effects that may be the load curve; of a cogging
    torque of several orders those stay that repeat often enough."""
    for index in sorted(instead):
        values = fit.hypothesis.named(fit.vector, index)
        quick = [number for number, order in orders_of(values).items()
                 if comes_often(fitter, order)] if 'order' in values else []
        if quick:
            fit = with_orders_only(fitter, fit, index, quick)
            instead = instead - {index}
    return fitter.evaluate(*without_effects(fit, instead))


def _may_be_the_curve(fitter: Fitter, fit: Fit) -> set[int]:
    """Return the places of a fit's effects that may be the form of the load curve: a wave that
    hardly repeats along the stroke, a description of a torque at one place, the same both ways, or
    loops: one that remembers longer than the stroke is none."""
    found = set()
    for index, variant in enumerate(fit.hypothesis.variants):
        effect, values = variant.effect, fit.hypothesis.named(fit.vector, index)
        at_a_place = effect.unnamed and effect.reveals == 'position' \
            and not values.get('by_direction', 0.0)
        if at_a_place or effect.knows_reversals or wave_known(fitter, fit, index) < SURE:
            found.add(index)
    return found


def _freed(free: Fitter, fit: Fit) -> Fit:
    """Return a fit's effects beside a free load curve, begun where it stands."""
    kept = dict(zip((number.name for number in fit.hypothesis.numbers), fit.vector, strict=False))
    hypothesis = free.hypothesis(fit.hypothesis.variants)
    start = hypothesis.start_of_numbers()
    for place, number in enumerate(hypothesis.numbers):
        start[place] = kept.get(number.name, start[place])
    vector = [*start, *fit.vector[len(fit.hypothesis.numbers):]]
    return free.refine(free.evaluate(hypothesis, np.array(vector)))


def load_shape_finding(fitter: Fitter, explained: Fit) -> NumberFinding | None:
    """Return the table beside the load curve as a finding, where the fit has one free and the data
    insist on it."""
    if not any(number.name in SHAPE_NUMBERS for number in explained.hypothesis.numbers):
        return None
    held = in_files_form(fitter, explained)
    rise = reduced_chi_square(held, fitter) - reduced_chi_square(explained, fitter)
    if rise < CLEAN_EXCESS:
        return None
    return NumberFinding(LOAD_SHAPE, explained, rise)


def in_files_form(fitter: Fitter, fit: Fit) -> Fit:
    """Return a fit with no table beside the load curve, all numbers of the file's form refitted.
    """
    others = [number for number in fit.hypothesis.numbers if number.name not in SHAPE_NUMBERS]
    names = {number.name for number in others}
    others += [number for number in nominal_numbers(fitter.problem.model, fitter.problem.scene)
               if number.name not in names]
    return fitter.refit(fit, tuple(others))


def nameless_curve(findings: Sequence[EffectFinding]) -> Unexplained | None:
    """Return what has no name where a table beside the load curve explains all that there is: a
    table says that the curve is another one and what it depends on, but not why."""
    if not any(entry.effect == LOAD_SHAPE and entry.probability >= LARGER_PART
               for entry in findings):
        return None
    return Unexplained(
        share=0.0, depends_on=('position',), parity_in_velocity='even', memory=False, where=(),
        statement='Why the load curve has this form has no name: it follows from the position '
                  'alone, and the table holds it.')
