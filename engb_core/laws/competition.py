# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The one entry of the laws: a law competes with names and tables for what a model misses."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import (
    CLEAN_EXCESS,
    LARGER_PART,
    SURE,
    UNNAMED,
    WORTH_PART,
)
from engb_core.diagnose.diagnosis import LawFinding, Unexplained
from engb_core.diagnose.evidence import pooled, unseen_errors
from engb_core.diagnose.formula import formula_error, something_known, sure_part
from engb_core.diagnose.full_bandwidth import at_full_bandwidth, CorrectedModels
from engb_core.diagnose.hypothesis import Variant
from engb_core.diagnose.load_shape import with_table
from engb_core.diagnose.numbers.held_load_curve import MOVE_THE_LOAD
from engb_core.diagnose.objective import added_by
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.score.ranking import worth_having
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square
from engb_core.diagnose.score.stretch_odds import odds_of_less
from engb_core.diagnose.uncertainty import estimates
from engb_core.diagnose.unknown.flexible import left_out
from engb_core.diagnose.unknown.openset import Explanation
from engb_core.diagnose.verdict import parity_in_velocity
from engb_core.effects.load_curve_shape import EFFECT as LOAD_CURVE_SHAPE
from engb_core.laws.blocks import (
    Blocks,
    HEARD,
    noise_by_block,
    numbers_and_sizes,
    Score,
    stretches_of_time,
)
from engb_core.laws.judgement import (
    contribution_of_last,
    depends_on,
    excess_removed,
    find_law,
    fits_elsewhere,
    Found,
    Nearest,
)
from engb_core.laws.law_search import nothing_left
from engb_core.laws.picture import column, picture_of
from engb_core.laws.statement import formula_of, said_line, said_names, statement_of, told_as
from engb_core.model import Model
from engb_core.physics.plant import physics_of

__all__ = ['Won', 'law_for', 'law_instead', 'nearest_told']

Array = NDArray[np.float64]

# Where a law is this part of its largest size it acts; and it goes with a name's torque if half of
# the one is along the other there (cosine of the angle between them).
ACTS, ALONG = 0.1, 0.5
# To the contract a delay is one, whichever of the two signals is late, and so is a position that
# is off, whether to the sensor or to the load.
TOLD_AS = {'position_delay': 'delay', 'load_shift': 'position_shift'}
# Coordinates that are another one, or follow from it: whoever tells of one speaks of both.
SAME_AS = {'motor_angle': 'position', 'direction': 'velocity'}
# What an effect acts on, by its stage; friction goes with the direction.
_ACTS_ON = {'shift': 'load', 'load': 'load', 'level': 'velocity', 'direction': 'velocity',
            'actuation': 'effort'}


@dataclass(frozen=True)
class Won:
    """A law that is believed and predicts what no fit has seen.

    Attributes:
        found: the law.
        explanation: the fit with it, evaluated on the engine's own problem.
        model: the corrected model with it.
        fallen: names that add nothing beside it.
        contribution: (m,) what it adds to the filtered effort [N·m].
        fitter: of the problem, that made the fit.
    """

    found: Found
    fitter: Fitter
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
        parity = parity_in_velocity(found.contribution, *(
            column(found.fitter, name) for name in ('position', 'velocity')))
        return Unexplained(
            share=share, depends_on=depends_on(found.candidate), parity_in_velocity=parity,
            memory=found.memory, where=() if unexplained is None else unexplained.where,
            statement=self.finding.statement, law=self.finding)


def law_for(fitter: Fitter, told: CorrectedModels, likely: bool, tell: Callable[[str], None],
            ) -> Won | Nearest | None:
    """Return the law that wins; where none does, what came nearest, if anything.

    First a law competes with all that was said: it takes the place of names where these explain
    too small a part of what it explains, and of a load curve of another form where it predicts
    clearly better without one. Else it is looked for beside likely names.

    Args:
        fitter: of the problem; where its load curve is free, that is one of the things said.
        told: what the library says, with its models; tables and descriptions in it compete with
            the law.
        likely: whether a name in it is likelier right than wrong.
        tell: is told what is being done.
    """
    named = _named(fitter, told.explanation.fit)
    left = reduced_chi_square(named, fitter) - 1.0
    plain = _without_load_shape(fitter)
    if left <= CLEAN_EXCESS and plain is fitter:
        return None
    said = bool(named.hypothesis.variants) or plain is not fitter
    if left <= CLEAN_EXCESS and likely and nothing_left(_on_blocks(fitter, named)):
        # No law can predict it better.
        return None
    nearest, roughly = None, []
    for own, base in _bases(fitter, plain, named if likely else None):
        if likely and named.hypothesis.variants and not _may_be_unsaid(fitter, named, own, base):
            continue
        law = find_law(own, base, tell, approximately=not likely and left > CLEAN_EXCESS)
        if isinstance(law, Nearest):
            nearest = law if nearest is None or law.explained > nearest.explained else nearest
        elif law is not None and law.approximate:
            roughly.append((own, law))
        elif law is not None and (not said or _beats(fitter, law, named, likely)):
            won = _won(own, law, told, named)
            if won is not None:
                return won
    for own, law in sorted(roughly, key=lambda entry: entry[1].after):
        if not said or _beats(fitter, law, named, likely):
            won = _won(own, law, told, named)
            if won is not None:
                return won
        # What does not carry over is not in the model, but says what the rest depends on.
        if nearest is None or law.explained > nearest.explained:
            nearest = Nearest(law.candidate, law.explained)
    if left <= CLEAN_EXCESS:
        return None
    if not likely or not named.hypothesis.variants:
        return nearest
    law = find_law(fitter, named, tell)
    if not isinstance(law, Found):
        return law
    alone = _without_idle_names(law)
    kept = alone.candidate.fit.hypothesis.ids
    fallen = [variant for variant in named.hypothesis.variants if variant.effect.id not in kept]
    if any(_is_one_of(law, variant) for variant in fallen) and something_known(
            _unsaid(alone, _on_blocks(fitter, named))) >= SURE:
        # Another formula of what is surely named is no law beside it.
        return Nearest(law.candidate, law.explained)
    return _won(fitter, alone, told, named)


def law_instead(fitter: Fitter, told: CorrectedModels, likely: float, tell: Callable[[str], None],
                ) -> Won | None:
    """Return the law that is likelier than names which leave no more than noise, None if none is.

    Several names can be bent to what one law says; of one name it may be another form. Both are
    held against the same blocks left out; beforehand the law is the rarer, as each further cause.

    Args:
        fitter: of the problem.
        told: what the library says.
        likely: probability of its names.
        tell: is told what is being done.
    """
    named = _named(fitter, told.explanation.fit)
    plain = _without_load_shape(fitter)
    names = _score_on_blocks(plain, _on(plain, named) if plain is not fitter else named)
    if nothing_left(names.level):
        # No law can predict it better.
        return None
    law = find_law(plain, _refitted_numbers(plain), tell, only_if_promising=True)
    claims = len(named.hypothesis.ids) + len(named.hypothesis.onsets)   # A begin is one, too.
    # Of several forms over other coordinates none is likelier than what has a name.
    if not isinstance(law, Found) or not law.settled or not worth_having(law.after, names.level) \
            or claims == 1 and not _beats(fitter, law, named, likely=True):
        return None
    noise = min(law.after, 1.0)
    if law.fitter is not plain:
        # It was found in a part of what was recorded.
        names = _score_on_blocks(law.fitter, _on(law.fitter, named))
    share = noise_by_block(law.fitter)
    weight = odds_of_less(names.by_block - noise * share,
                          law.candidate.score.by_block - noise * share, share,
                          formula_error(law.before - noise))
    return _won(plain, law, told, named) if likely * weight < UNNAMED else None


def _without_load_shape(fitter: Fitter) -> Fitter:
    """Return a fitter of the same problem with the file's load curve alone."""
    return fitter if not fitter.load_shape else Fitter(fitter.problem, fitter.threads,
                                                       fitter.earlier)


def _refitted_numbers(fitter: Fitter) -> Fit:
    return fitter.finish(fitter.refine(fitter.base()))


def _bases(fitter: Fitter, plain: Fitter, likely: Fit | None) -> Iterator[tuple[Fitter, Fit]]:
    """Yield the fits that a law without names is looked for beside, the plainest first: refitted
    numbers; and where the file's load curve cannot have the right form, a free one along with
    them: what a wrong form leaves lies along the stroke, and any law is bent to take it up. Where
    one `likely` number moves the file's whole load curve, the curve is as in the file: a free one
    would hold what is said."""
    if likely is not None and any(effect in MOVE_THE_LOAD for effect in likely.hypothesis.ids):
        yield fitter, fitter.finish(fitter.refine(fitter.base(likely.hypothesis.numbers)))
        return
    base = _refitted_numbers(plain)
    yield plain, base
    if fitter.load_shape:
        free = fitter
    elif LOAD_CURVE_SHAPE.applies is not None and LOAD_CURVE_SHAPE.applies(fitter.problem.scene):
        free = with_table(fitter, base)
    else:
        return
    freed = free.refine(free.base())
    # By the one measure of noise for both. Where the table leaves noise there is nothing to find.
    left, leaves = reduced_chi_square(base, plain) - 1.0, reduced_chi_square(freed, plain) - 1.0
    if leaves > CLEAN_EXCESS and left - leaves > max(CLEAN_EXCESS, WORTH_PART * left):
        yield free, free.finish(freed)


def nearest_told(fitter: Fitter, told: CorrectedModels, nearest: Nearest, unexplained: Unexplained,
                 ) -> Unexplained:
    """Return what is said of the rest, by what came nearest to a law, unless a description
    predicts better what it was not fitted to."""
    fit, table = told.explanation.fit, told.explanation.table
    described = _on_blocks(fitter, fit) if table is None else left_out(
        fitter, fit, table.table, stretches_of_time(fitter))
    if described < nearest.candidate.score.level:
        return unexplained
    names = depends_on(nearest.candidate)
    # What leaves less than the noise explains all of it: the noise is known to a part only.
    part = min(nearest.explained, 1.0)
    short = (f'explains only {100.0 * part:.0f} % of it' if part < 1.0 - sure_part() else
             f'not surely enough to be a law (it explains {100.0 * part:.0f} % of it)')
    after = f'; of all forms that were tried one over {said_names(names)} predicts it best, but ' \
        f'{short}.'
    return replace(unexplained, depends_on=names, memory=nearest.memory,
                   statement=unexplained.statement.removesuffix('.') + after)


def _named(fitter: Fitter, fit: Fit) -> Fit:
    """Return the fit without descriptions that are no names, finished."""
    gone = {index for index, variant in enumerate(fit.hypothesis.variants)
            if variant.effect.unnamed}
    return fitter.finished_without(fit, gone) if gone else fitter.finish(fit)


def _may_be_unsaid(fitter: Fitter, named: Fit, own: Fitter, base: Fit) -> bool:
    """Whether likely names leave so much of what shows on blocks left out without them, `base`,
    that a law which leaves nothing would have to be told instead of them (`_beats`). A law that
    speaks of other things, and beside which they add nothing, is found beside them as well."""
    left = _on_blocks(own, _as_found_by(own, fitter, named))
    return something_known(min(1.0, left / max(_on_blocks(own, base), 1e-12))) < LARGER_PART


def _as_found_by(own: Fitter, fitter: Fitter, named: Fit) -> Fit:
    """Return the names that one fitter found as another one, of a law, finds them."""
    if own.load_shape and not fitter.load_shape:
        # What was said may have its load curve free as well.
        return _on(own, named)
    if own.problem is not fitter.problem:
        return own.finish(own.refine(own.evaluate(named.hypothesis, named.vector)))
    return named


def _beats(fitter: Fitter, law: Found, named: Fit, likely: bool) -> bool:
    """Whether a law without names predicts blocks left out clearly better than what was said, or
    about as well with fewer numbers where that was a free load curve and no likely name.

    Where a name is likely, another formula of its would explain more, too: then the names must
    explain too small a part of what the law explains; or the law must speak of other things than
    they do, and they must add nothing beside it.
    """
    named = _as_found_by(law.fitter, fitter, named)
    left = _on_blocks(law.fitter, named)
    plainer = not likely and not named.hypothesis.variants \
        and law.candidate.fit.hypothesis.size < named.hypothesis.size
    if worth_having(left, law.after) if plainer else not worth_having(law.after, left):
        return False
    if not likely or something_known(_unsaid(law, left)) < LARGER_PART:
        return True
    return not _speaks_of(law, named.hypothesis.variants) and not _without_idle_names(
        _beside(law, named)).candidate.fit.hypothesis.variants[:-1]


def _unsaid(law: Found, left: float) -> float:
    """Return the part (0 to 1) of what a law explains that names leave, which leave a mean square
    of `left` on blocks left out."""
    unsaid = (left - law.after) / max(law.before - law.after, 1e-12)
    return min(1.0, max(0.0, unsaid))


def _on(fitter: Fitter, fit: Fit) -> Fit:
    """Return the same effects fitted by another fitter, with all numbers that it has."""
    kept = dict(zip((number.name for number in fit.hypothesis.numbers), fit.vector, strict=False))
    hypothesis = fitter.hypothesis(fit.hypothesis.variants)
    begun = [kept.get(number.name, start) for number, start in zip(
        hypothesis.numbers, hypothesis.start_of_numbers(), strict=True)]
    vector = np.concatenate([begun, fit.vector[len(fit.hypothesis.numbers):]])
    return fitter.finish(fitter.refine(fitter.evaluate(hypothesis, vector)))


def _speaks_of(law: Found, variants: Iterable[Variant]) -> bool:
    """Whether a law speaks of a coordinate that reveals one of these names: then it may be that in
    another form."""
    told = {SAME_AS.get(name, name) for name in depends_on(law.candidate)}
    return any(SAME_AS.get(variant.effect.reveals, variant.effect.reveals) in told
               for variant in variants)


def _is_one_of(law: Found, name: Variant) -> bool:
    """Whether a law may be another formula of a name: it speaks of the coordinate that reveals the
    name, and of what the name acts on, be it by the position that it follows from."""
    told = {SAME_AS.get(entry, entry) for entry in depends_on(law.candidate)}
    if 'position' in told:
        told.add('load')
    acts_on = {_ACTS_ON[stage] for stage in name.effect.stages if stage in _ACTS_ON}
    return acts_on <= told and _speaks_of(law, [name])


def _beside(law: Found, named: Fit) -> Found:
    """Return the law with the names beside it, all fitted together."""
    fitter, alone = law.fitter, law.candidate.fit
    count = len(alone.hypothesis.numbers)
    hypothesis = fitter.hypothesis(
        (*named.hypothesis.variants, *alone.hypothesis.variants), alone.hypothesis.numbers)
    vector = np.concatenate([alone.vector[:count],
                             named.vector[len(named.hypothesis.numbers):], alone.vector[count:]])
    both = fitter.finish(fitter.refine(fitter.evaluate(hypothesis, vector)))
    return replace(law, candidate=replace(law.candidate, fit=both))


def _without_idle_names(found: Found) -> Found:
    """Return the law with the names that still matter beside it. A name that was found first may
    have stood for the law: then blocks left out are predicted as well without it."""
    fitter, fit = found.fitter, found.candidate.fit
    left = _on_blocks(fitter, fit)
    for index in reversed(range(len(fit.hypothesis.variants) - 1)):
        fewer = fitter.finished_without(fit, {index})
        leaves = _on_blocks(fitter, fewer)
        if not worth_having(left, leaves, len(fit.hypothesis.variants[index].effect.parameters)):
            fit, left = fewer, leaves
    if fit is found.candidate.fit:
        return found
    last = len(fit.hypothesis.variants) - 1
    without = fitter.finished_without(fit, {last})
    return replace(found, candidate=replace(found.candidate, fit=fit),
                   parameters=estimates(fit, fitter, last),
                   explained=excess_removed(fitter, without, fit),
                   before=_on_blocks(fitter, without), after=left,
                   contribution=contribution_of_last(fitter, fit))


def _on_blocks(fitter: Fitter, fit: Fit) -> float:
    """Return the mean squared error of a finished fit on blocks left out (noise = 1)."""
    return _score_on_blocks(fitter, fit).level


def _score_on_blocks(fitter: Fitter, fit: Fit) -> Score:
    """Return the squared errors of a finished fit on blocks left out."""
    count = len(fit.hypothesis.numbers)
    return Blocks(fitter, fit, stretches_of_time(fitter), range(count),
                  numbers_and_sizes(fit)[count:], HEARD).without()


def _won(fitter: Fitter, found: Found, told: CorrectedModels, named: Fit) -> Won | None:
    fit = found.candidate.fit
    if found.fitter is not fitter:
        fit = fitter.finish(fitter.evaluate(fit.hypothesis, fit.vector))
    explanation = Explanation(fit, None)
    models = (*at_full_bandwidth(fitter, explanation).models, fit.hypothesis.corrected(fit.vector))
    problem = told.problem
    errors = [pooled(unseen_errors(problem, model)) for model in models]
    model = models[int(np.argmin(errors))]
    file = pooled(unseen_errors(problem, fitter.problem.model))
    if worth_having(min(*told.unseen, file), min(errors)):
        return None
    # Of an approximation nothing else says that it is good for anything.
    if found.approximate and not (worth_having(min(errors), file)
                                  and fits_elsewhere(found.fitter, found.candidate.fit)):
        return None
    bare_model = replace(model, effects=model.effects[:-1])
    contribution = np.concatenate([
        run.predicted(physics_of(model)) - run.predicted(physics_of(bare_model))
        for run in fitter.problem.runs])
    kept = fit.hypothesis.ids
    fallen = tuple(effect for effect in named.hypothesis.ids if effect not in kept)
    return Won(found, fitter, explanation, model, fallen, contribution,
               _finding(found, _corrected_by(found)))


def _corrected_by(found: Found) -> tuple[str, ...]:
    """Return the titles of the names beside a law whose form it corrects: it speaks of the
    coordinate that reveals the name, and where it acts it goes with the name's own torque."""
    fitter, fit = found.fitter, found.candidate.fit
    told = {SAME_AS.get(name, name) for name in depends_on(found.candidate)}
    law = found.contribution
    acts = np.abs(law) >= ACTS * np.max(np.abs(law), initial=0.0)
    titles = []
    for index, variant in enumerate(fit.hypothesis.variants[:-1]):
        effect = variant.effect
        if effect.unnamed or SAME_AS.get(effect.reveals, effect.reveals) not in told:
            continue
        own = added_by(fitter, fit, index)[acts]
        size = float(np.linalg.norm(own) * np.linalg.norm(law[acts]))
        if size > 0.0 and abs(float(own @ law[acts])) >= ALONG * size:
            titles.append(effect.title)
    return tuple(titles)


def _finding(found: Found, corrects: Sequence[str] = ()) -> LawFinding:
    candidate, line = found.candidate, said_line(found)
    return LawFinding(
        formula=formula_of(candidate), pattern=candidate.form.formula,
        acts_as=TOLD_AS.get(candidate.form.acts_as, candidate.form.acts_as),
        parameters=found.parameters, line=line.text, below=line.below,
        statement=statement_of(found, corrects),
        alternatives=tuple(told_as(entry) for entry in found.alternatives),
        settled=found.settled, explained=found.explained, picture=picture_of(found))
