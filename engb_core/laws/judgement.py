# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""When a law is believed: it explains nearly all, elsewhere too, and better than what is plainer.

Significance does not separate right laws from false ones: any smooth shape takes something away
from a remainder that has structure. What does: the part of the remainder that is explained, on
blocks and kinds of motion that the fit has not seen, against an onset as the plainest rival.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import FORMULA_ERROR, LARGER_PART, MOST_NOISE, UNNAMED
from engb_core.diagnose.decimated import decimated
from engb_core.diagnose.diagnosis import ParameterEstimate
from engb_core.diagnose.formula import no_more, part_of_formula, sure_part
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import problem_of, with_less_noise
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square
from engb_core.diagnose.timing import BEFORE_STOP
from engb_core.diagnose.uncertainty import autocorrelation, estimates
from engb_core.effects.base import EFFORT, STATE_SIZE, TORQUE
from engb_core.effects.law import law_value
from engb_core.errors import InputError
from engb_core.laws.atoms import first_forms
from engb_core.laws.blocks import Blocks, HEARD, kinds_of_motion
from engb_core.laws.columns import scales_of
from engb_core.laws.grammar import coordinates_of, has_memory, parse
from engb_core.laws.law_search import (
    as_good,
    best_of,
    Candidate,
    fewest,
    is_promising,
    Search,
    search_laws,
)
from engb_core.laws.resolved import orders_of, resolved_parts
from engb_core.physics.inverse_dynamics import effort_of_motion

__all__ = ['Found', 'Nearest', 'contribution_of_last', 'depends_on', 'excess_removed',
           'find_law', 'fits_elsewhere']

Array = NDArray[np.float64]

MOST_ALTERNATIVES = 3
# Steps downhill of a fit to a part of what was recorded.
ROUNDS = 6
# What a place to act brings with it, whatever the formula.
_BRINGS = {'torque': (), 'friction_gain': ('direction',), 'load_gain': ('load',),
           'effort_gain': ('effort',), 'inertia': ('acceleration',),
           # A reading that is off acts through the load curve, where that is steep.
           'position_shift': ('position',), 'delay': ('velocity',),
           'position_delay': ('velocity',), 'load_shift': ('position',)}
# What a function depends on beside its argument: bristles, play and a late direction on how long
# ago the motion turned, the load with it; the rate of a load on the speed.
_TELLS = {'heat(': 'heat', 'rested(': 'time_at_rest', 'rate(load': 'velocity',
          'stop(position': 'since_reversal',
          'drag(position': 'since_reversal', 'lag(direction': 'since_reversal',
          'stop(load': 'since_reversal', 'drag(load': 'since_reversal'}
_DELAYS = ('delay', 'position_delay')


@dataclass(frozen=True)
class Found:
    """A law that is believed.

    Attributes:
        fitter: of the problem that it was fitted to.
        candidate: the law and its fit; all numbers and effects were fitted along.
        parameters: its parameters with standard deviations and units.
        explained: part of the excess that it takes away; 0 where it does not predict most of that
            on blocks left out.
        before, after: mean square of what was left out, without and with it (noise = 1).
        alternatives: laws that do about as well.
        settled: whether no other form does as well.
        contribution: (m,) what it adds to the filtered effort [N·m].
        approximate: it explains more than it leaves, but not all: another form is the true one.
    """

    fitter: Fitter
    candidate: Candidate
    parameters: dict[str, ParameterEstimate]
    explained: float
    before: float
    after: float
    alternatives: tuple[Candidate, ...]
    settled: bool
    contribution: Array
    approximate: bool = False

    @property
    def memory(self) -> bool:
        """Whether the torque depends on what went before."""
        return has_memory(parse(self.candidate.form.formula))


def depends_on(candidate: Candidate) -> tuple[str, ...]:
    """Return the coordinates that a law depends on, by its formula and by where it acts."""
    own = coordinates_of(parse(candidate.form.formula))
    names = list(own) + list(_BRINGS[candidate.form.acts_as])
    texts = [atom.text for atom in candidate.form.factors]
    for function, name in _TELLS.items():
        if any(function in text for text in texts):
            names.append(name)
    # To the contract the way and the time since a reversal are one name.
    return tuple(dict.fromkeys('since_reversal' if name == 'time_since_reversal' else name
                               for name in names))


@dataclass(frozen=True)
class Nearest:
    """What predicts best of all that was tried, where it is no law.

    Attributes:
        candidate: the form and its fit.
        explained: part of the excess that it explains on blocks left out.
    """

    candidate: Candidate
    explained: float

    @property
    def memory(self) -> bool:
        """Whether it depends on what went before."""
        return has_memory(parse(self.candidate.form.formula))


def find_law(fitter: Fitter, base: Fit, tell: Callable[[str], None], approximately: bool = False,
             only_if_promising: bool = False) -> Found | Nearest | None:
    """Return the law for what a finished fit leaves; where none is believed, what came nearest;
    None where nothing is worth its parameters.

    Args:
        fitter: of the problem.
        base: finished; numbers and named effects, which stay free.
        tell: is told what is being done.
        approximately: where no law is believed, one will do that explains more than it leaves.
        only_if_promising: give up where no form as it starts explains what a law must.
    """
    tell('looking for a law in what is left')
    search = search_laws(fitter, base, tell, 1.0 - sure_part() if only_if_promising else 0.0)
    if not search.candidates:
        return None
    chosen, alike = _plainest(search.fitter, search.candidates)
    if chosen.form.acts_as in _DELAYS and is_promising(chosen, search.before):
        tell('looking once more without what comes too late before a stop')
        search = _without_stops(search, chosen, tell)
        if not search.candidates:
            return None
        chosen, alike = _plainest(search.fitter, search.candidates)
    if _believed(search, chosen):
        return _found(search, chosen, alike, approximate=False)
    resolved = _where_resolved(fitter, base, tell)
    if resolved is not None:
        return resolved
    near = [entry for entry in search.candidates if _approximates(search, entry)] \
        if approximately else []
    if near:
        return _found(search, *_plainest(search.fitter, near), approximate=True)
    nearest = max(search.candidates, key=lambda entry: _gain(search, entry))
    if not _pays(search, nearest):
        return None
    before, after = search.before.level, nearest.score.level
    return Nearest(nearest, (before - after) / (before - 1.0))


def _where_resolved(fitter: Fitter, base: Fit, tell: Callable[[str], None]) -> Found | None:
    """Return the law of a position sensor that is believed where its waves are resolved, if the
    whole of the recordings does not resolve them."""
    for part in resolved_parts(fitter, base):
        forms = [form for form in first_forms(scales_of(part.fitter))
                 if part.above < max(orders_of(form), default=0) <= part.order]
        best, before = best_of(part.fitter, part.base, forms)
        if best is None or not is_promising(best, before):
            continue
        tell('looking once more where the samples are near enough to what a sensor repeats')
        search = search_laws(part.fitter, part.base, tell)
        if not search.candidates:
            continue
        chosen, alike = _plainest(search.fitter, search.candidates)
        if orders_of(chosen.form) and _believed(search, chosen):
            return _found(search, chosen, alike, approximate=False)
    return None


def _found(search: Search, chosen: Candidate, alike: list[Candidate], approximate: bool) -> Found:
    fitter = search.fitter
    finished = fitter.finish(fitter.refine(chosen.fit))
    chosen = replace(chosen, fit=finished)
    last = len(finished.hypothesis.variants) - 1
    # What is this law and more is no other law; those that say another thing come first.
    others = sorted((entry for entry in alike
                     if not Counter(entry.form.kinds) >= Counter(chosen.form.kinds)),
                    key=lambda entry: not _differ(chosen, entry))
    return Found(
        fitter, chosen, estimates(finished, fitter, last), _explained(search, chosen),
        search.before.level, chosen.score.level, tuple(others[:MOST_ALTERNATIVES]),
        not approximate and not any(_differ(chosen, entry) for entry in others),
        contribution_of_last(fitter, finished), approximate)


def _without_stops(search: Search, law: Candidate, tell: Callable[[str], None]) -> Search:
    """Return the search where nothing is judged so long before each stop that its effort belongs
    to a shaft which stands already."""
    problem = search.fitter.problem
    longest = BEFORE_STOP * float(np.max(np.abs(_delays(search.fitter, law))))
    if longest <= problem.before_stop:
        return search
    try:
        shorter = problem_of([run.recording for run in problem.runs], problem.model,
                             [run.recording for run in problem.held_out],
                             before_stop=longest)
    except InputError:
        return search
    if len(shorter.runs) < len(problem.runs):
        # Which recording an effect begins in is told by its place.
        return search
    threads = search.fitter.threads
    same = replace(with_less_noise(shorter, problem.noise_part), settled=problem.settled,
                   onsets=problem.onsets, sampled_together=problem.sampled_together)
    other = Fitter(decimated(same, threads), threads, search.fitter,
                   load_shape=search.fitter.load_shape)
    base = other.finish(other.refine(other.evaluate(search.base.hypothesis, search.base.vector)))
    return search_laws(other, base, tell)


def _delays(fitter: Fitter, law: Candidate) -> Array:
    """Return the delay of each value [s]."""
    parts = []
    for index, run in enumerate(fitter.problem.runs):
        samples = run.samples
        physics = law.fit.hypothesis.physics(law.fit.vector, index)
        samples[:, EFFORT] = effort_of_motion(samples, run.motion.step, physics)
        law_value.loop(physics.parameters[-1], np.zeros(STATE_SIZE), samples, TORQUE)
        parts.append(samples[run.comparison.grid, TORQUE])
    return np.concatenate(parts)


def _plainest(fitter: Fitter, candidates: Sequence[Candidate],
              ) -> tuple[Candidate, list[Candidate]]:
    """Return of candidates, best first, the law with the fewest parameters that predicts about as
    well as the best, of those that can't be told apart one that needs none of the file's numbers
    changed, if there is such a one, and of these the one that asks for the least torque; and all
    that do as well."""
    as_well = as_good(candidates)
    short = fewest(as_well)
    same = [entry for entry in short
            if no_more(entry.score.level, short[0].score.level)]
    chosen = min(_standing(fitter, same), key=lambda entry: float(np.mean(
        contribution_of_last(fitter, entry.fit) ** 2)))
    return chosen, as_well


def _standing(fitter: Fitter, candidates: list[Candidate]) -> list[Candidate]:
    """Return those of laws which do as well that do so with the numbers that the file has; all,
    where none does, or there is no choice. What is more on one side of a place is less on the
    other one beside a number that is off."""
    if len(candidates) < 2:
        return candidates
    leave = [(reduced_chi_square(fitter.refine(fitter.with_file(entry.fit)), fitter),
              reduced_chi_square(entry.fit, fitter)) for entry in candidates]
    return [entry for entry, (held, free) in zip(candidates, leave, strict=True)
            if held < free + FORMULA_ERROR] or candidates


def contribution_of_last(fitter: Fitter, fit: Fit) -> Array:
    """Return what the last effect of a fit adds to the filtered effort, (m,)."""
    hypothesis = fit.hypothesis
    variants = hypothesis.variants[:-1]
    own = len(hypothesis.variants[-1].effect.parameters)
    without = fitter.predict(fitter.hypothesis(variants, hypothesis.numbers), fit.vector[:-own])
    return fit.predicted - without


def _believed(search: Search, law: Candidate) -> bool:
    # What it leaves is as little as what leaves it is surely a law; what still has structure is
    # no more than noise, or than another formulation of the same law usually misses.
    left = 1.0 - _explained(search, law)
    if left > sure_part() or (law.score.level - 1.0 > MOST_NOISE and left > part_of_formula()):
        return False
    return _pays(search, law) and all(
        _holds(search, law, labels) and _same_size(search, law, labels)
        for labels in kinds_of_motion(search.fitter))


def _pays(search: Search, law: Candidate) -> bool:
    """Whether the gain pays for all the forms that were looked at, and nothing that merely begins
    at an instant does as well."""
    if search.onset is not None and no_more(search.onset.score.level, law.score.level):
        return False
    return _gain(search, law) >= 0.0


def _gain(search: Search, law: Candidate) -> float:
    """Return the gain in log density less what all the forms that were looked at cost [nats]."""
    values = _independent(search, law)
    gain = 0.5 * values * math.log(search.before.level / law.score.level)
    # A law is rarer than what has a name; each of its parameters costs what it does by the
    # Bayesian information criterion (Schwarz, Annals of Statistics 6 (1978) 461).
    return gain - math.log(search.forms / UNNAMED) - 0.5 * law.form.count * math.log(values)


def _approximates(search: Search, law: Candidate) -> bool:
    """Whether what is no law yet explains more than it leaves, everywhere."""
    before, after = search.before.level, law.score.level
    # Time and the way travelled pass but once: nothing that was left out tells how it goes on.
    if {'time', 'distance'} & set(depends_on(law)):
        return False
    return (before - after > LARGER_PART * (before - 1.0)
            and _explained(search, law) > LARGER_PART
            and _pays(search, law) and all(
                _same_size(search, law, labels) for labels in kinds_of_motion(search.fitter)))


def _same_size(search: Search, law: Candidate, labels: NDArray[np.int64]) -> bool:
    """Whether the law with the size that one kind of motion tells explains more of the other one
    than it leaves.

    All other numbers are held: those of one kind of motion alone need not say anything of the
    other, with an approximation as without.
    """
    fitter, fit = search.fitter, law.fit
    rows = fitter.fitted
    if np.unique(labels[rows]).size < 2:
        return True
    leaves = Blocks(fitter, fit, labels, [search.base.hypothesis.size]).without().by_block
    squares = (search.base.residual * fitter.weight) ** 2 / np.sum(
        (fitter.sigma * fitter.weight) ** 2)
    missed = np.array([squares[labels == label].sum() for label in np.unique(labels[rows])])
    return bool((leaves < missed).all()
                and (missed - leaves).sum() > LARGER_PART * max(missed.sum() - 1.0, 0.0))


def fits_elsewhere(fitter: Fitter, fit: Fit) -> bool:
    """Whether a fit, fitted anew with all its numbers to one kind of motion alone, or without one
    of several recordings, explains more of what the file misses of the rest than it leaves.

    This is what becomes of a corrected model: it meets motions that it was not fitted to. The
    shape's numbers are found anew as well, since an approximation's are those of its motion.
    """
    weighted = (fitter.nominal().residual / fitter.spread) ** 2
    noise = (fitter.sigma / fitter.spread) ** 2
    runs = [np.full(run.measured.size, index) for index, run in enumerate(fitter.problem.runs)]
    for labels in (*kinds_of_motion(fitter), np.concatenate(runs)):
        told = np.unique(labels[fitter.fitted])
        if told.size < 2:
            continue
        left = missed = 0.0
        for label in told:
            out = labels == label
            rows = fitter.fitted & out
            part = fitter.on_rows(fitter.fitted & ~out)
            again = part.refine(part.evaluate(fit.hypothesis, fit.vector), ROUNDS)
            left += float(np.sum((again.residual[rows] / fitter.spread[rows]) ** 2))
            left -= float(noise[rows].sum())
            missed += float(weighted[rows].sum() - noise[rows].sum())
        if left > LARGER_PART * missed:
            return False
    return True


def _independent(search: Search, law: Candidate) -> float:
    """Return how many independent values the residual holds, by its colour."""
    fitter = search.fitter
    residual = (law.fit.residual / fitter.spread)[fitter.fitted]
    colour = autocorrelation(residual)
    return float(residual.size / (1.0 + 2.0 * colour.sum()))


def _holds(search: Search, law: Candidate, labels: NDArray[np.int64]) -> bool:
    """Whether the law, fitted to one kind of motion with all numbers, explains more of the other
    than the numbers do alone."""
    fitter, base, fit = search.fitter, search.base, law.fit
    if np.unique(labels[fitter.fitted]).size < 2:
        return True
    # The law's own numbers are held: what one kind of motion can't determine is no fault of it.
    # Its amplitude is the first of them.
    with_law = Blocks(fitter, fit, labels, range(base.hypothesis.size + 1),
                      heard=HEARD).without()
    return with_law.level < Blocks(fitter, base, labels, heard=HEARD).without().level


def _explained(search: Search, law: Candidate) -> float:
    """Return the part of the excess over the noise that the law takes away, in units of the noise:
    the weights of the fit forgive what a missing law does where effort changes fast."""
    on_blocks = 1.0 - max(law.score.level - 1.0, 0.0) / max(search.before.level - 1.0, 1e-9)
    return excess_removed(search.fitter, search.base, law.fit) if on_blocks > LARGER_PART else 0.0


def excess_removed(fitter: Fitter, without: Fit, complete: Fit) -> float:
    """Return the part of the excess over the noise of one fit that another takes away."""
    before, after = (float(np.mean((fit.residual / fitter.sigma)[fitter.judged] ** 2)) - 1.0
                     for fit in (without, complete))
    return min(1.0 - max(after, 0.0) / max(before, 1e-9), 1.0)


def _differ(one: Candidate, other: Candidate) -> bool:
    """Whether two laws say different things: other coordinates, or another place to act."""
    return (one.form.acts_as != other.form.acts_as
            or set(depends_on(one)) != set(depends_on(other)))
