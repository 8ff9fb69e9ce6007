# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which numbers a refit of the model file left as they were.

A file that was refitted on the recording is the minimum of what it misses over all numbers but
those that the refit held: if setting one more number free makes it fit better, and all the others
free do not, then that one was held, and the others moved to make up for it. So with two. How
likely that is follows from what the others take of all that is taken, the score (Lagrange
multiplier) statistic of the hypothesis that the file is that minimum (Rao, Proceedings of the
Cambridge Philosophical Society 44 (1948) 50), which noise does not limit but how the refit was
made: its formula and measure are others' (formula.py).
"""

from __future__ import annotations

from collections.abc import Mapping
import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from engb_core.diagnose.constants import CLEAN_EXCESS
from engb_core.diagnose.fitted import Fit
from engb_core.diagnose.formula import formula_odds, part_of_formula
from engb_core.diagnose.nominal import CURVATURE, DELAY, LOAD_NUMBERS

__all__ = ['LOAD', 'held_odds', 'likeliest']

LOAD = 'load curve'


def likeliest(odds: Mapping[tuple[str, ...], float]) -> tuple[str, ...]:
    """Return the names of the numbers that a refit of the model file likely held: the likeliest
    one, or, where none is likelier than not, the likeliest two; none where neither is."""
    for count in (1, 2):
        most, held = max(((value, held) for held, value in odds.items() if len(held) == count),
                         default=(0.0, ()))
        if most >= 1.0:
            return held
    return ()


def held_odds(base: Fit, file: Fit, sigma: NDArray[np.float64]) -> dict[tuple[str, ...], float]:
    """Return the odds that a refit of the model file held one number or two (LOAD: all numbers of
    the load curve) and no others; nothing where the file misses too little to tell.

    The question is put in plain torque, as a refit would put it, and answered linearly. It can
    only be put to the file itself, without effects that were settled before, and to all that a
    refit would see: to the first round of fits (`Fitter.earlier`).

    Args:
        base: all nominal numbers refitted, without effects; finished.
        file: the model file as it stands.
        sigma: (m,) noise [N·m].
    """
    if base.jacobian is None or not base.hypothesis.numbers:
        return {}
    names = [number.name for number in base.hypothesis.numbers]
    groups = {name: {name} for name in names if name not in (DELAY, CURVATURE)
              and name not in LOAD_NUMBERS}
    if LOAD_NUMBERS & set(names):
        groups[LOAD] = set(LOAD_NUMBERS)
    whole = _left(base, file, [place for place, name in enumerate(names) if name == DELAY])
    free = [place for place, name in enumerate(names) if name != CURVATURE]
    taken = whole - _left(base, file, free)
    if taken <= CLEAN_EXCESS * float(sigma @ sigma):
        return {}
    # What the refit's own measure and formula may have left to the others of what it could not
    # take away.
    unsure = part_of_formula() * (whole - taken)

    def odds(*held: str) -> float:
        """Return the odds that the file is the minimum over all numbers but these."""
        without = {name for group in held for name in groups[group]}
        others = whole - _left(base, file, [place for place in free
                                            if names[place] not in without])
        return formula_odds(max(0.0, others + unsure) / taken)

    pairs = list(itertools.combinations(groups, 2))
    # One was held as often as two, and there are more pairs.
    prior = len(groups) / max(len(pairs), 1)
    return {**{(group,): odds(group) for group in groups},
            **{pair: prior * odds(*pair) for pair in pairs}}


def _left(base: Fit, file: Fit, free: list[int]) -> float:
    """Return the sum of squares that the file leaves when these numbers are refitted, within
    their bounds."""
    residual: NDArray[np.float64] = file.residual
    if not free or base.jacobian is None:
        return float(residual @ residual)
    columns = base.jacobian[:, free]
    norm = np.sqrt(np.einsum('ij,ij->j', columns, columns)) + 1e-30
    start = base.hypothesis.start_of_numbers()[free]
    low, high = (np.minimum(bound, 1e12)[free] for bound in base.hypothesis.bounds)
    room = 1e-9
    solution = lsq_linear(columns / norm, residual,
                          bounds=((low - start) * norm - room, (high - start) * norm + room)).x
    rest = residual - (columns / norm) @ solution
    return float(rest @ rest)
