"""Fits of effects whose cost has many narrow minima, where derivatives lead nowhere.

Whether a flank is met one sample earlier or later changes the effort by a jump. So their own
parameters are moved at random around the best so far, while the nominal numbers follow by linear
least squares; derivatives finish the work.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.linear_start import start_vector
from engb_core.diagnose.normal_equations import normal_equations

if TYPE_CHECKING:
    from engb_core.diagnose.fit import Fit, Fitter
    from engb_core.diagnose.hypothesis import Hypothesis

__all__ = ['begun_at', 'is_rugged', 'search_around']

Array = NDArray[np.float64]

# Standard deviation of a move: of a logarithm, or of the parameter's range; and how it shrinks
# with every move in vain.
MOVE_OF_LOGARITHM = 0.25
MOVE_OF_RANGE = 0.1
SHRINK = 0.97


def is_rugged(fit: Fit) -> bool:
    """Whether any effect of a fit is one of those."""
    return any(variant.effect.rugged for variant in fit.hypothesis.variants)


class _Settling:
    """Brings the nominal numbers to their linear optimum, wherever the effects stand."""

    def __init__(self, fitter: Fitter, fit: Fit, hypothesis: Hypothesis) -> None:
        self.fitter, self.hypothesis = fitter, hypothesis
        count = self.count = len(hypothesis.numbers)
        self.centre, self.spread = (part[:count] for part in hypothesis.prior)
        columns, weight = fitter.number_columns(fit), fitter.weight
        gram, _ = normal_equations(columns, fit.residual, weight)
        self.inverse = np.linalg.inv(gram + np.diag(1.0 / self.spread ** 2))
        self.columns = columns * weight[:, None] ** 2

    def __call__(self, place: Array) -> tuple[float, Array]:
        """Return the cost that is promised, and the vector (size,) that promises it."""
        count = self.count
        low, high = self.hypothesis.bounds
        trial = self.fitter.evaluate(self.hypothesis, np.clip(place, low, high))
        right = np.einsum('ij,i->j', self.columns, trial.residual) \
            + (self.centre - trial.vector[:count]) / self.spread ** 2
        step = self.inverse @ right
        better = trial.vector.copy()
        better[:count] = np.clip(better[:count] + step, low[:count], high[:count])
        return trial.cost - float(right @ step), better


def begun_at(fitter: Fitter, start: Fit, hypothesis: Hypothesis, settings: list[dict[str, float]],
             most: int) -> list[Fit]:
    """Return the fits with one effect more that promise less than `start`, at least one of them.

    The effect begins at any of `settings`, the numbers as in `start`, or as the model file has
    them: without the effect they have moved to make up for it, and may never find back.
    """
    settled = _Settling(fitter, start, hypothesis)
    numbers = len(hypothesis.numbers)
    begun = []
    for setting in settings:
        place = start_vector(hypothesis, start, setting, None)
        as_in_file = np.concatenate([hypothesis.start_of_numbers(), place[numbers:]])
        begun += [settled(place), settled(as_in_file)]
    best, *others = sorted(begun, key=lambda entry: entry[0])[:most]
    promising = [entry for entry in others if entry[0] < start.cost]
    return [fitter.evaluate(hypothesis, vector) for _, vector in (best, *promising)]


def search_around(fitter: Fitter, fit: Fit, moves: int) -> Fit:
    """Return the best fit found around `fit` by so many random moves (always the same ones)."""
    hypothesis = fit.hypothesis
    count = len(hypothesis.numbers)
    low, high = hypothesis.bounds
    owners = [hypothesis.variants[owner].effect for owner, _, _ in hypothesis.places]
    moved = [count + entry for entry, effect in enumerate(owners) if effect.rugged]
    scale = np.array([MOVE_OF_LOGARITHM if hypothesis.parameter(place - count).logarithmic
                      else MOVE_OF_RANGE * (high[place] - low[place]) for place in moved])
    settled = _Settling(fitter, fit, hypothesis)
    generator = np.random.default_rng(0)
    best = fit
    for _ in range(moves):
        place = best.vector.copy()
        place[moved] += scale * generator.standard_normal(len(moved))
        promised, better = settled(place)
        trial = fitter.evaluate(hypothesis, better) if promised < best.cost else None
        if trial is not None and trial.cost < best.cost:
            best = trial
        else:
            scale = scale * SHRINK
    return best
