# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Is a number wrong, or is physics missing? Which nominal numbers the data insist on changing.

Each number is held at the model file's value in turn while others are refitted. A number that is
wrong can't be made up for by the others; one that merely moved along can. Beside effects it is
also asked whether a refit of the file around them has moved it (moved_by_refit.py). The load
curve's numbers are judged as a whole, in load_cause.py.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
import itertools

import numpy as np

from engb_core.diagnose.constants import (
    CLEAN_EXCESS,
    LARGER_PART,
    LEAST_PROBABILITY,
)
from engb_core.diagnose.fitted import mean_square
from engb_core.diagnose.formula import as_refitted, part_of_formula
from engb_core.diagnose.held_parameters import LOAD
from engb_core.diagnose.nominal import (
    CURVATURE,
    DELAY,
    LOAD_NUMBERS,
    NominalNumber,
    SHAPE_NUMBERS,
)
from engb_core.diagnose.numbers.held_load_curve import BY_ONE_NUMBER
from engb_core.diagnose.numbers.moved_by_refit import Refit, refit_of
from engb_core.diagnose.numbers.spike_and_slab import standing
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.parallel_map import parallel_map
from engb_core.diagnose.score.reduced_chi_square import excess, reduced_chi_square
from engb_core.effects.catalogue import get_effect

__all__ = ['NumberFinding', 'file_stands', 'held_at_file', 'number_place', 'numbers_of',
           'refit_of_file', 'refitted', 'still_wrong', 'was_refitted',
           'with_these_refitted', 'wrong_numbers']

# Effects that say "this number is wrong", by the nominal number that they stand for.
_BY_NUMBER = {'inertia': 'inertia_error', 'viscous_friction': 'viscous_friction_error',
              'coulomb': 'coulomb_friction_error', 'load_gain': 'load_dependent_friction'}


# Numbers that no name stands for: when samples of effort and position were taken, how friction
# bends with load, and how it turns with the direction. That they are off says nothing of others.
NAMELESS = (DELAY, CURVATURE, 'saturation_velocity')
# What acts just like the one number, where effort is a command.
BRAKES_LIKE, BACK_EMF = 'viscous_friction', 'back_emf'


@dataclass(frozen=True)
class NumberFinding:
    """A wrong number.

    Attributes:
        effect: that names it.
        fit: in which it is free.
        matters: rise of the mean squared residual when it is held at the file's value.
        kept: whether a refit of the file left just this one as it was.
        rivals: (effect, weight) of numbers of which one is wrong instead, if this one isn't.
        moved: probability that it is not as in the file, and that no refit has moved it.
    """

    effect: str
    fit: Fit
    matters: float
    kept: bool = False
    rivals: tuple[tuple[str, float], ...] = ()
    moved: float = 1.0


def wrong_numbers(fitter: Fitter, explained: Fit) -> list[NumberFinding]:
    """Return the numbers that are wrong in the model file, given the effects in `explained`.

    Beside missing physics, or a number that moves the whole load curve, a number is named only
    where no refit of the file around that has moved it (moved_by_refit.py). Where something
    without a name stands beside, which may have taken in what others of them do or left what
    passes for one, the file has to tell as well.
    """
    variants = explained.hypothesis.variants
    beside_physics = not all(variant.number_only for variant in variants)
    if beside_physics and not explained.hypothesis.has_unnamed:
        return _beside_physics(fitter, explained)
    found = _told_by_file(fitter, explained)
    if not found and _has_settled_physics(fitter):
        # The file does not tell; the numbers themselves may.
        return _beside_physics(fitter, explained)
    if not variants:
        # What the file misses may be another load curve, around which it was refitted.
        return _wrong_by_themselves(fitter, explained, found) \
            if found and fitter.load_shape else found
    # One that a refit held, it has not moved.
    held = [] if beside_physics else [finding for finding in found if finding.kept]
    others = [finding for finding in found if finding not in held]
    return [*held, *(_wrong_by_themselves(fitter, explained, others) if others else [])]


def _has_settled_physics(fitter: Fitter) -> bool:
    """Whether an earlier round has settled physics that the file does not have: a resonance."""
    before = (fitter.earlier or fitter).problem.model.effects
    return any(entry not in before and not get_effect(entry.effect).number_only
               for entry in fitter.problem.model.effects)


def _told_by_file(fitter: Fitter, explained: Fit) -> list[NumberFinding]:
    """Return the numbers beside which the file's others stand, or which a refit of it held: a
    file that was refitted around what is missing has all others moved."""
    few = _moved(fitter, explained)
    if few:
        return few
    load_kept = bool(explained.hypothesis.variants) and fitter.held == (LOAD,)
    if load_kept and (refitted(fitter) or was_refitted(fitter)):
        # All others moved to make up for the load curve, which has its own cause.
        return []
    insisted = _insisted(fitter, explained, load_kept)
    if load_kept:
        # The file was not refitted, and may stand but for one number.
        return _fewest(fitter, explained, insisted, 1)
    kept = [_BY_NUMBER[name] for name in fitter.held if name in _BY_NUMBER]
    if explained.hypothesis.variants and len(kept) > 1:
        # What is missing may have passed for one of them.
        kept = []
    insisted = [replace(finding, kept=finding.effect in kept) for finding in insisted]
    held = [_or_another(fitter, finding, insisted) if len(kept) == 1 else finding
            for finding in insisted if finding.kept]
    unnamed = explained.hypothesis.has_unnamed
    if kept and not held and unnamed:
        held = [replace(finding, kept=True) for finding in _insisted(
            fitter, _named_only(fitter, explained)) if finding.effect in kept]
    if (explained.hypothesis.variants and held) or was_refitted(fitter):
        # A file that was refitted around what is settled by now has all other numbers moved.
        return held
    # A file with one number wrong is plainer than a refit that held it, and that than two of them.
    return _fewest(fitter, explained, insisted, 1) or held or _fewest(
        fitter, explained, insisted, 2)


def _beside_physics(fitter: Fitter, explained: Fit) -> list[NumberFinding]:
    """Return the numbers that are likelier off by themselves than as in the file, or moved by a
    refit around the effects, and that matter where those that stand are held."""
    finished = fitter.finished(explained)
    kept = _kept_by_data(fitter, finished)
    off = [name for name in kept if kept[name] < LARGER_PART]
    if not set(off) & set(_BY_NUMBER):
        return []
    groups = _groups(off)
    rises = _rises_beside_file(fitter, explained, groups)
    # What the fit leaves is the noise that a number has to stand out of, and what other formulas
    # of the effects miss could be put into it.
    least = max(CLEAN_EXCESS * max(1.0, reduced_chi_square(explained, fitter)),
                part_of_formula() * _whole(fitter, explained))
    matters = {name: rise for (name, *_), rise in zip(groups, rises, strict=True)
               if name in _BY_NUMBER and rise >= least}
    if fitter.load_shape and fitter.problem.model.friction.load_gain > 0.0:
        # What grows with another load than the file's tells nothing of the gain that it has.
        matters.pop('load_gain', None)
    found = [replace(finding, moved=1.0 - kept[name]) for name, rise in matters.items()
             if (finding := _named(fitter, finished, name, rise)) is not None]
    return sorted(_wrong_by_themselves(fitter, finished, found),
                  key=lambda finding: -finding.matters)


def _wrong_by_themselves(fitter: Fitter, explained: Fit, found: list[NumberFinding],
                         ) -> list[NumberFinding]:
    """Return those of the numbers that are likelier off by themselves than moved by a refit around
    the effects."""
    by_itself = refit_of_file(fitter, fitter.finished(explained)).by_itself
    likely = [replace(finding, moved=finding.moved * by_itself[name])
              for finding in found for name in numbers_of([finding.effect])]
    return [finding for finding in likely if finding.moved >= LARGER_PART]


def refit_of_file(fitter: Fitter, finished: Fit) -> Refit:
    """Return what is known of a refit of the file around the effects of a finished fit: how likely
    there was one, and that each number that is off is so by itself (moved_by_refit.py)."""
    return refit_of(fitter, finished, {
        name: probability for name, probability in _kept_by_data(fitter, finished).items()
        if name not in LOAD_NUMBERS})


def _kept_by_data(fitter: Fitter, finished: Fit) -> dict[str, float]:
    """Return how likely the data leave each number as it is in the file."""
    return {number.name: float(probability) for number, probability in zip(
        finished.hypothesis.numbers, standing(fitter, finished), strict=True)
        if number.name not in (*SHAPE_NUMBERS, *NAMELESS)}


def _groups(names: Sequence[str]) -> list[tuple[str, ...]]:
    """Return the numbers, those of the load curve as one."""
    load = tuple(name for name in names if name in LOAD_NUMBERS)
    return [(name,) for name in names if name not in LOAD_NUMBERS] + [load] * bool(load)


def still_wrong(fitter: Fitter, explained: Fit, before: Mapping[tuple[str, str], float],
                ) -> list[NumberFinding]:
    """Return the numbers that were told to be wrong, and still are beside what was found since.

    A number that stood for what was found goes back to what the file has; one that is off stays
    off by the larger part of what it was.

    Args:
        fitter: of `explained`.
        explained: with what was found since.
        before: effect that says that a number is wrong, and number → the value that it had.
    """
    stay = []
    for number, file, value in zip(
            explained.hypothesis.numbers, explained.hypothesis.start_of_numbers(),
            explained.vector, strict=False):
        told = before.get((_BY_NUMBER.get(number.name, ''), number.name))
        if told is None:
            continue
        moved = (np.log(told) if number.logarithmic else told) - file
        if (value - file) * np.sign(moved) > LARGER_PART * abs(moved):
            stay.append(number.name)
    rises = _rises(fitter, explained, stay)
    found = [finding for name in stay if rises[name] >= CLEAN_EXCESS
             and (finding := _named(fitter, explained, name, rises[name])) is not None]
    return _wrong_by_themselves(fitter, explained, found) if explained.hypothesis.variants \
        else found


def _or_another(fitter: Fitter, held: NumberFinding, insisted: list[NumberFinding],
                ) -> NumberFinding:
    """Return the one number that a refit seems to have held, with the others that it may have held
    instead, by the odds of each."""
    odds = {finding.effect: fitter.held_odds.get((name,), 0.0) for finding in insisted
            for name, effect in _BY_NUMBER.items() if effect == finding.effect}
    total = sum(odds.values())
    if total <= 0.0:
        return held
    # What no motion tells from it has its part of what it is likely itself.
    own = odds.get(held.effect, 0.0) / total
    return replace(held, rivals=(*((effect, part * own) for effect, part in held.rivals), *(
        (effect, value / total) for effect, value in odds.items()
        if effect != held.effect and value > LEAST_PROBABILITY * total)))


def file_stands(fitter: Fitter, explained: Fit) -> bool:
    """Whether numbers of the file are as they should be, given the effects in `explained`: no
    refit has moved them to make up for what is missing."""
    kept = _kept(fitter, explained)
    return any(probability >= LARGER_PART for probability in kept.values())


def _kept(fitter: Fitter, explained: Fit) -> dict[str, float]:
    """Return how likely each number is as in the file; nothing where the file was refitted, which
    moves all of them."""
    variants = explained.hypothesis.variants
    if was_refitted(fitter) or (fitter.held and not _load_curve_is_told(fitter, explained)):
        return {}
    # Beside effects a file that was refitted around them is to be told from one that stands, which
    # a free load curve, or what has no name, leaves nothing of.
    if variants and (fitter.load_shape or explained.hypothesis.has_unnamed or refitted(fitter)):
        return {}
    kept = _kept_by_data(fitter, fitter.finished(explained))
    off = sum(probability < LARGER_PART for probability in kept.values())
    # A refit that held the load curve has moved most of the others.
    return kept if not fitter.held or off <= LARGER_PART * len(kept) else {}


def _moved(fitter: Fitter, explained: Fit) -> list[NumberFinding]:
    """Return the numbers that are likelier off than as in the file and matter, where others of the
    file stand; none where its load curve is off as well and most of the others are: that is the
    question then."""
    kept = _kept(fitter, explained)
    off = [name for name in kept if kept[name] < LARGER_PART]
    if not 0 < len(off) < len(kept):
        return []
    groups = _groups(off)
    rises = dict(zip(groups, _rises_beside_file(fitter, explained, groups), strict=True))
    # What the fit leaves is the noise that a number has to stand out of.
    least = CLEAN_EXCESS * max(1.0, reduced_chi_square(explained, fitter))
    curve = sum(rises.pop(group) for group in groups if group[0] in LOAD_NUMBERS)
    if curve >= max(least, part_of_formula() * _whole(fitter, explained)):
        others = [name for name in kept if name not in LOAD_NUMBERS]
        if len(rises) > LARGER_PART * len(others):
            return []
    matters = {name: rise for (name,), rise in rises.items() if rise >= least}
    if not set(matters) <= set(_BY_NUMBER):
        return []
    found = {name: _named(fitter, explained, name, rise) for name, rise in matters.items()}
    if any(finding is None for finding in found.values()):
        return []
    return sorted((replace(finding, moved=1.0 - kept[name])
                   for name, finding in found.items() if finding is not None),
                  key=lambda finding: -finding.matters)


def _load_curve_is_told(fitter: Fitter, explained: Fit) -> bool:
    """Whether it is the load curve that a refit seems to have held, and what is wrong with it is
    told, one number of it or its form: a file that stands but for that looks alike."""
    return fitter.held == (LOAD,) and (fitter.load_shape is not None or any(
        variant.effect.id in BY_ONE_NUMBER for variant in explained.hypothesis.variants))


def number_place(numbers: tuple[NominalNumber, ...], effect: str) -> int:
    """Return the place of the nominal number that an effect says to be wrong."""
    return next(place for place, number in enumerate(numbers)
                if _BY_NUMBER.get(number.name) == effect)


def held_at_file(fitter: Fitter, explained: Fit, effect: str) -> Fit:
    """Return the fit with the number that an effect says to be wrong as the file has it, and all
    others refitted."""
    return fitter.refit(explained, tuple(
        number for number in explained.hypothesis.numbers
        if _BY_NUMBER.get(number.name) != effect))


def _insisted(fitter: Fitter, explained: Fit, told: bool = False) -> list[NumberFinding]:
    """Return the numbers that the data insist on changing, the weightiest first; with less that
    they matter where it is `told` otherwise which of them is wrong."""
    variants = explained.hypothesis.variants
    if any(variant.number_only for variant in variants) and not all(
            variant.number_only for variant in variants):
        return []
    rises = _rises(fitter, explained,
                   [number.name for number in explained.hypothesis.numbers
                    if number.name in _BY_NUMBER])
    # What other formulas of all that the file misses could put into a number.
    misses = part_of_formula() * _whole(fitter, explained)
    least = {name: max(CLEAN_EXCESS, 0.0 if told or name in fitter.held else misses)
             for name in rises}
    return [finding for name in sorted(rises, key=lambda name: -rises[name])
            if rises[name] >= least[name]
            and (finding := _named(fitter, explained, name, rises[name])) is not None]


def _rises(fitter: Fitter, explained: Fit, names: list[str]) -> dict[str, float]:
    """Return by how much the reduced chi-square rises with each of these numbers as the file has
    it, all others refitted."""
    floor = reduced_chi_square(explained, fitter)
    held = parallel_map(lambda name: held_at_file(fitter, explained, _BY_NUMBER[name]), names,
                        fitter.threads)
    return {name: reduced_chi_square(fit, fitter) - floor
            for name, fit in zip(names, held, strict=True)}


def _rises_beside_file(fitter: Fitter, explained: Fit, groups: Sequence[tuple[str, ...]],
                       ) -> list[float]:
    """Return by how much the reduced chi-square rises with each group of numbers as the file has
    it and the other groups refitted, where all the rest stands."""
    wrong = {name for group in groups for name in group}
    free = [wrong, *(wrong - set(group) for group in groups)]
    least, *levels = parallel_map(
        lambda chosen: reduced_chi_square(_refitted_only(fitter, explained, chosen), fitter),
        free, fitter.threads)
    return [level - least for level in levels]


def _named_only(fitter: Fitter, explained: Fit) -> Fit:
    """Return the fit without what has no name, which may have taken in what a number does."""
    for index in reversed(range(len(explained.hypothesis.variants))):
        if explained.hypothesis.variants[index].effect.unnamed:
            explained = fitter.without(explained, index)
    return explained


def _whole(fitter: Fitter, explained: Fit) -> float:
    """Return the excess that a number's part is measured by: the file's, but beside effects no
    more than theirs, since a file that was not refitted may miss by any amount."""
    file = excess(fitter.nominal(), fitter)
    return min(file, excess(fitter.base(), fitter)) if explained.hypothesis.variants else file


def _fewest(fitter: Fitter, explained: Fit, insisted: list[NumberFinding], most: int,
            ) -> list[NumberFinding]:
    """Return the fewest of the numbers beside which all others of the file stand, so many at
    most; none where there are more, or where the file was refitted around the effects."""
    if explained.hypothesis.variants and refitted(fitter):
        return []
    return next((list(wrong) for count in range(1, most + 1)
                 for wrong in itertools.combinations(insisted, count)
                 if _all_but(fitter, explained, *wrong)), [])


def refitted(fitter: Fitter) -> bool:
    """Whether the file was refitted around what is missing: it fits nearly as well as any numbers
    do without effects, or that drove a number of both down to none."""
    file, base = fitter.nominal(), fitter.base(tuple(
        number for number in fitter.numbers if number.name != CURVATURE))
    left, least = (reduced_chi_square(fit, fitter) - 1.0 for fit in (file, base))
    return (as_refitted(left, least) or as_refitted(mean_square(file), mean_square(base))
            or _driven_to_none(base))


def _driven_to_none(base: Fit) -> bool:
    return any(number.name in ('viscous_friction', 'coulomb') and start <= number.low >= value
               for number, start, value in zip(
                   base.hypothesis.numbers, base.hypothesis.start_of_numbers(), base.vector,
                   strict=True))


def was_refitted(fitter: Fitter) -> bool:
    """Whether the file was refitted around what an earlier round has settled."""
    return fitter.earlier is not None and refitted(fitter.earlier)


def _all_but(fitter: Fitter, explained: Fit, *wrong: NumberFinding) -> bool:
    """Whether the file's other numbers fit as they stand beside the effects, as far as the least
    of the wrong ones matters."""
    least = min(finding.matters for finding in wrong)
    only = _refitted_only(fitter, explained, numbers_of([finding.effect for finding in wrong]))
    return reduced_chi_square(only, fitter) < reduced_chi_square(explained, fitter) + max(
        CLEAN_EXCESS, part_of_formula() * least)


def with_these_refitted(fitter: Fitter, explained: Fit, effects: Collection[str]) -> Fit:
    """Return the finished fit with only the numbers refitted that these effects say to be wrong:
    all others are as in the file."""
    return fitter.finish(_refitted_only(fitter, explained, numbers_of(effects)))


def numbers_of(effects: Collection[str]) -> set[str]:
    """Return the nominal numbers that these effects say to be wrong."""
    return {name for name, effect in _BY_NUMBER.items() if effect in effects}


def _refitted_only(fitter: Fitter, explained: Fit, names: set[str]) -> Fit:
    """Return the fit with only these numbers of the file refitted, and how friction that grows
    with load bends; when samples were taken no file tells."""
    free = {DELAY, *names, *({CURVATURE} if 'load_gain' in names else ())}
    return fitter.refit(explained, tuple(
        number for number in explained.hypothesis.numbers if number.name in free))


def _named(fitter: Fitter, explained: Fit, name: str, rise: float) -> NumberFinding | None:
    place = next(place for place, number in enumerate(explained.hypothesis.numbers)
                 if number.name == name)
    value = float(explained.vector[place])
    if explained.hypothesis.numbers[place].logarithmic:
        value = float(np.exp(value))
    if name == 'load_gain' and value < fitter.problem.model.friction.load_gain:
        return None
    rivals: tuple[tuple[str, float], ...] = ()
    if name == BRAKES_LIKE and value > explained.hypothesis.start_of_numbers()[place]:
        # A command may be one of voltage: no motion tells drag from back-EMF, so either is as
        # likely as the other.
        rivals = tuple((effect, 0.5) for effect in (BACK_EMF,)
                       if fitter.problem.scene.commanded)
    return NumberFinding(_BY_NUMBER[name], explained, rise, rivals=rivals)
