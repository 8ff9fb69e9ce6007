# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Is the noise less than it is thought to be? What an effect predicts is none.

A level of noise that is told from a shaft at rest, or from what no law of its motion explains,
holds whatever else changes the effort there: a hand that pushes, a loop that hunts. It is too high
if an effect leaves much less than that of values that no fit has seen.
"""

from __future__ import annotations

from engb_core.diagnose.constants import LARGER_PART
from engb_core.diagnose.resonance.wide_band import RESONANCE
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square_of, unseen_rows
from engb_core.diagnose.search.every_effect import Search

__all__ = ['predicted_of_noise']


def predicted_of_noise(result: Search) -> float | None:
    """Return the part (0 to 1) of the noise's mean square that the best effects leave of values
    that no fit has seen; None where these take away less than the larger part of what refitted
    numbers leave, as they do of noise. A resonance smooths what counts make of the motion, and is
    not asked."""
    fitter = result.fitter
    rows = unseen_rows(fitter)
    left = reduced_chi_square_of(result.base, fitter, rows)
    least = min((reduced_chi_square_of(fit, fitter, rows) for fit in result.fits.values()
                 if RESONANCE not in fit.hypothesis.ids), default=left)
    return least if least < LARGER_PART * min(left, 1.0) else None
