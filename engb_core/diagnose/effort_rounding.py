# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the rounding of a coarsely recorded effort puts into the filtered effort.

A drive tells its current in counts. Noise of half a count and more makes the error of the
rounding white, uniform and a part of the noise that is seen (Widrow and Kollár, Quantization
Noise, 2008, chapter 19). With less of it the error follows the effort: a shaft that stands shows
none of it, and one that moves slowly shows it in the very band in which models are compared.
How large it is there is found as that of the position is (position_noise.py): by a parametric
bootstrap with the phase of the counts and the noise drawn at random.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.recording import Recording
from engb_core.signals.count_edges import shown_in_counts
from engb_core.signals.filtering import Comparison
from engb_core.signals.gaussian import filtered, gaussian_kernel
from engb_core.signals.motion import Motion
from engb_core.signals.motion_band import count_of

__all__ = ['rounding_noise']

Array = NDArray[np.float64]

# Draws of the counts' phase, as many as for those of the position; of these, and of the steps in
# which the noise before the rounding is found, so many, to a hundredth of a count.
DRAWS, PHASES, HALVINGS = 20, 8, 7
SEED = 20
# Noise [counts] from which on the error of rounding is a part of what is seen.
DITHERED = 0.5


def rounding_noise(recording: Recording, motion: Motion, comparison: Comparison) -> Array:
    """Return the standard deviation (m,) [N·m] that noise and rounding of a coarse effort put into
    the filtered effort; 0 where it is fine beside its noise.

    Args:
        recording: as it was taken.
        motion: derived from it; its smoothed effort stands for the true one.
        comparison: the filter through which both sides pass.
    """
    none = np.zeros(comparison.grid.size)
    count = count_of(recording.effort)
    seen = _fastest(recording.effort)
    if count <= 0.0 or seen > (DITHERED * count) ** 2 or motion.commanded is not None:
        return none
    random = np.random.default_rng(SEED)
    smooth = np.interp(recording.time, motion.time, motion.effort)
    own = _before_rounding(smooth, count, seen, random)
    passed = gaussian_kernel(motion.bandwidth, recording.interval)
    drawn = np.empty((DRAWS, comparison.grid.size))
    for draw in range(DRAWS):
        taken = smooth + own * random.standard_normal(smooth.size)
        off = filtered(shown_in_counts(taken, count, random.uniform()) - smooth, passed)
        drawn[draw] = comparison(np.interp(motion.time, recording.time, off))
    spread: Array = drawn.std(axis=0, ddof=1)
    return spread


def _fastest(effort: Array) -> float:
    """Return the variance [N²·m²] of a white noise with the mean square of the effort's third
    differences."""
    return float(np.mean(np.diff(effort, n=3) ** 2)) / 20.0


def _before_rounding(smooth: Array, count: float, seen: float, random: np.random.Generator,
                     ) -> float:
    """Return the deviation [N·m] of the white noise with which the smoothed effort (n,), rounded,
    shows the third differences that are `seen`."""
    noise, phases = random.standard_normal(smooth.size), random.uniform(size=PHASES)

    def shown(deviation: float) -> float:
        return float(np.mean([_fastest(shown_in_counts(smooth + deviation * noise, count, phase))
                              for phase in phases]))

    low, high = 0.0, DITHERED * count
    if shown(low) >= seen:
        return low
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if shown(middle) < seen else (low, middle)
    return 0.5 * (low + high)
