# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the noise of the position puts into the effort that a motion seems to need.

An encoder tells position in counts, with a noise of its own, and at times that are a little off
the stamps (sampling_noise.py). All of that goes through the very chain that derives velocity and
acceleration (motion.py), and through friction, which turns with the sign of the velocity; both
sides of the comparison pass the same low-pass afterwards, so that this part of the residual is no
mismatch but noise. Nothing about it is white, Gaussian or the same everywhere: it
is found by a parametric bootstrap (Efron and Tibshirani, An Introduction to the Bootstrap, 1993,
section 6.5) of the whole chain, with the phase of the counts, the noise and the times drawn at
random.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import Physics
from engb_core.recording import Recording
from engb_core.signals.count_edges import passing, shown_in_counts
from engb_core.signals.filtering import Comparison
from engb_core.signals.gaussian import filtered, gaussian_kernel
from engb_core.signals.motion import Motion, with_position
from engb_core.signals.motion_band import count_of
from engb_core.signals.sampling_noise import SamplingNoise

__all__ = ['position_noise']

Array = NDArray[np.float64]

# Draws of the counts' phase: the deviation that they give is itself sure to a sixth,
# 1/sqrt(2·DRAWS), which is less than how well the noise of effort is known.
DRAWS = 20
SEED = 20


def position_noise(recording: Recording, motion: Motion, comparison: Comparison,
                   physics: Physics, noise: SamplingNoise) -> Array:
    """Return the standard deviation (m,) [N·m] that counts, noise and times of the position put
    into the filtered effort of the motion.

    Args:
        recording: as it was taken; its stamps are kept, gaps and jitter with them.
        motion: derived from it; stands for the true one.
        comparison: the filter through which both sides pass.
        physics: of the model, which says how motion becomes effort.
        noise: of the recording.
    """
    count = count_of(recording.position)
    if count <= 0.0 and noise.white == noise.jitter == 0.0:
        return np.zeros(comparison.grid.size)
    # Counts are a part of the noise that is seen.
    own = np.sqrt(max(noise.white ** 2 - count ** 2 / 12.0, 0.0))
    fast = passing(recording)
    smooth = gaussian_kernel(motion.bandwidth, recording.interval)
    random = np.random.default_rng(SEED)

    def derived(position: Array) -> Motion:
        return with_position(motion, recording, position)

    def needed(moved: Motion) -> Array:
        return comparison(effort_of_motion(moved.samples(), moved.step, physics))

    wrong = np.empty((DRAWS, comparison.grid.size))
    true, of_motion = motion, needed(motion)
    for draw in range(DRAWS):
        # The smoothed motion has what the smoothing lets through of the roundings that it was
        # made of, and would be rounded like them again: where several counts pass from sample to
        # sample, where they are independent of one another (Bennett, Bell System Technical
        # Journal 27 (1948) 446), the true motion is as far from it.
        apart = fast * filtered(random.uniform(-0.5, 0.5, fast.size) * count, smooth)
        taken = recording.time + noise.jitter * random.standard_normal(recording.time.size)
        place = np.interp(taken, motion.time, true.position) + apart
        shown = place + own * random.standard_normal(taken.size)
        phase = random.uniform()
        counted = shown_in_counts(shown, count, phase) if count > 0.0 else shown
        moved = derived(counted)
        there = needed(derived(np.interp(recording.time, motion.time, true.position) + apart)) \
            if apart.any() else of_motion if true is motion else needed(true)
        wrong[draw] = needed(moved) - there
        # The true motion is not known better than this: at which speeds counts and samples beat,
        # so that roundings last, is another one in each draw.
        true = _apart(motion, moved, true)
    spread: Array = wrong.std(axis=0, ddof=1)
    return spread


def _apart(motion: Motion, moved: Motion, true: Motion) -> Motion:
    """Return a motion that is off by as much as one that was `moved` is from the true one."""
    return replace(motion, **{
        name: getattr(motion, name) + getattr(moved, name) - getattr(true, name)
        for name in ('position', 'velocity', 'acceleration')})
