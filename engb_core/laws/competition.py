"""The one entry of the laws: a law competes with names and tables for what a model misses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import CLEAN_EXCESS
from engb_core.diagnose.diagnosis import LawFinding, LawPicture, Unexplained
from engb_core.diagnose.evidence import pooled, unseen_errors
from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.fitted import bare
from engb_core.diagnose.locate import coordinates
from engb_core.diagnose.numbers import level
from engb_core.diagnose.openset import Explanation
from engb_core.diagnose.sharpened import Sharpened, sharpened
from engb_core.diagnose.uncertainty import estimates
from engb_core.laws.blocks import Blocks, derivatives_of, stretches_of_time
from engb_core.laws.judgement import (
    contribution_of_last,
    depends_on,
    excess_removed,
    find_law,
    Found,
    WORTH,
)
from engb_core.laws.statement import formula_of, said_line, statement_of
from engb_core.model import Model
from engb_core.plant import physics_of

__all__ = ['Won', 'law_for']

Array = NDArray[np.float64]

# A table or file that is no better than this part of the law's error on what no fit has seen does
# not beat it: the law is the plainer thing.
CLEARLY = 0.9
BINS = 30


@dataclass(frozen=True)
class Won:
    """A law that is believed and predicts what no fit has seen.

    Attributes:
        found: the law.
        explanation: the fit with it, evaluated on the engine's own problem.
        model: the corrected model with it.
        fallen: names that add nothing beside it.
        contribution: (m,) what it adds to the filtered effort [N·m].
    """

    found: Found
    explanation: Explanation
    model: Model
    fallen: tuple[str, ...]
    contribution: Array
    finding: LawFinding

    @property
    def alone(self) -> bool:
        """Whether the law stands instead of all names (else beside some)."""
        return len(self.explanation.fit.hypothesis.variants) == 1

    def told(self, unexplained: Unexplained | None, share: float) -> Unexplained:
        """Return what is said of the rest, with the law."""
        found = self.found
        moving = np.sign(_column(found.fitter, 'velocity'))
        own = found.contribution
        odd, even = abs(float(np.mean(own * moving))), abs(float(np.mean(own)))
        parity = 'odd' if odd > 2.0 * even else 'even' if even > 2.0 * odd else 'none'
        return Unexplained(
            share=share, depends_on=depends_on(found.candidate), parity_in_velocity=parity,
            memory=found.memory, where=() if unexplained is None else unexplained.where,
            statement=self.finding.statement, law=self.finding)


def law_for(fitter: Fitter, told: Sharpened, likely: bool, tell: Callable[[str], None],
            ) -> Won | None:
    """Return the law that wins, None where none does.

    Args:
        fitter: of the problem.
        told: what the library says, with its models; tables and descriptions in it compete with
            the law; likely names stay free beside it, others fall to a law that alone predicts
            clearly better.
        likely: whether a name in it is likelier right than wrong.
        tell: is told what is being done.
    """
    named = _named(fitter, told.explanation.fit)
    left = level(named, fitter) - 1.0
    if left <= CLEAN_EXCESS:
        return None
    if likely or not named.hypothesis.variants:
        law = find_law(fitter, named, tell)
        return _won(fitter, law and _without_idle_names(law), told, named)
    law = find_law(fitter, fitter.finish(fitter.refine(fitter.base())), tell)
    if law is None or not _beats(fitter, law, named):
        return None
    return _won(fitter, law, told, named)


def _named(fitter: Fitter, fit: Fit) -> Fit:
    """Return the fit without descriptions that are no names, finished."""
    gone = {index for index, variant in enumerate(fit.hypothesis.variants)
            if variant.effect.unnamed}
    return _fitted_without(fitter, fit, gone) if gone else fitter.finish(fit)


def _fitted_without(fitter: Fitter, fit: Fit, gone: set[int]) -> Fit:
    """Return the fit with some effects taken away and all the rest fitted anew, finished."""
    return fitter.finish(fitter.refine(fitter.evaluate(*bare(fit, gone))))


def _beats(fitter: Fitter, law: Found, named: Fit) -> bool:
    """Whether a law without names predicts blocks left out clearly better than the names do."""
    if law.fitter is not fitter:
        named = law.fitter.finish(law.fitter.refine(
            law.fitter.evaluate(named.hypothesis, named.vector)))
        fitter = law.fitter
    return 0.5 * math.log(_on_blocks(fitter, named) / law.after) > WORTH


def _without_idle_names(found: Found) -> Found:
    """Return the law with the names that still matter beside it. A name that was found first may
    have stood for the law: then blocks left out are predicted as well without it."""
    fitter, fit = found.fitter, found.candidate.fit
    left = _on_blocks(fitter, fit)
    for index in reversed(range(len(fit.hypothesis.variants) - 1)):
        fewer = _fitted_without(fitter, fit, {index})
        leaves = _on_blocks(fitter, fewer)
        lost = 0.5 * math.log(leaves / left)
        if lost <= WORTH * len(fit.hypothesis.variants[index].effect.parameters):
            fit, left = fewer, leaves
    if fit is found.candidate.fit:
        return found
    last = len(fit.hypothesis.variants) - 1
    without = _fitted_without(fitter, fit, {last})
    return replace(found, candidate=replace(found.candidate, fit=fit),
                   parameters=estimates(fit, fitter, last),
                   explained=excess_removed(fitter, without, fit),
                   before=_on_blocks(fitter, without), after=left,
                   contribution=contribution_of_last(fitter, fit))


def _on_blocks(fitter: Fitter, fit: Fit) -> float:
    """Return the mean squared error of a finished fit on blocks left out (noise = 1)."""
    return Blocks(fitter, fit, derivatives_of(fit), stretches_of_time(fitter)).without().level


def _won(fitter: Fitter, found: Found | None, told: Sharpened, named: Fit) -> Won | None:
    if found is None:
        return None
    fit = found.candidate.fit
    if found.fitter is not fitter:
        fit = fitter.finish(fitter.evaluate(fit.hypothesis, fit.vector))
    explanation = Explanation(fit, None, 1.0, level(fit, fitter))
    models = (*sharpened(fitter, explanation).models, fit.hypothesis.corrected(fit.vector))
    problem = told.problem
    errors = [pooled(unseen_errors(problem, model)) for model in models]
    model = models[int(np.argmin(errors))]
    rivals = [*told.unseen, pooled(unseen_errors(problem, fitter.problem.model))]
    if min(rivals) < CLEARLY * min(errors):
        return None
    bare_model = replace(model, effects=model.effects[:-1])
    contribution = np.concatenate([
        run.predicted(physics_of(model)) - run.predicted(physics_of(bare_model))
        for run in fitter.problem.runs])
    kept = fit.hypothesis.ids
    fallen = tuple(effect for effect in named.hypothesis.ids if effect not in kept)
    return Won(found, explanation, model, fallen, contribution, _finding(found))


def _finding(found: Found) -> LawFinding:
    candidate = found.candidate
    return LawFinding(
        formula=formula_of(candidate), pattern=candidate.form.formula,
        # To the contract a delay is one, whichever of the two signals is late.
        acts_as=candidate.form.acts_as.replace('position_delay', 'delay'),
        parameters=found.parameters, line=said_line(found), statement=statement_of(found),
        alternatives=tuple(f'{entry.form.acts_as}: {formula_of(entry)}'
                           for entry in found.alternatives),
        settled=found.settled, explained=found.explained, picture=_picture(found))


def _column(fitter: Fitter, name: str) -> Array:
    return np.concatenate([coordinates(run, fitter.problem.model)[name][0]
                           for run in fitter.problem.runs])


def _picture(found: Found) -> LawPicture | None:
    """Return the remainder over the coordinate in which its bins tell most of the law."""
    fitter, law = found.fitter, found.contribution
    tables = [coordinates(run, fitter.problem.model) for run in fitter.problem.runs]
    names = [name for name in (*depends_on(found.candidate), 'position', 'velocity')
             if all(name in table for table in tables) and name != 'direction']
    best: tuple[float, LawPicture] | None = None
    applying = _column(fitter, 'velocity') > 0.0
    left = found.candidate.fit.residual
    for name in dict.fromkeys(names):
        values = np.concatenate([table[name][0] for table in tables])
        edges = np.linspace(float(np.quantile(values, 0.002)), float(np.quantile(values, 0.998)),
                            BINS + 1)
        if not np.all(np.diff(edges) > 0.0):
            continue
        place = np.clip(np.digitize(values, edges) - 1, 0, BINS - 1)
        means = [[_means(place, rows, what) for rows in (applying, ~applying)]
                 for what in (left + law, law, left)]
        told = np.where(applying, means[1][0][place], means[1][1][place])
        missed = float(np.nanmean((law - told) ** 2))
        if best is None or missed < best[0]:
            best = missed, LawPicture(
                name, tables[0][name][1], 0.5 * (edges[1:] + edges[:-1]),
                (means[0][0], means[0][1]), (means[1][0], means[1][1]),
                (means[2][0], means[2][1]))
    return None if best is None else best[1]


def _means(place: NDArray[np.int64], rows: NDArray[np.bool_], values: Array) -> Array:
    count = np.bincount(place[rows], minlength=BINS)
    total = np.bincount(place[rows], values[rows], BINS)
    return np.where(count > 2, total / np.maximum(count, 1), np.nan)
