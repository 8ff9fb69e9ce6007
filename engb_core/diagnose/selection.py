"""Which effects the data call for: parsimony before likelihood, and none rather than a wrong one.

A recording holds thousands of values, so that any imperfection of a formula is significant: what
counts is how much of the mismatch an effect takes away, not whether it does. Excess is the mean
squared residual minus the noise's 1.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.numbers import level
from engb_core.diagnose.search import extend, Search

__all__ = ['Selection', 'select']

# Excess that a clean recording may show through errors of noise level and derivatives.
CLEAN_EXCESS = 0.30
# A further effect must take away this part of the remaining excess, this much in units of the
# noise, and this part of the whole mismatch.
FURTHER_PART = 0.45
FURTHER_LEAST = 0.15
FURTHER_OF_WHOLE = 0.012
# An effect that contains another one is preferred only if it takes away this part of what the
# simpler one leaves.
CONTAINING_PART = 0.30
MOST_EFFECTS = 4
# Each fitted parameter must lower the logarithm of the mean square by this much.
PARAMETER_PRICE = 0.004


@dataclass(frozen=True)
class Selection:
    """What was chosen.

    Attributes:
        chosen: the fit of the chosen effects (the base where none is).
        rivals: (effects, fit) of other sets of the same size, best first.
        nominal_excess: of the model file as it stands.
        excess_before: of the refitted nominal model.
        excess_after: of the chosen.
    """

    chosen: Fit
    rivals: tuple[Fit, ...]
    nominal_excess: float
    excess_before: float
    excess_after: float

    @property
    def share(self) -> float:
        """Part of the base's excess that the chosen effects take away."""
        if self.excess_before <= 0.0:
            return 0.0
        return min(1.0, max(0.0, 1.0 - self.excess_after / self.excess_before))


def excess(fit: Fit, fitter: Fitter) -> float:
    """Return the mean squared residual above the noise's."""
    return max(level(fit, fitter) - 1.0, 0.0)


def price(fit: Fit, fitter: Fitter) -> float:
    """Return what fits of like size are ranked by: log mean square plus a price a parameter."""
    parameters = fit.hypothesis.size - len(fit.hypothesis.numbers)
    return math.log(max(level(fit, fitter), 1e-12)) + PARAMETER_PRICE * parameters


def select(result: Search) -> Selection:
    """Choose the effects, one after another, each with all that is chosen fitted anew."""
    fitter = result.fitter
    before = excess(result.base, fitter)
    nominal = excess(fitter.nominal(), fitter)
    chosen = result.base
    if before <= CLEAN_EXCESS:
        return Selection(chosen, (), nominal, before, before)
    for size in range(1, MOST_EFFECTS + 1):
        if size > 2:
            extend(result, chosen)
        candidates = sorted(result.of_size(size), key=lambda fit: price(fit, fitter))
        if not candidates:
            break
        best = _simplest(candidates, fitter)
        if not _worth(chosen, best, fitter, before):
            break
        chosen = best
        if excess(chosen, fitter) < FURTHER_LEAST:
            break
    size = len(chosen.hypothesis.variants)
    rivals = [fit for fit in result.of_size(size) if fit.hypothesis.ids != chosen.hypothesis.ids] \
        if size else result.of_size(1)
    return Selection(chosen, tuple(rivals), nominal, before, excess(chosen, fitter))


def _worth(chosen: Fit, best: Fit, fitter: Fitter, whole: float) -> bool:
    old, new = excess(chosen, fitter), excess(best, fitter)
    gain = old - new
    if not chosen.hypothesis.variants:
        return gain > FURTHER_LEAST and gain > 0.2 * old
    return gain > FURTHER_LEAST and gain > FURTHER_PART * old and gain > FURTHER_OF_WHOLE * whole


def _simplest(candidates: list[Fit], fitter: Fitter) -> Fit:
    best = candidates[0]
    for other in candidates[1:]:
        if _contained(other, best):
            left, right = excess(other, fitter), excess(best, fitter)
            if left - right < max(CONTAINING_PART * left, 0.08):
                return other
    return best


def _contained(simple: Fit, rich: Fit) -> bool:
    """Whether each effect of `simple` is in `rich` or contained in one that is."""
    if len(simple.hypothesis.variants) != len(rich.hypothesis.variants):
        return False
    contains = {entry for variant in rich.hypothesis.variants
                for entry in (variant.effect.id, *variant.effect.contains)}
    return all(entry in contains for entry in simple.hypothesis.ids) \
        and simple.hypothesis.ids != rich.hypothesis.ids
