# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""In which blocks of time there is a mismatch at all: a test of each, and the part that is false.

A mismatch that effects, wrong numbers or a law make up is tested by its projection onto what was
measured beside it (a matched filter), one that is a residual by its sum of squares. The colour of
what the fit leaves says how many independent values a block has, its size how strong the noise is.
Of the blocks so many are taken that the expected part of those without a mismatch is no more than
`FALSE_PART` (Benjamini and Hochberg, Journal of the Royal Statistical Society B 57 (1995) 289),
which holds for independent blocks and such as depend positively on each other, as neighbours do
(Benjamini and Yekutieli, Annals of Statistics 29 (2001) 1165).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, false_discovery_control, norm

from engb_core.diagnose.constants import CLEAN_EXCESS, FALSE_PART
from engb_core.diagnose.uncertainty import autocorrelation, inflation

__all__ = ['mismatched', 'rejected']

Array = NDArray[np.float64]

# Periods of the comparison's corner in a block: neighbours share next to nothing of their noise.
PERIODS = 4.0


def rejected(chances: Array, false_part: float = FALSE_PART) -> NDArray[np.bool_]:
    """Return which hypotheses (k,) are rejected, by Benjamini and Hochberg's procedure.

    Args:
        chances: (k,) p values [-].
        false_part: expected part of the rejected ones that are true, at most [-].
    """
    found: NDArray[np.bool_] = false_discovery_control(chances) <= false_part
    return found


def mismatched(times: Sequence[Array], mismatch: Sequence[Array], left: Sequence[Array],
               sigma: Sequence[Array], bandwidth: float, residual: bool = False,
               ) -> list[NDArray[np.bool_]]:
    """Return which filtered values lie in blocks that hold a mismatch, (m,) for each recording.

    Args:
        times: (m,) of the values [s].
        mismatch: (m,) [N·m].
        left: (m,) what was measured minus the fit with the mismatch in it [N·m].
        sigma: (m,) noise [N·m].
        bandwidth: of the comparison [Hz].
        residual: the mismatch is a residual, with the noise in it, and no part of the fit.
    """
    noise = np.concatenate([values / scale for values, scale in zip(left, sigma, strict=True)])
    variance = max(inflation(noise), 1.0)
    # A sum of squares has the colour of squares; how well the level of noise is known, beside it.
    colour = autocorrelation(noise)
    independent = 1.0 / (1.0 + 2.0 * float(np.sum(colour ** 2)))
    blocks, chances = [], []
    for time, said, rest, scale in zip(times, mismatch, left, sigma, strict=True):
        _, block = np.unique(np.floor(time * bandwidth / PERIODS), return_inverse=True)
        said, rest = said / scale, rest / scale
        energy = np.bincount(block, said ** 2)
        if residual:
            count = np.bincount(block) * independent
            chance = chi2.sf(energy * independent / (1.0 + CLEAN_EXCESS), count)
        else:
            along = np.bincount(block, (rest + said) * said)
            size = np.sqrt(energy * variance)
            chance = np.where(size > 0.0, norm.sf(along / np.where(size > 0.0, size, 1.0)), 1.0)
        blocks.append(block)
        chances.append(chance)
    found = np.split(rejected(np.concatenate(chances)),
                     np.cumsum([chance.size for chance in chances])[:-1])
    return [hold[block] for hold, block in zip(found, blocks, strict=True)]
