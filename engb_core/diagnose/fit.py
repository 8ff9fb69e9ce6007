"""Joint fit of nominal numbers and effects, through the filter, by damped least squares.

The nominal numbers are refitted in every hypothesis, since a model file may have been refitted
on the very recording and so hide the effect; they are held by what the file says only where the
data say nothing. Their derivatives hardly depend on the effect: they are computed once and shared
(a quasi-Newton step; the last step before an answer is given computes them anew).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.hypothesis import Hypothesis, Variant
from engb_core.diagnose.nominal import nominal_numbers, NominalNumber
from engb_core.diagnose.problem import Problem
from engb_core.effects.base import Parameter

__all__ = ['Fit', 'Fitter']

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fit:
    """A fitted hypothesis.

    Attributes:
        hypothesis: what was fitted.
        vector: its numbers.
        predicted: (m,) filtered effort of all runs.
        cost: Σ (residual/σ)² over the fitted values plus the priors' part.
        residual: (m,) measured − predicted [N·m].
        jacobian: (m, size) derivatives, or None before `Fitter.finish`.
    """

    hypothesis: Hypothesis
    vector: Array
    predicted: Array
    residual: Array
    cost: float
    jacobian: Array | None = None


class Fitter:
    """Fits hypotheses to one problem."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.measured = problem.measured
        self.sigma = problem.sigma
        self.fitted = problem.fitted
        self.numbers = nominal_numbers(problem.model, problem.scene)
        self._shared: dict[tuple[NominalNumber, ...], Array] = {}
        self._base: dict[tuple[NominalNumber, ...], Fit] = {}

    # -- prediction ------------------------------------------------------------------------------

    def hypothesis(self, variants: tuple[Variant, ...] = (),
                   numbers: tuple[NominalNumber, ...] | None = None) -> Hypothesis:
        """Return a hypothesis of these effects with these free numbers (None: all)."""
        return Hypothesis(self.problem.model, self.numbers if numbers is None else numbers,
                          variants, len(self.problem.runs))

    def predict(self, hypothesis: Hypothesis, vector: Array) -> Array:
        """Return the filtered effort of all runs, (m,)."""
        return np.concatenate([run.predicted(hypothesis.physics(vector, index))
                               for index, run in enumerate(self.problem.runs)])

    def base(self, numbers: tuple[NominalNumber, ...] | None = None) -> Fit:
        """Return the refit of the nominal numbers alone."""
        numbers = self.numbers if numbers is None else numbers
        if numbers not in self._base:
            hypothesis = self.hypothesis((), numbers)
            vector = hypothesis.start_of_numbers()
            if numbers:
                self._shared[numbers] = self._columns(hypothesis, vector, range(len(numbers)))
                fit = self._iterate(hypothesis, vector, 4)
                self._shared[numbers] = self._columns(hypothesis, fit.vector,
                                                      range(len(numbers)))
                fit = self._iterate(hypothesis, fit.vector, 4)
            else:
                self._shared[numbers] = np.zeros((self.measured.size, 0))
                fit = self._evaluate(hypothesis, vector)
            self._base[numbers] = fit
        return self._base[numbers]

    # -- fitting ---------------------------------------------------------------------------------

    def fit(self, variants: tuple[Variant, ...], start: Fit | None = None,
            numbers: tuple[NominalNumber, ...] | None = None,
            starts: list[dict[str, float]] | None = None, rounds: int = 8,
            keep: int = 1) -> Fit:
        """Fit the last of `variants` from its starts, on top of `start`, then all together.

        Args:
            variants: the effects; all but the last are taken over from `start`.
            start: a fit of `variants[:-1]`; None: the base.
            numbers: the free nominal numbers; None: all.
            starts: for the last effect's parameters (None: its own).
            rounds: iterations of the joint fit.
            keep: how many of the best starts are followed.
        """
        base = start or self.base(numbers)
        self.base(base.hypothesis.numbers)
        hypothesis = self.hypothesis(variants, base.hypothesis.numbers)
        tried = []
        for setting in (variants[-1].starts() if starts is None else starts):
            vector, cost = self._screen(hypothesis, base, setting)
            tried.append((cost, vector))
        tried.sort(key=lambda entry: entry[0])
        fits = [self._iterate(hypothesis, vector, rounds) for _, vector in tried[:keep]]
        return min(fits, key=lambda entry: entry.cost)

    def refine(self, fit: Fit, rounds: int = 6) -> Fit:
        """Iterate on with derivatives of the nominal numbers taken at the fit itself."""
        numbers = fit.hypothesis.numbers
        saved = self._shared[numbers]
        self._shared[numbers] = self._columns(fit.hypothesis, fit.vector, range(len(numbers)))
        try:
            return self._iterate(fit.hypothesis, fit.vector, rounds)
        finally:
            self._shared[numbers] = saved

    def finish(self, fit: Fit) -> Fit:
        """Return the fit with all derivatives at its end."""
        columns = self._columns(fit.hypothesis, fit.vector, range(fit.hypothesis.size))
        return Fit(fit.hypothesis, fit.vector, fit.predicted, fit.residual, fit.cost, columns)

    # -- inside ----------------------------------------------------------------------------------

    def _evaluate(self, hypothesis: Hypothesis, vector: Array) -> Fit:
        predicted = self.predict(hypothesis, vector)
        residual = self.measured - predicted
        return Fit(hypothesis, vector, predicted, residual,
                   self._cost(hypothesis, vector, residual))

    def _cost(self, hypothesis: Hypothesis, vector: Array, residual: Array) -> float:
        scaled = (residual / self.sigma)[self.fitted]
        if not np.isfinite(scaled).all():
            return np.inf
        centre, spread = self._prior(hypothesis)
        return float(scaled @ scaled + np.sum(((vector - centre) / spread) ** 2))

    def _prior(self, hypothesis: Hypothesis) -> tuple[Array, Array]:
        numbers = hypothesis.numbers
        centre = list(hypothesis.start_of_numbers())
        spread = [number.spread for number in numbers]
        for entry in range(hypothesis.size - len(numbers)):
            parameter = hypothesis.parameter(entry)
            middle, width = _weak_prior(parameter)
            centre.append(middle)
            spread.append(width)
        return np.array(centre), np.array(spread)

    def _columns(self, hypothesis: Hypothesis, vector: Array, places: range | list[int]) -> Array:
        low, high = hypothesis.bounds()
        _, spread = self._prior(hypothesis)
        reference = self.predict(hypothesis, vector)
        columns = np.empty((reference.size, len(places)))
        for column, place in enumerate(places):
            step = 1e-4 * min(spread[place], 1e6) if place < len(hypothesis.numbers) else \
                _step(hypothesis.parameter(place - len(hypothesis.numbers)), vector[place])
            if vector[place] + step > high[place]:
                step = -step
            moved = vector.copy()
            moved[place] += step
            columns[:, column] = (self.predict(hypothesis, moved) - reference) / step
        return columns

    def _screen(self, hypothesis: Hypothesis, base: Fit, setting: dict[str, float],
                ) -> tuple[Array, float]:
        """Return a start vector: the last effect at `setting`, sized by linear least squares."""
        last = len(hypothesis.variants) - 1
        sizing = hypothesis.variants[last].sizing
        offset = len(hypothesis.numbers)
        low, high = hypothesis.bounds()
        entries = [entry for entry, (owner, _, _) in enumerate(hypothesis.places)
                   if owner == last]
        vector = np.concatenate([base.vector, np.zeros(len(entries))])
        size_place = phase_places = None
        phases: list[int] = []
        for entry in entries:
            parameter = hypothesis.parameter(entry)
            place = offset + entry
            if parameter.name == 'phase':
                phases.append(place)
            value = setting.get(parameter.name, parameter.starts[0] if parameter.starts else 0.0)
            if parameter.logarithmic:
                value = np.log(value)
            vector[place] = value
            if parameter is sizing:
                size_place = place
        phase_places = phases
        linear = sizing.none is not None and not sizing.logarithmic
        if sizing.none is None:
            # A nominal number under another name: start at the file's value.
            vector[size_place] = _nominal_value(self.problem.model, sizing.name)
            columns = self._columns(hypothesis, vector, [size_place])
            return self._solved(hypothesis, base, vector, columns, [size_place], low, high)
        if not linear:
            return vector, self._projected_cost(hypothesis, base, vector)
        unit = sizing.starts[0] - sizing.none
        predicted = [(self.predict(hypothesis, vector) - base.predicted) / unit]
        if phase_places:
            turned = vector.copy()
            turned[phase_places] += 0.5 * np.pi
            predicted.append((self.predict(hypothesis, turned) - base.predicted) / unit)
        columns = np.stack(predicted, axis=1)
        vector, cost = self._solved(hypothesis, base, vector, columns, [size_place], low, high,
                                    phase_places)
        return vector, cost

    def _solved(self, hypothesis: Hypothesis, base: Fit, vector: Array, columns: Array,
                places: list[int], low: Array, high: Array, phases: list[int] | None = None,
                ) -> tuple[Array, float]:
        shared = self._shared[hypothesis.numbers]
        old = base.vector.size - len(hypothesis.numbers)
        design = np.concatenate([shared, columns], axis=1)
        solution, cost = self._least_squares(hypothesis, base, design)
        vector = vector.copy()
        count = len(hypothesis.numbers)
        vector[:count] += solution[:count]
        sizes = solution[count:]
        sizing = hypothesis.variants[-1].sizing
        if phases:
            vector[places[0]] = float(np.hypot(*sizes))
            vector[phases] = float(np.arctan2(sizes[1], sizes[0])) + vector[phases]
        elif sizing.none is None:
            vector[places[0]] += sizes[0]
        else:
            vector[places[0]] = sizing.none + sizes[0]
        del old
        return np.clip(vector, low, high), cost

    def _least_squares(self, hypothesis: Hypothesis, base: Fit, design: Array,
                       ) -> tuple[Array, float]:
        rows = self.fitted
        scaled = design[rows] / self.sigma[rows, None]
        target = (base.residual / self.sigma)[rows]
        norm = np.sqrt(np.einsum('ij,ij->j', scaled, scaled)) + 1e-300
        scaled = scaled / norm
        gram = scaled.T @ scaled
        count = len(hypothesis.numbers)
        ridge = np.zeros(design.shape[1])
        pull = np.zeros(design.shape[1])
        if count:
            centre, spread = self._prior(hypothesis)
            ridge[:count] = 1.0 / (spread[:count] * norm[:count]) ** 2
            pull[:count] = (centre[:count] - base.vector[:count]) / spread[:count] ** 2 \
                / norm[:count]
        ridge += 1e-12
        right = scaled.T @ target + pull
        solution = np.linalg.solve(gram + np.diag(ridge), right)
        cost = float(target @ target - solution @ right)
        return solution / norm, cost

    def _projected_cost(self, hypothesis: Hypothesis, base: Fit, vector: Array) -> float:
        predicted = self.predict(hypothesis, vector)
        moved = Fit(base.hypothesis, base.vector, predicted, self.measured - predicted, 0.0)
        _, cost = self._least_squares(hypothesis, moved, self._shared[hypothesis.numbers])
        return cost

    def _iterate(self, hypothesis: Hypothesis, vector: Array, rounds: int) -> Fit:
        low, high = hypothesis.bounds()
        centre, spread = self._prior(hypothesis)
        count = len(hypothesis.numbers)
        rows = self.fitted
        weight = 1.0 / self.sigma[rows]
        best = self._evaluate(hypothesis, np.clip(vector, low, high))
        damping = 1e-4
        effects = None
        for _ in range(rounds):
            if effects is None:
                effects = self._columns(hypothesis, best.vector,
                                        list(range(count, hypothesis.size)))
                design = np.concatenate([self._shared[hypothesis.numbers], effects], axis=1)
                scaled = design[rows] * weight[:, None]
                gram = scaled.T @ scaled + np.diag(1.0 / spread ** 2)
            right = scaled.T @ (best.residual[rows] * weight) \
                + (centre - best.vector) / spread ** 2
            step = np.linalg.solve(gram + damping * np.diag(np.diag(gram)), right)
            for place in range(count, hypothesis.size):
                step[place] = np.clip(step[place], *_largest_step(
                    hypothesis.parameter(place - count)))
            trial = self._evaluate(hypothesis, np.clip(best.vector + step, low, high))
            if trial.cost < best.cost:
                done = best.cost - trial.cost < 1e-4 * best.cost + 0.05
                best, effects = trial, None
                damping = max(damping * 0.2, 1e-6)
                if done:
                    break
            else:
                damping *= 20.0
                if damping > 1e5:
                    break
        return best


def _weak_prior(parameter: Parameter) -> tuple[float, float]:
    """Return centre and width of what is known of an effect's parameter beforehand: its order of
    magnitude where it has starts, else nothing."""
    if parameter.name in ('phase', 'order') or not parameter.starts:
        return 0.0, 1e6
    if parameter.logarithmic:
        logs = np.log(parameter.starts)
        return float(logs.mean()), float(max(np.ptp(logs), 2.0))
    if parameter.none is not None:
        return parameter.none, 1e6
    return float(np.mean(parameter.starts)), float(max(np.ptp(parameter.starts), 0.5))


def _step(parameter: Parameter, value: float) -> float:
    if parameter.logarithmic:
        return 1e-5 if parameter.name == 'order' else 1e-3
    return 1e-4 * max(abs(value), abs(parameter.starts[0]) if parameter.starts else 1.0, 1e-3)


def _largest_step(parameter: Parameter) -> tuple[float, float]:
    if parameter.name == 'order':
        return -0.01, 0.01
    if parameter.logarithmic:
        return -1.2, 1.2
    if parameter.name in ('phase', 'shape'):
        return -0.6, 0.6
    return -np.inf, np.inf


def _nominal_value(model: object, name: str) -> float:
    for section in (model.motor, model.friction):
        if hasattr(section, name):
            return getattr(section, name)
    raise KeyError(name)


