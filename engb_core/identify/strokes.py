# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Finds the clamp and release strokes in a recorded motion (steps 0 and 1 of the paper)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError
from engb_core.identify.smoothing import Motion

__all__ = ['Stroke', 'find_strokes', 'turning_points']

Array = NDArray[np.float64]

# A stroke covers at least this part of the recorded range; less is a correction, not a stroke.
LEAST_TRAVEL = 0.15

# Fewer moving samples than this in a stroke can't be resampled (M < N in equation 32).
LEAST_SAMPLES = 20


@dataclass(frozen=True)
class Stroke:
    """One clamp stroke with the release that follows it, stops left out.

    `clamp` and `release` are indices into the `Motion`'s samples, in order of time;
    `motion` is the number of the piece they belong to.
    """

    motion: int
    clamp: NDArray[np.int64]
    release: NDArray[np.int64]


def turning_points(position: Array, excursion: float) -> list[int]:
    """Return the indices of the extremes between which `position` (n,) moves by `excursion` or
    more, first and last sample's side included, alternating low and high."""
    points = [0]
    rising = 0
    low = high = 0
    for index in range(1, position.size):
        value = position[index]
        if value > position[high]:
            high = index
        if value < position[low]:
            low = index
        if rising >= 0 and position[high] - value >= excursion:
            points.append(high)
            rising, low, high = -1, index, index
        elif rising <= 0 and value - position[low] >= excursion:
            points.append(low)
            rising, low, high = 1, index, index
    points.append(high if rising >= 0 else low)
    return [point for number, point in enumerate(points) if number == 0
            or point != points[number - 1]]


def find_strokes(pieces: Sequence[Motion]) -> list[Stroke]:
    """Return all pairs of a clamp stroke and the release after it.

    Raises:
        InputError: none found; the message says what the recording holds instead.
    """
    travel = max((float(np.ptp(piece.position)) for piece in pieces), default=0.0)
    strokes = []
    for number, piece in enumerate(pieces):
        if np.ptp(piece.position) < LEAST_TRAVEL * travel or travel == 0.0:
            continue
        strokes.extend(_pairs(number, piece, LEAST_TRAVEL * travel))
    if not strokes:
        raise InputError(
            f'no clamp and release strokes found: the position covers {travel:.3g} rad without '
            'a rise that is followed by a return; record at least one stroke from low to high '
            'and back, or make a first model of any motion: engb model RECORDING --out '
            'model.yaml')
    return strokes


def _pairs(number: int, piece: Motion, excursion: float) -> list[Stroke]:
    smooth = piece.kernel.apply(piece.position)
    # One point in ten kernel widths would do; every stride-th keeps the search cheap.
    coarse = smooth[::piece.stride]
    points = [min(point * piece.stride, smooth.size - 1)
              for point in turning_points(coarse, excursion)]
    speed = piece.smooth_velocity
    slowest = 0.01 * piece.top_speed
    pairs = []
    for low, high, end in zip(points, points[1:], points[2:], strict=False):
        if smooth[high] < smooth[low]:
            continue
        clamp = np.arange(low, high)
        release = np.arange(high, end + 1)
        clamp = clamp[(speed[clamp] > slowest) & piece.known[clamp]]
        release = release[(speed[release] < -slowest) & piece.known[release]]
        if min(clamp.size, release.size) < LEAST_SAMPLES:
            continue
        common = (min(smooth[clamp].max(), smooth[release].max())
                  - max(smooth[clamp].min(), smooth[release].min()))
        if common >= excursion:
            pairs.append(Stroke(number, clamp, release))
    return pairs
