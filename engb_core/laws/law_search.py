# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The search for a law: every form screened by linear least squares, few polished, then mutated.

Screening adds one form's columns to a finished fit with all its numbers free and asks how well
blocks that were left out are predicted. Only what leads is fitted with its shapes' parameters;
from there factors are multiplied, replaced and dropped.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import LARGER_PART
from engb_core.diagnose.formula import sure_part
from engb_core.diagnose.hypothesis import Variant
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.parallel_map import parallel_map
from engb_core.diagnose.score.ranking import worth_having
from engb_core.diagnose.search.starts import orders_left
from engb_core.effects.law import law_effect
from engb_core.errors import InputError
from engb_core.laws.atoms import (
    factors_for,
    first_forms,
    limits_of,
    LONGEST_DELAY,
    mirrors_of,
    onset_forms,
)
from engb_core.laws.blocks import Blocks, derivatives_of, HEARD, Score, stretches_of_time
from engb_core.laws.columns import Columns, recorded_range, scales_of
from engb_core.laws.forms import Form

__all__ = ['Candidate', 'Screened', 'Search', 'as_good', 'best_of', 'fewest', 'is_promising',
           'nothing_left', 'search_laws']

Array = NDArray[np.float64]

# How many forms are polished at first and after each mutation, how many are mutated.
POLISHED, POLISHED_AFTER, MUTATED, GENERATIONS = 16, 8, 4, 2
# Of so many times that, which are fitted with the base's derivatives by its numbers: where a shape
# starts a form may be far from what it can do.
TRIED = 4
# Of forms that differ in the side or the sign of a shape only, so many.
ALIKE = 2
MOST_FACTORS = 3
# Leading laws whose memory is tried against its limit.
LIMITED = 6
ROUNDS, ROUNDS_AGAIN = 8, 8
# Of many forms that are fitted half are given up after so many rounds, and of the others all but
# those that are polished after as many again.
FIRST_ROUNDS = 2
# Part of its size at which a form begins that is worse than none at all of it.
NEARER = 0.3
# Forms whose columns are held at once, by each thread.
CHUNK = 100
# Mean square on blocks left out (noise = 1) from which downwards nothing more is looked for: that
# would be found by chance.
NOTHING_LEFT = 1.05


@dataclass(frozen=True)
class Screened:
    """A form with the starts that least squares gave it, and how well it predicts."""

    form: Form
    score: Score


@dataclass(frozen=True)
class Candidate:
    """A form that was fitted with all its parameters.

    `score` is that of the blocks left out; `fit` has the law as its last effect.
    """

    form: Form
    fit: Fit
    score: Score

    @property
    def values(self) -> dict[str, float]:
        """The law's parameters by name."""
        hypothesis = self.fit.hypothesis
        named = hypothesis.named(self.fit.vector, len(hypothesis.variants) - 1)
        return {entry.name: named[entry.name] for entry in self.form.parameters()}


@dataclass(frozen=True)
class Search:
    """All that was fitted, best first; `before` is the score without a law, `onset` the best of
    what begins at an instant, `forms` how many were looked at."""

    fitter: Fitter
    base: Fit
    before: Score
    candidates: tuple[Candidate, ...]
    onset: Candidate | None
    forms: int


def is_promising(best: Screened | Candidate, before: Score) -> bool:
    """Whether a form is near enough to a law that is believed for more to be asked; `before` is
    the score without a law. It explains the larger part of what a law must."""
    return before.level - best.score.level > LARGER_PART * (1.0 - sure_part()) * (
        before.level - 1.0)


def nothing_left(level: float) -> bool:
    """Whether noise is all that a mean square on blocks left out (noise = 1) holds."""
    return level <= NOTHING_LEFT


def as_good(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates, best first, that predict about as well as the best of them."""
    best = candidates[0].score.level
    return [entry for entry in candidates if not worth_having(best, entry.score.level)]


def fewest(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates that have the fewest parameters."""
    least = min(entry.form.count for entry in candidates)
    return [entry for entry in candidates if entry.form.count == least]


def search_laws(fitter: Fitter, base: Fit, tell: Callable[[str], None], least: float = 0.0,
                ) -> Search:
    """Return the laws that explain most of what a finished fit leaves.

    Args:
        fitter: of the problem.
        base: finished (`Fitter.finish`); its numbers and effects stay free.
        tell: is told what is being done.
        least: part of the excess that some form must explain as it starts for any to be fitted.
    """
    return _Searching(fitter, base, tell).run(least)


def best_of(fitter: Fitter, base: Fit, forms: Iterable[Form]) -> tuple[Screened | None, Score]:
    """Return the form that promises most as it starts, and the score without any."""
    searching = _Searching(fitter, base, lambda text: None)
    return searching.best(forms)


class _Searching:
    def __init__(self, fitter: Fitter, base: Fit, tell: Callable[[str], None]) -> None:
        self._fitter, self._base, self._tell = fitter, base, tell
        self._scales = replace(scales_of(fitter),
                               orders=tuple(orders_left(fitter, base, '', 'direction')))
        self._columns = Columns(fitter, base)
        # Beside a law all else moves little: its derivatives are those without the law.
        self._shared = derivatives_of(base)
        self._labels = stretches_of_time(fitter)
        self._blocks = Blocks(fitter, base, self._labels, heard=HEARD)
        self._within = _ranges(fitter)
        self._seen: dict[tuple[Any, ...], Candidate] = {}
        self._forms = 0

    def run(self, least: float = 0.0) -> Search:
        before = self._blocks.without()
        first = self._screened(first_forms(self._scales))
        self._tell(f'screened {len(first)} candidate laws')
        if least and (not first or before.level - first[0].score.level
                      < least * (before.level - 1.0)):
            return Search(self._fitter, self._base, before, (), None, self._forms)
        waves = tuple(dict.fromkeys(
            atom.slots[0].start for entry in first[:60] for atom in entry.form.factors
            if 'wave' in atom.kind))[:4]
        self._polish(_of_each_kind(first, TRIED * POLISHED), POLISHED)
        for generation in range(GENERATIONS):
            leading = self._leading()[:MUTATED]
            if not leading or nothing_left(leading[0].score.level):
                break
            self._tell(f'changing the best laws, round {generation + 1} of {GENERATIONS}')
            found = self._screened(self._mutations(leading, waves))
            worth = [entry for entry in found if entry.form.kinds not in self._seen
                     and entry.score.level < leading[-1].score.level]
            if not worth or not is_promising(worth[0], before):
                break
            self._polish(_of_each_kind(worth, TRIED * POLISHED_AFTER), POLISHED_AFTER)
        leading = self._leading()
        if not leading or not is_promising(leading[0], before):
            return Search(self._fitter, self._base, before, tuple(leading), None, self._forms)
        others = {form.kinds: form for entry in leading[:LIMITED]
                  for form in limits_of(entry.form)}
        others |= {form.kinds: form for entry in (*leading[:LIMITED], *fewest(as_good(leading)))
                   for form in mirrors_of(entry.form)}
        self._polish(self._screened(form for kinds, form in others.items()
                                    if kinds not in self._seen))
        onsets = self._screened(onset_forms(self._scales))
        onset = self._polished(onsets[0]) if onsets and self._hopeful(onsets[0]) else None
        return Search(self._fitter, self._base, before, tuple(self._leading()), onset,
                      self._forms)

    def best(self, forms: Iterable[Form]) -> tuple[Screened | None, Score]:
        """Return the form that promises most, and the score without any."""
        return next(iter(self._screened(forms)), None), self._blocks.without()

    def _hopeful(self, onset: Screened) -> bool:
        """Whether an onset may come near the best law once it is fitted."""
        leading = self._leading()
        return bool(leading) and onset.score.level < 2.0 * leading[0].score.level

    def _leading(self) -> list[Candidate]:
        return sorted(self._seen.values(), key=lambda entry: entry.score.level)

    def _screened(self, forms: Iterable[Form]) -> list[Screened]:
        """Return the forms, best first."""
        found: list[Screened] = []
        forms = list(forms)
        self._forms += len(forms)
        chunks = [forms[begin:begin + CHUNK] for begin in range(0, len(forms), CHUNK)]
        for scored in parallel_map(self._scored, chunks, self._fitter.threads):
            found += scored
        return sorted((entry for entry in found if np.isfinite(entry.score.level)),
                      key=lambda entry: entry.score.level)

    def _scored(self, forms: list[Form]) -> list[Screened]:
        scores = self._blocks.scores([self._columns.of(form) for form in forms])
        return [Screened(_sized(form, score.sizes), score)
                for form, score in zip(forms, scores, strict=True)]

    def _polish(self, screened: list[Screened], most: int | None = None) -> None:
        """Fit forms with all their parameters; of many only the best so many to the end."""
        short = [entry for entry in screened if self._can_be_run(entry.form)]
        begun = self._halved(short, most) if most and len(short) > most else list(
            parallel_map(self._tried, short, self._fitter.threads))
        fitted = parallel_map(self._polished_from, begun, self._fitter.threads)
        for candidate in fitted:
            if candidate is None:
                continue
            known = self._seen.get(candidate.form.kinds)
            if known is None or candidate.score.level < known.score.level:
                self._seen[candidate.form.kinds] = candidate

    def _halved(self, screened: list[Screened], most: int) -> list[tuple[Form, Fit]]:
        """Return the best so many of the forms, fitted for `ROUNDS`, by successive halving
        (Jamieson and Talwalkar, AISTATS 2016): what is behind after a few rounds is given up."""
        threads = self._fitter.threads

        def further(entry: tuple[Form, Fit], rounds: int) -> tuple[Form, Fit]:
            return entry[0], self._fitter.iterate(entry[1], rounds, shared=self._shared)

        def best(entries: Iterable[tuple[Form, Fit]], count: int) -> list[tuple[Form, Fit]]:
            return sorted(entries, key=lambda entry: entry[1].cost)[:count]

        tried = best(parallel_map(partial(self._tried, rounds=FIRST_ROUNDS), screened, threads),
                     max(most, len(screened) // 2))
        tried = best(parallel_map(partial(further, rounds=FIRST_ROUNDS), tried, threads), most)
        return list(parallel_map(partial(further, rounds=ROUNDS - 2 * FIRST_ROUNDS), tried,
                                 threads))

    def _can_be_run(self, form: Form) -> bool:
        """Whether the formula is short enough for the stack machine."""
        try:
            self._variant(form)
        except InputError:
            return False
        return True

    def _polished(self, screened: Screened) -> Candidate | None:
        return self._polished_from(self._tried(screened))

    def _tried(self, screened: Screened, rounds: int = ROUNDS) -> tuple[Form, Fit]:
        """Return a form fitted from what linear least squares say: with its whole size, else with
        part of it; where that leads nowhere, with all numbers moving along from the start."""
        fitter, base, form = self._fitter, self._base, screened.form
        begun = self._begun(form)
        if begun.cost >= base.cost:
            begun = min(begun, self._begun(replace(form, size=NEARER * form.size)),
                        key=lambda entry: entry.cost)
        fit = fitter.iterate(begun, rounds, shared=self._shared)
        if fit.cost >= base.cost and screened.score.moved.size:
            fit = fitter.iterate(self._begun(form, screened.score.moved), rounds,
                                 shared=self._shared)
        return form, fit

    def _polished_from(self, tried: tuple[Form, Fit]) -> Candidate | None:
        fitter, base, (form, fit) = self._fitter, self._base, tried
        if not np.isfinite(fit.cost) or fit.cost >= base.cost:
            return None
        fit = self._finished(form, fit)
        own = [base.hypothesis.size + place for place in form.linear]
        # What leaves a block out finds size and phase anew; the shape's numbers are few, and
        # beyond the linear where a block alone tells them.
        score = Blocks(fitter, fit, self._labels, range(base.hypothesis.size), own,
                       HEARD).without()
        values = tuple(float(value) for value in _values(fit, len(base.hypothesis.variants)))
        return Candidate(form.started(values), fit, score)

    def _finished(self, form: Form, fit: Fit) -> Fit:
        """Return a form's fit at its optimum, with all derivatives."""
        fitter = self._fitter
        if form.acts_as != 'torque':
            # Where a law moves the load or the friction the base's derivatives are others.
            return fitter.finish(fitter.refine(fit, ROUNDS_AGAIN))
        fit = fitter.iterate(fit, ROUNDS_AGAIN, 1e-5, self._shared)
        own = fitter.columns(fit, range(self._base.hypothesis.size, fit.hypothesis.size))
        return replace(fit, jacobian=np.concatenate([self._shared, own], axis=1))

    def _begun(self, form: Form, moved: Array | float = 0.0) -> Fit:
        """Return the base, its numbers moved so far, with the form at its starts."""
        fitter, base, variant = self._fitter, self._base, self._variant(form)
        hypothesis = fitter.hypothesis((*base.hypothesis.variants, variant),
                                       base.hypothesis.numbers)
        entries = [np.log(value) if parameter.logarithmic else value
                   for value, parameter in zip(form.starts(), variant.effect.parameters,
                                               strict=True)]
        return fitter.evaluate(hypothesis, np.clip(
            np.concatenate([base.vector + moved, entries]), *hypothesis.bounds))

    def _variant(self, form: Form) -> Variant:
        within = {name: span for name, span in self._within.items()
                  if not (name == 'position' and form.goes_on)}
        effect = law_effect(form.formula, form.acts_as, form.parameters(), within, LONGEST_DELAY)
        return Variant(effect, tuple(effect.defaults.values()))

    def _mutations(self, leading: list[Candidate], waves: tuple[float, ...]) -> list[Form]:
        found: dict[str, Form] = {}
        for candidate in leading:
            form = candidate.form
            shapes = factors_for(self._scales, form, waves)
            changed = []
            if len(form.factors) < MOST_FACTORS:
                changed += [(*form.factors, atom) for atom in shapes]
            for place, atom in itertools.product(range(len(form.factors)), shapes):
                changed.append((*form.factors[:place], atom, *form.factors[place + 1:]))
            changed += [form.factors[:place] + form.factors[place + 1:]
                        for place in range(len(form.factors))]
            for factors in changed:
                texts = [atom.filled() for atom in factors]
                waving = sum(atom.phase for atom in factors)
                if len(set(texts)) == len(texts) and waving <= 1:
                    found.setdefault(f'{form.acts_as} {sorted(texts)}',
                                     Form(form.acts_as, factors))
        return list(found.values())


def _values(fit: Fit, variant: int) -> list[float]:
    hypothesis = fit.hypothesis
    return hypothesis.values(fit.vector, variant, 0)[
        :len(hypothesis.variants[variant].effect.parameters)]


def _sized(form: Form, sizes: Array) -> Form:
    """Return the form with the amplitude, and the phase, that least squares gave it."""
    if sizes.size < 2:
        return replace(form, size=float(sizes[0]))
    factors = []
    for atom in form.factors:
        if atom.phase:
            starts = [slot.start for slot in atom.slots]
            starts[-1] += float(np.arctan2(sizes[1], sizes[0]))
            atom = atom.started(tuple(starts))
        factors.append(atom)
    return replace(form, factors=tuple(factors), size=float(np.hypot(*sizes)))


def _of_each_kind(screened: list[Screened], most: int) -> list[Screened]:
    """Return the best of each kind of form, so many kinds."""
    found: dict[tuple[Any, ...], Screened] = {}
    alike: Counter[tuple[Any, ...]] = Counter()
    for entry in screened:
        family = (entry.form.acts_as, *sorted(atom.kind for atom in entry.form.factors))
        if entry.form.kinds in found or alike[family] == ALIKE:
            continue
        found[entry.form.kinds] = entry
        alike[family] += 1
        if len(found) == most:
            break
    return list(found.values())


def _ranges(fitter: Fitter) -> dict[str, tuple[float, float]]:
    """Return the range of each coordinate that was recorded."""
    motions = [run.motion for run in fitter.problem.runs]
    names = ['position', 'velocity', 'acceleration', 'time']
    names += ['disc_speed'] if all(motion.has_disc for motion in motions) else []
    names += ['pad_temperature'] if all(motion.has_temperature for motion in motions) else []
    found = {name: recorded_range(fitter, name) for name in names}
    return {name: values for name, values in found.items() if values[0] < values[1]}
