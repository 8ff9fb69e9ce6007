# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which numbers a refit of the model file left as they were.

A file that was refitted on the recording fits as well as it can with the numbers that the refit
held. If setting one more number free makes it fit clearly better, and all the others free do not,
then that one was held, and the others moved to make up for it. So with two.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from engb_core.diagnose.constants import (
    ALL_BUT,
    AT_MOST,
    NEXT_TO_NOTHING,
    OF_NEXT,
    OTHERS_TAKE,
    TAKEN_LEAST,
    TAKEN_MUCH,
    TAKEN_PART,
    WITHOUT_TWO,
)
from engb_core.diagnose.fitted import Fit
from engb_core.diagnose.nominal import CURVATURE, DELAY, LOAD_NUMBERS

__all__ = ['LOAD', 'held_parameters']

LOAD = 'load curve'


def held_parameters(base: Fit, file: Fit, sigma: NDArray[np.float64]) -> tuple[str, ...]:
    """Return the names of the numbers that a refit of the model file held, one or two (LOAD: all
    numbers of the load curve); none where that does not explain how the file misses.

    The question is put in plain torque, as a refit would put it, and answered linearly. It can
    only be put to the file itself, without effects that were settled before, and to all that a
    refit would see: to the first round of fits (`Fitter.earlier`).

    Args:
        base: all nominal numbers refitted, without effects; finished.
        file: the model file as it stands.
        sigma: (m,) noise [N·m].
    """
    if base.jacobian is None or not base.hypothesis.numbers:
        return ()
    names = [number.name for number in base.hypothesis.numbers]
    groups = {name: {name} for name in names if name not in (DELAY, CURVATURE)
              and name not in LOAD_NUMBERS}
    if LOAD_NUMBERS & set(names):
        groups[LOAD] = set(LOAD_NUMBERS)
    whole = _left(base, file, [place for place, name in enumerate(names) if name == DELAY])
    free = [place for place, name in enumerate(names) if name != CURVATURE]
    taken = whole - _left(base, file, free)
    noise = float(sigma @ sigma)
    much = taken >= TAKEN_PART * whole
    if taken < (TAKEN_LEAST if much else TAKEN_MUCH) * noise:
        return ()

    def others_take(*held: str) -> float:
        """Return the part of what is taken that is taken without these."""
        without = {name for group in held for name in groups[group]}
        return (whole - _left(base, file, [place for place in free
                                           if names[place] not in without])) / taken

    parts = sorted((others_take(group), group) for group in groups)
    least, first = parts[0]
    if least <= (OTHERS_TAKE if much else NEXT_TO_NOTHING):
        return (first,)
    if len(parts) == 1:
        return ()
    both, pair = min((others_take(*two), two) for two in itertools.combinations(groups, 2))
    numbers_alone = taken >= (1.0 - ALL_BUT) * whole
    if both <= (WITHOUT_TWO if numbers_alone else NEXT_TO_NOTHING):
        return pair
    return (first,) if much and least <= min(AT_MOST, OF_NEXT * parts[1][0]) else ()


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
