"""Is a number wrong, or is physics missing? Which nominal numbers the data insist on changing.

Each number is held at the model file's value in turn while all others are refitted. A number
that is wrong can't be made up for by the others; one that merely moved along can. The load
curve's numbers are judged as a whole, in selection.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.nominal import DELAY

__all__ = ['BESIDE', 'INSISTED', 'INSISTED_PART', 'NumberFinding', 'REFITTED', 'level',
           'wrong_numbers']

# Effects that say "this number is wrong", by the nominal number that they stand for.
_BY_NUMBER = {'inertia': 'inertia_error', 'viscous_friction': 'viscous_friction_error',
              'coulomb': 'coulomb_friction_error', 'load_gain': 'load_dependent_friction'}
# Rise of the mean squared residual (noise = 1) at which a held number counts as insisted upon,
# and the part of the file's whole excess that it must be.
INSISTED = 0.25
INSISTED_PART = 0.08
# A second wrong number is named if the data insist on it nearly as much as on the first: the
# others of a refitted file moved along with the one that is wrong.
SECOND = 0.75
# A file that fits nearly as well as any numbers without the effects was refitted around them.
REFITTED = 1.5
# Beside effects a wrong number must matter as much as this part of what the file loses to
# refitted numbers.
BESIDE = 0.5


@dataclass(frozen=True)
class NumberFinding:
    """A wrong number: the effect that names it, its fit, how much it matters (rise of the mean
    squared residual when it is held at the file's value), its value."""

    effect: str
    fit: Fit
    matters: float
    value: float


def level(fit: Fit, fitter: Fitter) -> float:
    """Return the mean squared residual over all that was recorded, in units of the noise's."""
    weight = 1.0 / fitter.spread ** 2
    return float(np.sum(weight * fit.residual ** 2) / np.sum(weight * fitter.sigma ** 2))


def wrong_numbers(fitter: Fitter, explained: Fit) -> list[NumberFinding]:
    """Return the numbers that are wrong in the model file, given the effects in `explained`.

    With no effect in `explained` a number is named if the data insist on it more than on others.
    Beside effects it is named only if the file's other numbers fit as they stand: a file that
    was refitted around missing physics has all its numbers moved.
    """
    numbers = explained.hypothesis.numbers
    floor = level(explained, fitter)
    excess = max(level(fitter.nominal(), fitter) - 1.0, 0.0)
    rises = {number.name: level(fitter.refit(
                 explained, tuple(other for other in numbers if other is not number)), fitter)
             - floor for number in numbers if number.name in _BY_NUMBER}
    if not rises:
        return []
    least = max(INSISTED, INSISTED_PART * excess, SECOND * max(rises.values()))
    insisted = sorted((name for name in rises if rises[name] >= least),
                      key=lambda name: -rises[name])
    variants = explained.hypothesis.variants
    if any(variant.effect.number_only for variant in variants) and not all(
            variant.effect.number_only for variant in variants):
        return []
    if variants:
        before = max(level(fitter.base(), fitter) - 1.0, 0.0)
        if excess < REFITTED * before:
            return []
        insisted = [name for name in insisted if rises[name] > BESIDE * (excess - before)
                    or _alone(fitter, explained, name)
                    < floor + max(INSISTED, 0.15 * rises[name])][:1]
    elif len(insisted) > 1 and _alone(fitter, explained, insisted[0]) \
            < floor + max(INSISTED, 0.1 * rises[insisted[0]]):
        insisted = insisted[:1]
    return [finding for name in insisted
            if (finding := _named(fitter, explained, name, rises[name])) is not None]


def _alone(fitter: Fitter, explained: Fit, name: str) -> float:
    fit = fitter.refit(explained, tuple(number for number in explained.hypothesis.numbers
                                        if number.name in (DELAY, name)))
    return level(fit, fitter)


def _named(fitter: Fitter, explained: Fit, name: str, rise: float) -> NumberFinding | None:
    place = next(place for place, number in enumerate(explained.hypothesis.numbers)
                 if number.name == name)
    value = float(explained.vector[place])
    if explained.hypothesis.numbers[place].logarithmic:
        value = float(np.exp(value))
    if name == 'load_gain' and value < fitter.problem.model.friction.load_gain:
        return None
    return NumberFinding(_BY_NUMBER[name], explained, rise, value)
