# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Joint fit of nominal numbers and effects, through the filter, by damped least squares.

The nominal numbers are refitted in every hypothesis, since a model file may have been refitted
on the very recording and so hide the effect; they are held by what the file says only where the
data say nothing. Their derivatives hardly depend on the effect: they are computed once and shared;
the last steps before an answer is given (`Fitter.refine`) compute them anew.
"""

from __future__ import annotations

from copy import copy
from functools import cached_property
import math

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.fitted import Fit, Screened, StartColumns, without_effects
from engb_core.diagnose.held_parameters import held_odds, likeliest
from engb_core.diagnose.hypothesis import Hypothesis, Variant
from engb_core.diagnose.nominal import DELAY, Knots, NominalNumber
from engb_core.diagnose.objective import Objective
from engb_core.diagnose.optimise.descent import descended
from engb_core.diagnose.optimise.linear_start import (
    columns_with_friction,
    frictionless,
    screened,
    start_columns,
    start_vector,
)
from engb_core.diagnose.optimise.multistart import best_promised, Promise, promises
from engb_core.diagnose.problem import Problem
from engb_core.signals.spread import robust_deviation

__all__ = ['Fit', 'Fitter', 'StartColumns']

Array = NDArray[np.float64]

# Part of the refitted model's typical residual that is added to the noise in the weights.
MISSED_PART = 0.3
# Starts that are tried where the cost is multimodal.
MULTIMODAL_SCREENED = 16
# After so many rounds from a further start it must be no worse than this multiple of the best.
FIRST_ROUNDS, PROMISING = 2, 1.1
# Parts of what linear least squares say that a fit may begin at.
PARTS = (1.0, 0.5, 0.25, 0.1)


class Fitter(Objective):
    """Fits hypotheses to one problem, independent ones by so many threads.

    `earlier` fitted the file itself, before anything was settled: it knows how the file was made.
    With `load_shape` a table beside the file's load curve is among the nominal numbers, with
    these knots.
    `file_residual` (m,) [N·m] is what the file leaves, nothing fitted.
    """

    def __init__(self, problem: Problem, threads: int = 1, earlier: Fitter | None = None,
                 load_shape: Knots | None = None) -> None:
        super().__init__(problem, threads, load_shape)
        self.earlier = earlier
        self._shared: dict[tuple[NominalNumber, ...], Array] = {}
        self._base: dict[tuple[NominalNumber, ...], Fit] = {}
        self._starts: dict[tuple[object, ...], list[StartColumns]] = {}
        # Where a model misses by far more than the noise, values of little noise must not
        # outweigh all others: what is missed weighs on every value alike.
        # The file's own residual first: noise alone would let a few quiet values rule the refit.
        self.file_residual = self.evaluate(self.hypothesis((), ()), np.zeros(0)).residual
        self.spread = self._spread(np.abs(self.file_residual))
        self.spread = self._spread(np.abs(self.base().residual))
        self._base.clear()

    def _spread(self, missed: Array) -> Array:
        """Return what weighs the values: noise, timing, and part of what the base misses."""
        typical = robust_deviation(missed[self.fitted])
        rate = self.problem.rate
        fast = self.fitted & (rate > np.quantile(rate, 0.9)) & (rate > 0)
        # Where effort changes fast a model misses by timing and by its smoothness.
        late = float(np.median(missed[fast] / rate[fast])) if fast.sum() > 20 else 0.0
        return np.sqrt(self.sigma ** 2 + (MISSED_PART * typical) ** 2
                       + (MISSED_PART * late * rate) ** 2)

    def on_rows(self, fitted: NDArray[np.bool_]) -> Fitter:
        """Return one that fits the values `fitted` (m,) of the same problem alone."""
        part = copy(self)
        part.fitted = fitted
        part._shared, part._base, part._starts = {}, {}, {}
        part.__dict__.pop('finished_base', None)
        return part

    @cached_property
    def held(self) -> tuple[str, ...]:
        """The numbers that a refit of the model file likely held (LOAD: the load curve)."""
        return likeliest(self.held_odds)

    @cached_property
    def held_odds(self) -> dict[tuple[str, ...], float]:
        """The odds that a refit of the model file held these numbers alone."""
        if self.earlier is not None:
            return self.earlier.held_odds
        return held_odds(self.finished_base, self.nominal(), self.sigma)

    @cached_property
    def finished_base(self) -> Fit:
        """The refit of the nominal numbers alone, with all derivatives at its end."""
        return self.finish(self.base())

    def base(self, numbers: tuple[NominalNumber, ...] | None = None) -> Fit:
        """Return the refit of the nominal numbers alone."""
        numbers = self.numbers if numbers is None else numbers
        if numbers not in self._base:
            hypothesis = self.hypothesis((), numbers)
            fit = self.evaluate(hypothesis, hypothesis.start_of_numbers())
            shared = np.zeros((self.measured.size, 0))
            for _ in range(2 if numbers else 0):
                shared = self.number_columns(fit)
                fit = self.iterate(fit, 4, shared=shared)
            self._shared[numbers], self._base[numbers] = shared, fit
        return self._base[numbers]

    # -- fitting ---------------------------------------------------------------------------------

    def starts(self, variant: Variant, settings: list[dict[str, float]] | None = None,
               ) -> list[StartColumns]:
        """Return what each start of an effect does to the effort, on top of the base fit."""
        settings = variant.starts() if settings is None else settings
        key = (variant.effect.id, variant.effect.names, variant.constants, variant.sizing.none,
               str(settings))
        if key not in self._starts:
            base = self.base()
            hypothesis = self.hypothesis((variant,))
            rubs = frictionless(self, base) and not {'level', 'direction'}.isdisjoint(
                variant.effect.stages) and not variant.effect.of_kind('phase')

            def begun(setting: dict[str, float]) -> StartColumns:
                columns, size = columns_with_friction(self, hypothesis, base, setting) if rubs \
                    else (start_columns(self, hypothesis, base, setting), None)
                return StartColumns(setting, columns, variant.scalable, size)

            self._starts[key] = [begun(setting) for setting in settings]
        return self._starts[key]

    def screen(self, fit: Fit, starts: list[StartColumns]) -> list[Screened]:
        """Return what each start promises when it is added to `fit` by linear least squares.

        The columns are those on top of the base: good enough to choose companions by.
        """
        shared = self._shared[fit.hypothesis.numbers]
        return [screened(self, fit, shared, start) for start in starts]

    def promised(self, variant: Variant, start: Fit, starts: list[StartColumns],
                 most: int = MULTIMODAL_SCREENED) -> list[Promise]:
        """Return what a multimodal effect promises when it is added to `start`, the most first, at
        so many of its starts."""
        ranked = _best_begun(self.screen(start, starts))
        return promises(self, start, self._one_more(start, variant),
                        [starts[place].setting for place in ranked[:most]])

    def fit(self, variant: Variant, start: Fit | None = None,
            starts: list[StartColumns] | None = None, rounds: int = 6, keep: int = 1,
            hopeless: float = math.inf) -> Fit:
        """Fit one more effect on top of `start` (None: the base), all numbers jointly.

        Args:
            variant: the effect that is added.
            start: the fit that it is added to.
            starts: where it may start (None: its own starts).
            rounds: iterations of the joint fit.
            keep: how many of the best starts are followed.
            hopeless: cost above which a fit is given up after its first rounds (a multimodal
                effect's is not).
        """
        start = start or self.base()
        starts = self.starts(variant) if starts is None else starts
        if variant.effect.multimodal:
            return best_promised(self, start, self.promised(variant, start, starts), rounds,
                                 self.iterate)
        promised = self.screen(start, starts)
        hypothesis = self._one_more(start, variant)
        fits: list[Fit] = []
        for place in _best_begun(promised)[:keep]:
            begun = self._begun(hypothesis, start, starts[place].setting, promised[place].sizes)
            if fits:
                begun = self.iterate(begun, FIRST_ROUNDS)
                if begun.cost > PROMISING * fits[0].cost:
                    continue
            fits.append(self.iterate(begun, rounds, hopeless=hopeless))
        return min(fits, key=lambda entry: entry.cost)

    def fit_from(self, start: Fit, variant: Variant, setting: dict[str, float], sizes: Array,
                 rounds: int) -> Fit:
        """Fit one more effect on top of `start`, begun at one setting with sizes (1,) or (2,)
        that linear least squares found."""
        begun = self._begun(self._one_more(start, variant), start, setting, sizes)
        return self.iterate(begun, rounds)

    def iterate(self, begin: Fit, rounds: int, tolerance: float = 3e-3,
                shared: Array | None = None, hopeless: float = math.inf) -> Fit:
        """Return the fit after so many rounds at most of joint steps by derivatives; `shared` are
        those of the nominal numbers, and maybe of the first effects (None: of the numbers, at the
        base)."""
        shared = self._shared[begin.hypothesis.numbers] if shared is None else shared
        return descended(self, begin, shared, rounds, tolerance, hopeless)

    def refit(self, fit: Fit, numbers: tuple[NominalNumber, ...], rounds: int = 6) -> Fit:
        """Fit the same effects with other numbers free, begun where the fit has them, or the model
        file; the rest stand as in that."""
        self.base(numbers)
        hypothesis = self.hypothesis(fit.hypothesis.variants, numbers)
        kept = dict(zip((number.name for number in fit.hypothesis.numbers), fit.vector,
                        strict=False))
        begun = [kept.get(number.name, start) for number, start in zip(
            numbers, hypothesis.start_of_numbers(), strict=True)]
        vector = np.concatenate([begun, fit.vector[len(fit.hypothesis.numbers):]])
        return self.iterate(self.evaluate(hypothesis, vector), rounds)

    def refine(self, fit: Fit, rounds: int = 6) -> Fit:
        """Iterate on with derivatives of the nominal numbers taken at the fit itself."""
        return self.iterate(fit, rounds, 1e-5, self.number_columns(fit))

    def nominal(self) -> Fit:
        """Return the model file as it stands (only the sampling delay is found)."""
        return self.base(self._delay_only)

    def with_file(self, fit: Fit) -> Fit:
        """Fit the same effects with the file's numbers as they stand (only the sampling delay is
        found)."""
        return self.refit(fit, self._delay_only)

    @property
    def _delay_only(self) -> tuple[NominalNumber, ...]:
        return tuple(number for number in self.numbers if number.name == DELAY)

    def without(self, fit: Fit, variant: int, rounds: int = 5) -> Fit:
        """Return the fit with one effect taken away and all the rest fitted anew."""
        return self.iterate(self.evaluate(*without_effects(fit, {variant})), rounds)

    def finished_without(self, fit: Fit, gone: set[int]) -> Fit:
        """Return the fit with some effects taken away and all the rest fitted anew, finished."""
        return self.finish(self.refine(self.evaluate(*without_effects(fit, gone))))

    # -- inside ----------------------------------------------------------------------------------

    def _one_more(self, start: Fit, variant: Variant) -> Hypothesis:
        return self.hypothesis((*start.hypothesis.variants, variant), start.hypothesis.numbers)

    def _begun(self, hypothesis: Hypothesis, start: Fit, setting: dict[str, float],
               sizes: Array) -> Fit:
        """Return where a fit with one effect more begins: at what linear least squares say, or
        nearer to none where that is beyond the linear and worse than without the effect."""
        best: Fit | None = None
        for part in PARTS:
            begun = self.evaluate(hypothesis, start_vector(hypothesis, start, setting,
                                                           part * sizes))
            if best is None or begun.cost < best.cost:
                best = begun
            if best.cost < start.cost or not hypothesis.variants[-1].scalable:
                break
        assert best is not None
        return best


def _best_begun(promised: list[Screened]) -> list[int]:
    """Return the places of the starts, those first at which a fit begins best."""
    return sorted(range(len(promised)), key=lambda place: promised[place].begun)
