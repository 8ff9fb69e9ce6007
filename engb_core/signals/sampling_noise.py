# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How far the recorded positions lie off a smooth motion: noise of the encoder, and of the stamps.

A sample that is read a little earlier or later than its stamp says is off by the speed times that
time. Logs that a host polls (USB, a servo's bus, UDP) do so by 5 to 25 % of a sample, which at
speed is much more than a count. Each sample is held against the polynomial through its
neighbours; how the square of what is left grows with the square of the speed tells both:
noise² = white² + (jitter · speed)².
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.stats import chi2

from engb_core.recording import Recording

__all__ = ['sampling_noise', 'SamplingNoise']

Array = NDArray[np.float64]

# Neighbours on each side that the polynomial passes through: with five, what is left of a motion
# of a sixth of the sampling rate, as of a shaft that rings, is half a per cent of its amplitude.
REACH = 5
# Speeds are put into so many classes of as many samples each; fewer samples say nothing.
CLASSES, LEAST_SAMPLES = 10, 200
# Part of a class that is kept, the least of it: the rest are edges of the motion and glitches.
KEPT = 0.95


@dataclass(frozen=True)
class SamplingNoise:
    """Standard deviations of the position's own white noise, `white` [rad], and of the time at
    which a sample was taken about its stamp, `jitter` [s]."""

    white: float
    jitter: float

    def of(self, speed: Array) -> Array:
        """Return the standard deviation (n,) [rad] of positions told at a speed (n,) [rad/s]."""
        found: Array = np.hypot(self.white, self.jitter * speed)
        return found


def sampling_noise(recording: Recording) -> SamplingNoise:
    """Return how far a recording's positions lie off a smooth motion; none where it is too short
    to say."""
    squares, speed = _left(recording)
    if squares.size < LEAST_SAMPLES:
        return SamplingNoise(0.0, 0.0)
    # The mean of the least part of squares of Gaussian deviations, as a part of their variance.
    part = float(chi2.cdf(chi2.ppf(KEPT, 1), 3)) / KEPT
    means, speeds = [], []
    for rows in np.array_split(np.argsort(speed, kind='stable'), CLASSES):
        least = np.sort(squares[rows])[:int(np.ceil(KEPT * rows.size))]
        means.append(float(least.mean()) / part)
        speeds.append(float(np.mean(speed[rows] ** 2)))
    variance = np.array(means)
    if not variance.max() > 0.0:
        return SamplingNoise(0.0, 0.0)
    # Each class tells its variance to a part of it.
    weight = 1.0 / np.maximum(variance, 1e-12 * variance.max())
    design = np.stack([np.ones(CLASSES), np.array(speeds)], axis=1) * weight[:, None]
    size = np.linalg.norm(design, axis=0)
    size[size == 0.0] = 1.0
    solution, _ = nnls(design / size, variance * weight)
    white, jitter = np.sqrt(solution / size)
    return SamplingNoise(float(white), float(jitter))


def _left(recording: Recording) -> tuple[Array, Array]:
    """Return what each sample with all its neighbours leaves of the polynomial through these,
    squared and in units of a single sample's [rad²], and the speed there [rad/s]."""
    time, position = recording.time, recording.position
    inner = np.arange(REACH, time.size - REACH)
    if not inner.size:
        return np.zeros(0), np.zeros(0)
    whole = time[inner + REACH] - time[inner - REACH] < (2 * REACH + 1) * recording.interval
    inner = inner[whole]
    beside = [place for place in range(-REACH, REACH + 1) if place]
    apart = np.stack([time[inner + place] - time[inner] for place in beside], axis=1)
    # Lagrange's weights at the sample itself.
    weight = np.ones_like(apart)
    for own in range(len(beside)):
        for other in range(len(beside)):
            if other != own:
                weight[:, own] *= apart[:, other] / (apart[:, other] - apart[:, own])
    told = np.sum(weight * np.stack([position[inner + place] for place in beside], axis=1),
                  axis=1)
    squares = (position[inner] - told) ** 2 / (1.0 + np.sum(weight ** 2, axis=1))
    speed = np.abs(position[inner + 1] - position[inner - 1]) / (
        time[inner + 1] - time[inner - 1])
    # A shaft that stands shows its counts at one place.
    moves = speed > 0.0
    return squares[moves], speed[moves]
