"""Is a number wrong, or is physics missing? Which nominal numbers the data insist on changing.

Each group of numbers is held at the model file's values in turn while all others are refitted.
A number that is wrong can't be made up for by the others; one that merely moved along can.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.nominal import DELAY
from engb_core.effects.catalogue import get_effect

__all__ = ['NumberFinding', 'level', 'wrong_numbers']

# Effects that say "this number is wrong", by the nominal number that they stand for.
_BY_NUMBER = {'inertia': 'inertia_error', 'viscous_friction': 'viscous_friction_error',
              'coulomb': 'coulomb_friction_error', 'load_gain': 'load_dependent_friction'}
_LOAD_EFFECTS = ('load_stiffness_error', 'contact_shift', 'torque_offset')
# Rise of the mean squared residual (noise = 1) at which a held number counts as insisted upon,
# and the part of the file's whole excess that it must be.
INSISTED = 0.25
INSISTED_PART = 0.08
# A second wrong number is named if the data insist on it nearly as much as on the first: the
# others of a refitted file moved along with the one that is wrong.
SECOND = 0.6
# A file that fits nearly as well as any numbers without the effects was refitted around them.
REFITTED = 1.3


@dataclass(frozen=True)
class NumberFinding:
    """A wrong number: the effect that names it, its fit, how much it matters (rise of the mean
    squared residual when it is held at the file's value)."""

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

    With no effect in `explained` a number is named if the data insist on it far more than on
    any other. Beside effects it is named only if the file's other numbers fit as they stand: a
    file that was refitted around missing physics has all its numbers moved.
    """
    floor = level(explained, fitter)
    groups = _groups(fitter)
    rises = {name: level(_without(fitter, explained, members), fitter) - floor
             for name, members in groups.items()}
    excess = max(level(fitter.nominal(), fitter) - 1.0, 0.0)
    least = max(INSISTED, INSISTED_PART * excess, SECOND * max(rises.values()))
    insisted = [name for name in rises if rises[name] >= least]
    insisted.sort(key=lambda name: -rises[name])
    if not insisted:
        return []
    if explained.hypothesis.variants:
        before = max(level(fitter.base(), fitter) - 1.0, 0.0)
        if excess < REFITTED * before:
            return []
        insisted = [name for name in insisted if _alone(fitter, explained, groups, [name])
                    < floor + max(INSISTED, 0.15 * rises[name])][:1]
    elif len(insisted) > 1 and _alone(fitter, explained, groups, insisted[:1]) \
            < floor + max(INSISTED, 0.1 * rises[insisted[0]]):
        insisted = insisted[:1]
    found = []
    for name in insisted:
        finding = _named(fitter, explained, name, groups[name], rises[name], floor)
        if finding is not None:
            found.append(finding)
    return found


def _groups(fitter: Fitter) -> dict[str, set[str]]:
    names = [number.name for number in fitter.numbers]
    groups = {name: {name} for name in names if name in _BY_NUMBER}
    load = {name for name in names if name.startswith(('contact_angle', 'load_a', 'load_p'))
            or (name[0] == 'p' and name[1:].isdigit())}
    if load:
        groups['load'] = load
    return groups


def _without(fitter: Fitter, explained: Fit, held: set[str]) -> Fit:
    return fitter.refit(explained, tuple(number for number in fitter.numbers
                                         if number.name not in held))


def _alone(fitter: Fitter, explained: Fit, groups: dict[str, set[str]], names: list[str],
           ) -> float:
    free = {DELAY}.union(*(groups[name] for name in names))
    fit = fitter.refit(explained, tuple(number for number in fitter.numbers
                                        if number.name in free))
    return level(fit, fitter)


def _named(fitter: Fitter, explained: Fit, name: str, members: set[str], rise: float,
           floor: float) -> NumberFinding | None:
    if name != 'load':
        place = next(place for place, number in enumerate(explained.hypothesis.numbers)
                     if number.name == name)
        value = float(explained.vector[place])
        if explained.hypothesis.numbers[place].logarithmic:
            value = float(np.exp(value))
        if name == 'load_gain' and value < fitter.problem.model.friction.load_gain:
            return None
        return NumberFinding(_BY_NUMBER[name], explained, rise, value)
    held = _without(fitter, explained, members)
    best = None
    for effect_id in _LOAD_EFFECTS:
        effect = get_effect(effect_id)
        for variant in variants_of(effect, fitter.problem.scene):
            fit = fitter.fit(variant, held, rounds=8, keep=2)
            if best is None or fit.cost < best[1].cost:
                best = (effect_id, fit)
    effect_id, fit = best
    # One number must account for what the whole load curve's change accounts for.
    if level(fit, fitter) > floor + max(INSISTED, 0.15 * rise):
        return None
    last = len(fit.hypothesis.variants) - 1
    return NumberFinding(effect_id, fit, rise, fit.hypothesis.values(fit.vector, last, 0)[0])
