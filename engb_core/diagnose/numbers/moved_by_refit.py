# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Was a number of the file wrong, or did a refit of the file move it?

A file that was refitted on a machine with physics that it does not have has moved numbers, to make
up for the physics. Whatever else such a refit held, along each number that it moved the file is at
a minimum of what it misses: the number is off by just what the missing effects put into it. One
that is wrong by itself is off by anything, and to be off by just that is a coincidence. Whether
the file was refitted at all is one question for all its numbers: those that stand, or are off by
something else, a refit must have held.
"""

from __future__ import annotations

from collections.abc import Mapping
import math

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from engb_core.diagnose.constants import FORMULA_MISSES, FORMULA_TAILS
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.uncertainty import vector_deviations

__all__ = ['wrong_by_itself', 'wrong_by_themselves']


def wrong_by_themselves(fitter: Fitter, explained: Fit, kept: Mapping[str, float],
                        ) -> dict[str, float]:
    """Return the probability that each number is off by itself, and was not moved by a refit of
    the file, given that it is off.

    Beforehand a file was refitted or not, and a refit held or moved each number, the one as likely
    as the other.

    Args:
        fitter, explained: as in `wrong_by_itself`.
        kept: number → probability that it is as in the file.
    """
    odds = {}
    for place, number in enumerate(explained.hypothesis.numbers):
        if number.name in kept:
            alone = wrong_by_itself(fitter, explained, place)
            odds[number.name] = (1.0 - alone) / max(alone, np.finfo(float).eps)
    refit = math.prod(0.5 * (kept[name] + (1.0 - kept[name]) * (1.0 + value))
                      for name, value in odds.items())
    whole = refit / (1.0 + refit)
    return {name: 1.0 - whole + whole / (1.0 + value) for name, value in odds.items()}


def wrong_by_itself(fitter: Fitter, explained: Fit, place: int) -> float:
    """Return the probability that a number is off by itself, and was not moved by a refit of the
    file, the one as likely beforehand as the other.

    Both say by how much it is off: by itself by anything of the order of the file's spread; by a
    refit, which looks for the minimum in plain torque and knows no delay between the samples of
    effort and position, by as much as the effects pull it. Its formula and measure are others', so
    that this is known to the part that formulas miss.

    Args:
        fitter: of the problem; what a refit saw is its first round of fits.
        explained: with effects that the file misses; finished.
        place: the number's, in `explained.hypothesis.numbers`.
    """
    number = explained.hypothesis.numbers[place]
    first = fitter.earlier or fitter
    base = first.base()
    names = [other.name for other in base.hypothesis.numbers]
    if number.name not in names:
        return 1.0
    own = names.index(number.name)
    # The derivative beside no effect: where flanks meet, one beside a gap tells nothing.
    column = first.columns(base, range(own, own + 1))[:, 0]
    file = first.evaluate(first.hypothesis((), ()), np.zeros(0))
    size = float(column @ column)
    start = float(explained.hypothesis.start_of_numbers()[place])
    moved = float(explained.vector[place]) - start
    if size == 0.0 or moved == 0.0:
        return 1.0
    alone = start + float(column @ file.residual) / size
    low = explained.hypothesis.bounds[0][place]
    if start <= low:
        # The file does not have it at all: no refit leaves it there, unless the bound held it.
        return 1.0 if alone > low else 0.5
    by_refit = start + moved - alone
    known = float(vector_deviations(explained, fitter)[place])
    scale = max(float(np.hypot(FORMULA_MISSES * by_refit, known)), np.finfo(float).tiny)
    refit = student.pdf(moved, FORMULA_TAILS, loc=by_refit, scale=scale)
    # What a file says is off by no more than it is, or as much as the file is believed.
    known_to = number.spread if number.logarithmic or start == 0.0 else min(
        number.spread, abs(start))
    wrong = norm.pdf(moved, scale=known_to)
    return float(wrong / (wrong + refit))
