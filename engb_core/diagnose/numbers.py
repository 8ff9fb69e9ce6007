# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Is a number wrong, or is physics missing? Which nominal numbers the data insist on changing.

Each number is held at the model file's value in turn while all others are refitted. A number
that is wrong can't be made up for by the others; one that merely moved along can. The load
curve's numbers are judged as a whole, in load_cause.py.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
import itertools

import numpy as np

from engb_core.diagnose.constants import (
    BESIDE,
    BESIDE_EFFECTS,
    BESIDE_LEAVES,
    HELD_LEFT,
    INSISTED,
    INSISTED_PART,
    NO_SIGN,
    NUMBERS_SUFFICE,
    REFITTED,
    SECOND,
    SHARPNESS,
    TWO_LEAVE,
    TWO_LEAVE_PART,
)
from engb_core.diagnose.fit import Fit, Fitter
from engb_core.diagnose.fitted import mean_square
from engb_core.diagnose.held_load_curve import BY_ONE_NUMBER
from engb_core.diagnose.held_parameters import LOAD
from engb_core.diagnose.nominal import CURVATURE, DELAY, NominalNumber, SHAPE_NUMBERS
from engb_core.diagnose.parallel_map import parallel_map
from engb_core.diagnose.reduced_chi_square import excess, reduced_chi_square
from engb_core.diagnose.spike_and_slab import average

__all__ = ['NumberFinding', 'file_stands', 'number_place', 'refitted', 'was_refitted',
           'wrong_numbers']

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
        value: that it has in the fit.
        kept: whether a refit of the file left just this one as it was.
        rivals: (effect, weight) of numbers of which one is wrong instead, if this one isn't.
        moved: probability that it is not as in the file.
    """

    effect: str
    fit: Fit
    matters: float
    value: float
    kept: bool = False
    rivals: tuple[tuple[str, float], ...] = ()
    moved: float = 1.0


def wrong_numbers(fitter: Fitter, explained: Fit) -> list[NumberFinding]:
    """Return the numbers that are wrong in the model file, given the effects in `explained`.

    Beside effects a number is named only if the file's other numbers fit as they stand, or if
    the file was refitted with this one number held: a file that was refitted around missing
    physics has all its numbers moved.
    """
    few = _moved(fitter, explained)
    if few:
        return few
    load_kept = bool(explained.hypothesis.variants) and fitter.held == (LOAD,)
    if load_kept and refitted(fitter):
        # All others moved to make up for the load curve, which has its own cause.
        return []
    insisted = _insisted(fitter, explained, load_kept)
    if load_kept:
        # The file was not refitted, and may stand but for one number.
        least = 0.0
        if reduced_chi_square(fitter.base(), fitter) - 1.0 < NUMBERS_SUFFICE:
            # Or it was: then the number may have moved a little along with the load curve.
            least = INSISTED_PART * (reduced_chi_square(fitter.nominal(), fitter) - 1.0)
        alone = next((finding for finding in insisted if finding.matters >= least
                      and _all_but(fitter, explained, finding)), None)
        return [] if alone is None else [alone]
    kept = [_BY_NUMBER[name] for name in fitter.held if name in _BY_NUMBER]
    if explained.hypothesis.variants and len(kept) > 1:
        # What is missing may have passed for one of them.
        kept = []
    insisted = [replace(finding, kept=finding.effect in kept) for finding in insisted]
    held = [finding for finding in insisted if finding.kept]
    unnamed = explained.hypothesis.has_unnamed
    if kept and not held and unnamed:
        held = [replace(finding, kept=True) for finding in _insisted(
            fitter, _named_only(fitter, explained)) if finding.effect in kept]
    if (explained.hypothesis.variants and held) or was_refitted(fitter):
        # A file that was refitted around what is settled by now has all other numbers moved.
        return held
    return (insisted and _fewest(fitter, explained, insisted)) or held


def file_stands(fitter: Fitter, explained: Fit) -> bool:
    """Whether numbers of the file are as they should be, given the effects in `explained`: no
    refit has moved them to make up for what is missing."""
    kept = _kept(fitter, explained)
    return any(probability >= 0.5 for probability in kept.values())


def _kept(fitter: Fitter, explained: Fit) -> dict[str, float]:
    """Return how likely each number is as in the file; nothing where the file was refitted, which
    moves all of them."""
    variants = explained.hypothesis.variants
    if was_refitted(fitter) or (fitter.held and not _by_one_number_of_load(fitter, explained)):
        return {}
    # Beside effects a file that was refitted around them is to be told from one that stands, which
    # a free load curve, or what has no name, leaves nothing of.
    if variants and (fitter.load_shape or explained.hypothesis.has_unnamed or refitted(fitter)):
        return {}
    finished = explained if explained.jacobian is not None else fitter.finish(explained)
    kept = {number.name: float(probability) for number, probability in zip(
        explained.hypothesis.numbers, average(fitter, finished).kept, strict=True)
        if number.name not in (*SHAPE_NUMBERS, *NAMELESS)}
    off = sum(probability < 0.5 for probability in kept.values())
    # A refit that held the load curve has moved most of the others.
    return kept if not fitter.held or 2 * off <= len(kept) else {}


def _moved(fitter: Fitter, explained: Fit) -> list[NumberFinding]:
    """Return the numbers that are likelier off than as in the file, where others of the file
    stand; none where the load curve is off: its load is the question."""
    kept = _kept(fitter, explained)
    off = [name for name in kept if kept[name] < 0.5]
    if not 0 < len(off) < len(kept) or not set(off) <= set(_BY_NUMBER):
        return []
    found = [_named(fitter, explained, name, rise)
             for name, rise in _rises_beside_file(fitter, explained, off).items()]
    if any(finding is None for finding in found):
        return []
    # What the fit leaves is the noise that a number has to stand out of.
    least = INSISTED * max(1.0, reduced_chi_square(explained, fitter))
    return sorted((replace(finding, moved=1.0 - kept[name])
                   for finding, name in zip(found, off, strict=True)
                   if finding is not None and finding.matters >= least),
                  key=lambda finding: -finding.matters)


def _by_one_number_of_load(fitter: Fitter, explained: Fit) -> bool:
    """Whether it is the load curve that a refit seems to have held, and one number of it that is
    told to be wrong: a file that stands but for that looks alike."""
    return fitter.held == (LOAD,) and any(
        variant.effect.id in BY_ONE_NUMBER for variant in explained.hypothesis.variants)


def number_place(numbers: tuple[NominalNumber, ...], effect: str) -> int:
    """Return the place of the nominal number that an effect says to be wrong."""
    return next(place for place, number in enumerate(numbers)
                if _BY_NUMBER.get(number.name) == effect)


def _insisted(fitter: Fitter, explained: Fit, told: bool = False) -> list[NumberFinding]:
    """Return the numbers that the data insist on changing, the weightiest first; with less that
    they matter where it is `told` otherwise which of them is wrong."""
    variants = explained.hypothesis.variants
    if any(variant.number_only for variant in variants) and not all(
            variant.number_only for variant in variants):
        return []
    floor = reduced_chi_square(explained, fitter)
    rises = _rises(fitter, explained,
                   [number.name for number in explained.hypothesis.numbers
                    if number.name in _BY_NUMBER])
    whole = _whole(fitter, explained)
    least = {name: max(INSISTED, min(INSISTED_PART * whole, HELD_LEFT * max(floor - 1.0, 0.0))
                       if told or name in fitter.held else INSISTED_PART * whole)
             for name in rises}
    return [finding for name in sorted(rises, key=lambda name: -rises[name])
            if rises[name] >= least[name]
            and (finding := _named(fitter, explained, name, rises[name])) is not None]


def _rises(fitter: Fitter, explained: Fit, names: list[str]) -> dict[str, float]:
    """Return by how much the reduced chi-square rises with each of these numbers as the file has
    it, all others refitted."""
    floor = reduced_chi_square(explained, fitter)
    held = parallel_map(lambda name: fitter.refit(explained, tuple(
        number for number in explained.hypothesis.numbers if number.name != name)),
        names, fitter.threads)
    return {name: reduced_chi_square(fit, fitter) - floor
            for name, fit in zip(names, held, strict=True)}


def _rises_beside_file(fitter: Fitter, explained: Fit, names: list[str]) -> dict[str, float]:
    """Return by how much the reduced chi-square rises with each of these numbers as the file has
    it and the others of them refitted, where all the rest stands."""
    wrong = set(names)
    free = [wrong, *(wrong - {name} for name in names)]
    least, *levels = parallel_map(
        lambda chosen: reduced_chi_square(_refitted_only(fitter, explained, chosen), fitter),
        free, fitter.threads)
    return {name: level - least for name, level in zip(names, levels, strict=True)}


def _named_only(fitter: Fitter, explained: Fit) -> Fit:
    """Return the fit without what has no name, which may have taken in what a number does."""
    for index in reversed(range(len(explained.hypothesis.variants))):
        if explained.hypothesis.variants[index].effect.unnamed:
            explained = fitter.without(explained, index)
    return explained


def _whole(fitter: Fitter, explained: Fit) -> float:
    """Return the excess that a number's part is measured by: the file's, but beside effects not
    much more than theirs, since a file that was not refitted may miss by any amount."""
    file = excess(fitter.nominal(), fitter)
    if not explained.hypothesis.variants:
        return file
    return min(file, BESIDE_EFFECTS * excess(fitter.base(), fitter))


def _fewest(fitter: Fitter, explained: Fit, insisted: list[NumberFinding],
            ) -> list[NumberFinding]:
    """Return the fewest of the numbers that make the file fit; beside effects one, or two beside
    which all others of the file stand."""
    floor = reduced_chi_square(explained, fitter)
    whole = excess(fitter.nominal(), fitter)
    if explained.hypothesis.variants:
        before = excess(fitter.base(), fitter)
        if refitted(fitter):
            return []
        alone = [finding.effect for finding in insisted
                 if _all_but(fitter, explained, finding)]
        apart = [finding for finding in insisted if finding.effect in alone
                 or not _moved_along(fitter, explained, finding)]
        least = SECOND * max((finding.matters for finding in apart), default=0.0)
        one = [finding for finding in apart
               if finding.matters >= least and (finding.matters > BESIDE * (whole - before)
                                                or finding.effect in alone)][:1]
        if one and one[0].effect in alone:
            return one
        return next((list(pair) for pair in itertools.combinations(insisted, 2)
                     if _all_but(fitter, explained, *pair)), one)
    for finding in insisted:
        if _with_only(fitter, explained, (finding,)) < floor + max(INSISTED,
                                                                   0.1 * finding.matters):
            return [finding]
    for pair in itertools.combinations(insisted, 2):
        leave = TWO_LEAVE if fitter.held else max(TWO_LEAVE, TWO_LEAVE_PART * pair[1].matters)
        if _with_only(fitter, explained, pair) < floor + leave:
            return list(pair)
    held = [finding for finding in insisted if finding.kept]
    if held:
        # The file's other numbers moved to make up for it.
        return held
    return _one_of(insisted)


def _one_of(insisted: list[NumberFinding]) -> list[NumberFinding]:
    """Return the number that the data insist on most, and those that it may as well be."""
    first = insisted[0]
    if first.matters < NO_SIGN:
        return []
    weights = {finding.effect: (finding.matters / first.matters) ** SHARPNESS
               for finding in insisted if finding.matters >= SECOND * first.matters}
    total = sum(weights.values())
    return [replace(first, rivals=tuple((effect, weight / total) for effect, weight
                                        in weights.items() if effect != first.effect))]


def refitted(fitter: Fitter) -> bool:
    """Whether the file was refitted around what is missing: it fits nearly as well as any numbers
    do without effects, or that drove a number of both down to none."""
    file, base = fitter.nominal(), fitter.base(tuple(
        number for number in fitter.numbers if number.name != CURVATURE))
    left, least = (reduced_chi_square(fit, fitter) - 1.0 for fit in (file, base))
    return (left < REFITTED * max(least, 0.0)
            or mean_square(file) < REFITTED * mean_square(base) or _driven_to_none(base))


def _driven_to_none(base: Fit) -> bool:
    return any(number.name in ('viscous_friction', 'coulomb') and start <= number.low >= value
               for number, start, value in zip(
                   base.hypothesis.numbers, base.hypothesis.start_of_numbers(), base.vector,
                   strict=True))


def was_refitted(fitter: Fitter) -> bool:
    """Whether the file was refitted around what an earlier round has settled."""
    return fitter.earlier is not None and refitted(fitter.earlier)


def _moved_along(fitter: Fitter, explained: Fit, finding: NumberFinding) -> bool:
    """Whether the file has the number nearer to what a refit without the effects gives than to
    what it is with them: then it was refitted around them."""
    place = number_place(explained.hypothesis.numbers, finding.effect)
    name = explained.hypothesis.numbers[place].name
    base = fitter.base()
    moved = next(value for number, value in zip(base.hypothesis.numbers, base.vector, strict=True)
                 if number.name == name)
    file = explained.hypothesis.start_of_numbers()[place]
    if name == 'load_gain' and file <= explained.hypothesis.bounds[0][place]:
        # A file without load-dependent friction is none that was refitted so.
        return False
    return bool(abs(file - moved) < 0.5 * abs(file - explained.vector[place]))


def _all_but(fitter: Fitter, explained: Fit, *wrong: NumberFinding) -> bool:
    """Whether the file's other numbers fit as they stand beside the effects, as far as the least
    of the wrong ones matters."""
    least = min(finding.matters for finding in wrong)
    return _with_only(fitter, explained, wrong) < reduced_chi_square(explained, fitter) + max(
        INSISTED, BESIDE_LEAVES * least)


def _with_only(fitter: Fitter, explained: Fit, wrong: tuple[NumberFinding, ...]) -> float:
    """Return the reduced chi-square of the file with only these numbers refitted."""
    names = {number for number, effect in _BY_NUMBER.items()
             if effect in [finding.effect for finding in wrong]}
    return reduced_chi_square(_refitted_only(fitter, explained, names), fitter)


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
    return NumberFinding(_BY_NUMBER[name], explained, rise, value, rivals=rivals)
