# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a hypothesis is fitted by: its prediction, residual, cost and derivatives on one problem.

No optimiser: descent.py, linear_start.py and multistart.py work on this, and fit.py on them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.fit_steps import derivative_step
from engb_core.diagnose.fitted import Fit, without_effects
from engb_core.diagnose.hypothesis import Hypothesis, Variant
from engb_core.diagnose.nominal import (
    DELAY,
    Knots,
    nominal_numbers,
    NominalNumber,
    with_load_shape,
    with_reference_load,
)
from engb_core.diagnose.parallel_map import parallel_map
from engb_core.diagnose.problem import Problem

__all__ = ['Objective', 'added_by']

Array = NDArray[np.float64]


class Objective:
    """Predictions of one problem, and what they cost.

    Attributes:
        problem: recordings, model and noise.
        threads: that predict side by side.
        measured: (m,) filtered effort of all runs [N·m].
        sigma: (m,) noise of the difference between measured and predicted effort [N·m].
        spread: (m,) what weighs the values in the cost [N·m].
        fitted: (m,) where a fit may look.
        judged: (m,) where a law is judged: everywhere, if the motion is resolved (laws).
        load_shape: the knots of a table beside the file's load curve that is among the numbers;
            None where there is none.
        numbers: the nominal numbers that every hypothesis refits.
    """

    def __init__(self, problem: Problem, threads: int = 1,
                 load_shape: Knots | None = None) -> None:
        self.problem = problem
        self.load_shape = load_shape
        self.threads = threads
        self.measured = problem.measured
        self.sigma = problem.sigma
        self.spread = self.sigma
        self.fitted = problem.fitted
        self.judged = np.ones(self.measured.size, dtype=np.bool_)
        self._model = with_reference_load(problem.model, problem.scene)
        if load_shape is not None:
            self._model = with_load_shape(self._model, problem.scene, load_shape)
        self.numbers = tuple(
            number for number in nominal_numbers(self._model, problem.scene)
            if number.name != DELAY or not problem.sampled_together)

    @property
    def weight(self) -> Array:
        """What multiplies each residual in the cost, (m,): 0 where no fit may look."""
        return np.where(self.fitted, 1.0 / self.spread, 0.0)

    def hypothesis(self, variants: tuple[Variant, ...] = (),
                   numbers: tuple[NominalNumber, ...] | None = None) -> Hypothesis:
        """Return a hypothesis of these effects with these free numbers (None: all)."""
        return Hypothesis(self._model, self.numbers if numbers is None else numbers,
                          variants, len(self.problem.runs), self.problem.onsets)

    def predict(self, hypothesis: Hypothesis, vector: Array) -> Array:
        """Return the filtered effort of all runs, (m,)."""
        predicted = np.concatenate([run.predicted(hypothesis.physics(vector, index))
                                    for index, run in enumerate(self.problem.runs)])
        for effect, onset in hypothesis.onsets:
            without, kept = hypothesis.before(effect, onset)
            predicted = np.where(onset.before(self.problem.times),
                                 self.predict(without, vector[kept]), predicted)
        return predicted

    def evaluate(self, hypothesis: Hypothesis, vector: Array) -> Fit:
        """Return the hypothesis at `vector`, not fitted."""
        predicted = self.predict(hypothesis, vector)
        residual = self.measured - predicted
        return Fit(hypothesis, vector, predicted, residual,
                   self._cost(hypothesis, vector, residual))

    def columns(self, fit: Fit, places: range) -> Array:
        """Return the derivatives by some entries of the fit's vector, (m, count)."""
        hypothesis, vector = fit.hypothesis, fit.vector
        high, spread = hypothesis.bounds[1], hypothesis.prior[1]

        def column(place: int) -> Array:
            step = 1e-4 * min(spread[place], 1e6) if place < len(hypothesis.numbers) else \
                derivative_step(hypothesis.parameter(place - len(hypothesis.numbers)),
                                vector[place])
            if vector[place] + step > high[place]:
                step = -step
            moved = vector.copy()
            moved[place] += step
            with np.errstate(over='ignore'):    # What runs away is left for its cost.
                return (self.predict(hypothesis, moved) - fit.predicted) / step

        found = list(parallel_map(column, places, self.threads))
        return np.stack(found, axis=1) if found else np.zeros((fit.predicted.size, 0))

    def number_columns(self, fit: Fit) -> Array:
        """Return the derivatives by the nominal numbers at a fit, (m, count)."""
        return self.columns(fit, range(len(fit.hypothesis.numbers)))

    def finish(self, fit: Fit) -> Fit:
        """Return the fit with all derivatives at its end."""
        return replace(fit, jacobian=self.columns(fit, range(fit.hypothesis.size)))

    def finished(self, fit: Fit) -> Fit:
        """Return the fit with all derivatives at its end, which it may have already."""
        return fit if fit.jacobian is not None else self.finish(fit)

    def _cost(self, hypothesis: Hypothesis, vector: Array, residual: Array) -> float:
        scaled = (residual / self.spread)[self.fitted]
        if not np.isfinite(scaled).all():
            return np.inf
        centre, spread = hypothesis.prior
        with np.errstate(over='ignore'):
            # Far from anything real it is infinite.
            squares = scaled @ scaled
        return float(squares + np.sum(((vector - centre) / spread) ** 2))


def added_by(objective: Objective, fit: Fit, index: int) -> Array:
    """Return what one effect adds to the filtered effort of a fit, (m,) [N·m], all else kept."""
    return fit.predicted - objective.predict(*without_effects(fit, {index}))
