# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which stretches of a recording are kept out of every fit, to be judged on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ['kept_out']

# Share of a recording's duration that is kept out of every fit, in so many stretches.
KEPT_OUT = 0.2
STRETCHES = 4
# Where in its part of the recording each lies follows the golden ratio: at equal distances they
# would hold the same part of a motion that is repeated, and of recordings that are alike.
GOLDEN = 0.5 * (5.0 ** 0.5 - 1.0)


def kept_out(time: NDArray[np.float64], duration: float, place: int) -> NDArray[np.bool_]:
    """Return whether each time (m,) [s] is kept out of every fit: one stretch in each of equal
    parts of the recording's duration.

    Args:
        time: (m,) [s] since the first sample.
        duration: of the recording [s].
        place: of the recording among those that may be fitted, from 0.
    """
    length = duration / STRETCHES
    part = np.minimum((time / length).astype(int), STRETCHES - 1)
    begin = (1.0 - KEPT_OUT) * (GOLDEN * (1 + part + STRETCHES * place) % 1.0)
    within = time / length - part
    return (begin <= within) & (within < begin + KEPT_OUT)
