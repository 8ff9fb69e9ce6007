# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a formula that is only nearly right leaves: the priors of it, as probability and level.

Another formulation of the same physics, or a refit by another measure, leaves a part of the torque
that it makes up. How large that part is beforehand is one prior, whatever is asked: whether a name
is right at all, whether a further effect is more than what the formulas of the others miss, and
whether what numbers of the file do not make up for is what a refit left.
"""

from __future__ import annotations

from functools import cache
import math

from scipy.optimize import brentq
from scipy.stats import t as student

from engb_core.diagnose.constants import (
    FORMULA_ERROR,
    FORMULA_MISSES,
    FORMULA_TAILS,
    KNOWN_ODDS,
    SURE,
)

__all__ = ['as_refitted', 'chance_part', 'formula_error', 'formula_odds', 'further_odds',
           'little_apart', 'no_more', 'part_of_formula', 'probability', 'something_known',
           'sure_part']


def part_of_formula() -> float:
    """Return the part of the mean square that the right physics in another formulation usually
    leaves."""
    return FORMULA_MISSES ** 2


def formula_error(before: float) -> float:
    """Return the excess that even the right formulas leave, in units of the noise's mean square,
    where numbers alone leave `before`."""
    return FORMULA_ERROR + little_apart() * before


def something_known(left: float, own: float | None = None) -> float:
    """Return the probability that the named effects are physics of the library at all.

    By Bayes' rule from the root of what they leave. If they are all that is missing, it is what
    their formulas miss: of Student's distribution about none. If something that nobody wrote down
    is missing beside them, any part may be left; what their own formulas miss then shows in what
    they leave of their `own`, where that can be told. If they are not physics of the library, but
    were the best makeshift for something else, any part may be left of both: each is as likely as
    the next. How many they are says nothing of that: each has shown itself in what is lost
    without it.

    Args:
        left: part of the excess that they leave on what no fit has seen (`part_left`).
        own: part that one leaves of what shows over its own coordinate (`form_left`); None: that
            cannot be told.
    """
    return probability(_known_odds(left, own))


def further_odds(rest: float, left: float, own: float | None = None) -> float:
    """Return the odds that a further effect is physics, and no makeshift for what the formulas of
    the others miss.

    Physics that is missing beside them may leave any part of the whole, of which its effect leaves
    what its formula misses. What their formulas miss is a part of the whole by the prior of that,
    of which an effect that happens to suit it leaves any part.

    Args:
        rest: part (0 to 1) of the whole excess that the others leave without it.
        left: part (0 to 1) of that which is left with it.
        own: as in `something_known`.
    """
    return _known_odds(left, own) / _missed(rest)


def _known_odds(left: float, own: float | None) -> float:
    """Return the odds of `something_known`. That something unwritten is missing beside is as
    likely as it is of any cause."""
    unwritten = probability(1.0 / KNOWN_ODDS)
    beside = KNOWN_ODDS if own is None else formula_odds(own)
    return (1.0 - unwritten) * formula_odds(left) + unwritten * beside


def formula_odds(left: float) -> float:
    """Return the odds that a part of the mean square is left by the formula of what the library
    holds, against any part by chance."""
    return KNOWN_ODDS * _missed(left)


@cache
def sure_part() -> float:
    """Return the part of a mean square up to which what leaves it is surely what it says it is:
    `something_known` has the probability `SURE` there."""
    part: float = brentq(lambda part: something_known(part) - SURE, 0.0, 1.0)
    return part


def little_apart() -> float:
    """Return the part of a mean square by which nothing is told apart any more: even the right
    formulas leave as much."""
    return FORMULA_ERROR ** 2


def no_more(left: float, other: float) -> bool:
    """Whether a mean square is no more than another one, as far as any are told apart."""
    return left <= (1.0 + little_apart()) * other


@cache
def chance_part() -> float:
    """Return the part of a mean square that is as likely to be missed by the right formulas as to
    be any: `formula_odds` are even there. What one model takes away of what another leaves is by
    chance up to it, and physics beyond; a file that leaves no more above the least that any
    numbers leave was refitted, by another measure or formula."""
    part: float = brentq(lambda part: formula_odds(part) - 1.0, 0.0, 1.0)
    return part


def as_refitted(left: float, least: float) -> bool:
    """Whether a file that leaves `left` leaves as little as a refit does, where any numbers leave
    `least`."""
    return (1.0 - chance_part()) * left < max(least, 0.0)


def probability(odds: float) -> float:
    """Return the probability of what has these odds."""
    return odds / (1.0 + odds)


def _missed(part: float) -> float:
    """Return the density that a formula leaves this part of the mean square, over its root."""
    return 2.0 * float(student.pdf(math.sqrt(part), FORMULA_TAILS, scale=FORMULA_MISSES))
