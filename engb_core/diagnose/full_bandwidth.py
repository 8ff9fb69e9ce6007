# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The numbers of what was chosen, from a sharper motion than the search can afford.

The search works on a motion that is smoothed so far that a coarse grid holds it. What is decided
there stands; but friction turns within milliseconds of a reversal, and a fit to the smoothed
motion puts part of that into the numbers: distances of presliding come out too long, inertia and
drag take up what the edges of a motion leave.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import LARGER_PART
from engb_core.diagnose.evidence import pooled, unseen_errors
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.numbers.spike_and_slab import (
    machine_vector,
    predicting_vector,
    with_averaged_numbers,
)
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.optimise.multistart import is_multimodal
from engb_core.diagnose.problem import Problem, sharper
from engb_core.diagnose.score.ranking import worth_having
from engb_core.diagnose.unknown.flexible import best_table
from engb_core.diagnose.unknown.openset import Explanation
from engb_core.effects.catalogue import get_effect
from engb_core.model import Model
from engb_core.signals.motion import MOTION_BANDWIDTH
from engb_core.signals.sharp_motion import MOST_OF_RATE

__all__ = ['CorrectedModels', 'at_full_bandwidth', 'carries_over', 'explained_problem',
           'fitted_to_all', 'that_helps']

Array = NDArray[np.float64]

# Steps downhill from where the smoothed motion's fit stands, and from there in another form.
ROUNDS, FORM_ROUNDS = 3, 8
# How much sharper than the smoothed motion one has to be told.
SHARPER = 2.0


@dataclass(frozen=True)
class CorrectedModels:
    """An explanation with the numbers that a sharper motion tells.

    Attributes:
        explanation: evaluated on the motion that the search worked on.
        models: corrected model files, the fullest one first.
        problem: the recordings' motion that these were fitted to.
        averaged: the explanation's fit at the mean over which of the file's numbers stand: what
            is told of its effects.
    """

    explanation: Explanation
    models: tuple[Model, ...]
    problem: Problem
    averaged: Fit

    @cached_property
    def unseen_errors(self) -> tuple[list[Array], ...]:
        """Each model's error [N·m] on each stretch that no fit has seen."""
        return tuple(unseen_errors(self.problem, model) for model in self.models)

    @cached_property
    def unseen(self) -> tuple[float, ...]:
        """Each model's mean squared error [(N·m)²] on what no fit has seen."""
        return tuple(map(pooled, self.unseen_errors))


def at_full_bandwidth(fitter: Fitter, explanation: Explanation) -> CorrectedModels:
    """Return the explanation with numbers, effects' parameters and table as a sharper motion tells
    them; as it is, where the cost has too many minima for a few steps downhill, and where slow
    samples or coarse counts tell no sharper motion.

    The models, and what is told of the effects, are means over which of the file's numbers stand:
    the ones over those that predict best, the other over those that are the machine's.
    """
    fit = explanation.fit
    if not _is_told_sharper(fitter, fit):
        return CorrectedModels(explanation, _models(fitter, explanation),
                               explained_problem(fitter, fit), with_averaged_numbers(fitter, fit))
    other = Fitter(sharper(fitter.problem), fitter.threads, fitter.earlier,
                   fitter.load_shape)
    moved = other.finish(_best_form(other, other.refine(
        other.evaluate(fit.hypothesis, fit.vector), ROUNDS)))
    table = None if explanation.table is None else best_table(other, moved)
    here, averaged = (fitter.finish(fitter.evaluate(moved.hypothesis, vector))
                      for vector in (moved.vector, machine_vector(other, moved)))
    return CorrectedModels(replace(explanation, fit=here),
                           _models(other, replace(explanation, fit=moved, table=table)),
                           explained_problem(other, moved), averaged)


def carries_over(told: CorrectedModels, file: Model) -> bool:
    """Whether a model with what was named is better than the file on what no fit has seen, or much
    better on most of its stretches: a fault that happened once does not come again; but a disc
    may stand in one stretch only, and no fit has seen what the effects do then."""
    before = unseen_errors(told.problem, file)
    if not before or min(told.unseen) < pooled(before):
        return True
    return any(np.median([pooled([now]) / pooled([then])
                          for now, then in zip(after, before, strict=True)]) < LARGER_PART
               for after in told.unseen_errors)


def that_helps(told: CorrectedModels, otherwise: tuple[Model, ...]) -> Model:
    """Return the first of the models that is clearly better than every later, plainer one on what
    no fit has seen.

    A description that explains the stretches it was fitted to, and no others, is worse than none;
    and the next recording moves in other ways than what was kept of this one.
    """
    candidates = (*told.models, *otherwise)
    errors = (*told.unseen, *(pooled(unseen_errors(told.problem, model)) for model in otherwise))
    for place, candidate in enumerate(candidates[:-1]):
        if worth_having(errors[place], min(errors[place + 1:])):
            return candidate
    return candidates[-1]


def fitted_to_all(fitter: Fitter, told: CorrectedModels, place: int) -> Model:
    """Return the corrected model at a place of `told.models` with its numbers fitted to all values
    of the recordings, where others are held out to judge it by: what was kept out of these has
    decided what it holds, and tells its numbers as well."""
    problem = fitter.problem
    whole = replace(problem, runs=tuple(replace(run, fitted=np.ones_like(run.fitted))
                                        for run in problem.runs))
    other = Fitter(whole, fitter.threads, fitter.earlier, fitter.load_shape)
    fit = told.explanation.fit
    moved = other.refine(other.evaluate(fit.hypothesis, fit.vector))
    explanation = replace(told.explanation, fit=moved)
    if not _is_told_sharper(other, moved):
        # Else both are fitted once more, to the sharper motion.
        moved = other.finish(moved)
        table = None if explanation.table is None else best_table(other, moved)
        explanation = replace(explanation, fit=moved, table=table)
    # Fitted to all, a table may be worth nothing any more: then there is the plain one alone.
    models = at_full_bandwidth(other, explanation).models
    return models[max(place - len(told.models), -len(models))]


def _is_told_sharper(fitter: Fitter, fit: Fit) -> bool:
    """Whether the recordings tell a motion so sharp that the numbers are fitted to it, and the
    cost has no minima that a few steps downhill would miss."""
    corner = MOST_OF_RATE / fitter.problem.scene.sampling
    return not (is_multimodal(fit) or fitter.problem.coarse
                or corner < SHARPER * MOTION_BANDWIDTH)


def _models(fitter: Fitter, explanation: Explanation) -> tuple[Model, ...]:
    """Return the corrected models, the plain one with the numbers that predict best; in the one
    with a table all numbers are free, as the table was fitted beside them."""
    vector = predicting_vector(fitter, explanation.fit)
    return (*explanation.models()[:-1], explanation.fit.hypothesis.corrected(vector))


def explained_problem(fitter: Fitter, fit: Fit) -> Problem:
    """Return the problem with the onsets that a fit found: what a model is judged on."""
    return replace(fitter.problem, onsets=fit.hypothesis.onsets)


def _best_form(fitter: Fitter, fit: Fit) -> Fit:
    """Return the fit, or one that is better with an effect in another form of it: in the smoothed
    motion a form is hardly told from the next."""
    best = fit
    for index, variant in enumerate(fit.hypothesis.variants):
        if variant.effect.unnamed or variant.onset is not None:
            continue
        # Of the effect as its file has it: the variant's own has been scaled to the stroke.
        for form in variants_of(get_effect(variant.effect.id), fitter.problem.scene):
            if form.constants == variant.constants \
                    or len(form.effect.parameters) != len(variant.effect.parameters):
                continue
            variants = list(best.hypothesis.variants)
            variants[index] = form
            other = fitter.evaluate(fitter.hypothesis(tuple(variants), fit.hypothesis.numbers),
                                    best.vector)
            best = min(best, fitter.refine(other, FORM_ROUNDS), key=lambda entry: entry.cost)
    return best
