"""Fits of effects whose cost has many narrow minima, where derivatives lead nowhere.

Whether a flank is met one sample earlier or later changes the effort by a jump. So their own
parameters are moved at random around the best so far, while the nominal numbers follow by linear
least squares; derivatives finish the work.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from engb_core.diagnose.normal_equations import normal_equations

if TYPE_CHECKING:
    from engb_core.diagnose.fit import Fit, Fitter

__all__ = ['is_rugged', 'search_around']

# Standard deviation of a move: of a logarithm, or of the parameter's range; and how it shrinks
# with every move in vain.
MOVE_OF_LOGARITHM = 0.25
MOVE_OF_RANGE = 0.1
SHRINK = 0.97


def is_rugged(fit: Fit) -> bool:
    """Whether any effect of a fit is one of those."""
    return any(variant.effect.rugged for variant in fit.hypothesis.variants)


def search_around(fitter: Fitter, fit: Fit, moves: int) -> Fit:
    """Return the best fit found around `fit` by so many random moves (always the same ones)."""
    hypothesis = fit.hypothesis
    count = len(hypothesis.numbers)
    low, high = hypothesis.bounds
    owners = [hypothesis.variants[owner].effect for owner, _, _ in hypothesis.places]
    moved = [count + entry for entry, effect in enumerate(owners) if effect.rugged]
    scale = np.array([MOVE_OF_LOGARITHM if hypothesis.parameter(place - count).logarithmic
                      else MOVE_OF_RANGE * (high[place] - low[place]) for place in moved])
    centre, spread = (part[:count] for part in hypothesis.prior)
    weight = fitter.weight
    columns = fitter.number_columns(fit)
    gram, _ = normal_equations(columns, fit.residual, weight)
    inverse = np.linalg.inv(gram + np.diag(1.0 / spread ** 2))
    columns *= weight[:, None] ** 2

    def settled(place: np.ndarray) -> tuple[float, np.ndarray]:
        """Return cost and vector with the nominal numbers brought to their linear optimum."""
        trial = fitter.evaluate(hypothesis, place)
        right = np.einsum('ij,i->j', columns, trial.residual) \
            + (centre - place[:count]) / spread ** 2
        step = inverse @ right
        better = place.copy()
        better[:count] = np.clip(place[:count] + step, low[:count], high[:count])
        return trial.cost - float(right @ step), better

    generator = np.random.default_rng(0)
    best = fit
    for _ in range(moves):
        place = best.vector.copy()
        place[moved] += scale * generator.standard_normal(len(moved))
        promised, better = settled(np.clip(place, low, high))
        trial = fitter.evaluate(hypothesis, better) if promised < best.cost else None
        if trial is not None and trial.cost < best.cost:
            best = trial
        else:
            scale = scale * SHRINK
    return best
