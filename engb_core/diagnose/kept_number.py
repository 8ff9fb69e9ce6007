"""Which number a refit of the model file left as it was.

A file that was refitted on the recording fits as well as it can with the numbers that the refit
held. If setting one more number free makes it fit clearly better, and all the others free do not,
then that one was held, and the others moved to make up for it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from engb_core.diagnose.nominal import DELAY, LOAD_NUMBERS

if TYPE_CHECKING:
    from engb_core.diagnose.fit import Fit, Fitter

__all__ = ['LOAD', 'kept_number']

LOAD = 'load curve'
# Part of the file's mean square that the free numbers take away, at least.
TAKEN = 0.15
# What all others may take away of that without the number that was held.
OTHERS_TAKE = 0.2


def kept_number(fitter: Fitter) -> str | None:
    """Return the name of the number that a refit of the model file held (LOAD: all numbers of
    the load curve), or None where no single one explains how the file misses.

    The question is put in plain torque, as a refit would put it, and answered linearly. It can
    only be put to the file itself, without effects that were settled before, and to all that a
    refit would see: to the first round of fits (`Fitter.earlier`).
    """
    base = fitter.finish(fitter.base())
    file = fitter.nominal()
    if base.jacobian is None or not base.hypothesis.numbers:
        return None
    names = [number.name for number in base.hypothesis.numbers]
    groups = {name: {name} for name in names if name != DELAY and name not in LOAD_NUMBERS}
    if LOAD_NUMBERS & set(names):
        groups[LOAD] = set(LOAD_NUMBERS)
    whole = _left(base, file, [place for place, name in enumerate(names) if name == DELAY])
    taken = whole - _left(base, file, list(range(len(names))))
    if taken < TAKEN * whole:
        return None
    without = {group: whole - _left(base, file, [place for place, name in enumerate(names)
                                                 if name not in members])
               for group, members in groups.items()}
    first = min(without, key=lambda group: without[group])
    return first if without[first] <= OTHERS_TAKE * taken else None


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
