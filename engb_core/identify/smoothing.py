# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A recording on an even clock, and one smoothing kernel for both sides of the equation.

Position comes as encoder counts; velocity and acceleration are its convolution with the first
and second derivative of a Gaussian. Torque, and every modelled torque, goes through the same
Gaussian: smoothing then changes both sides alike and manufactures no friction near a reversal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, signal

from engb_core.recording import Recording
from engb_core.signals.motion_band import count_of

__all__ = ['BANDWIDTH', 'Kernel', 'Motion', 'motions', 'moving_pieces']

Array = NDArray[np.float64]

# The brake works at 1 to 5 Hz (assumption 1 of the paper); above 20 Hz quantisation rules J·ω̇.
BANDWIDTH = 20.0

# A Gaussian of standard deviation s [s] has its -3 dB point at this over s [Hz].
HALF_POWER = np.sqrt(np.log(2.0)) / (2.0 * np.pi)

# The kernel is cut at so many standard deviations: its second derivative has fallen to 1e-4 of
# its peak there.
REACH = 5.0

# Of the velocity that friction's direction is taken from [s].
FRICTION_WIDTH = 1.5e-3

# A hole longer than this parts a recording in two [s].
LONGEST_HOLE = 0.25

# A piece shorter than this holds no motion worth a fit [s].
SHORTEST_PIECE = 0.3


@dataclass(frozen=True)
class Kernel:
    """A Gaussian of standard deviation `width` [s] on a clock of `interval` [s]."""

    width: float
    interval: float

    @classmethod
    def for_bandwidth(cls, bandwidth: float, interval: float) -> Kernel:
        """Return the kernel with its -3 dB point at `bandwidth` [Hz], or lower where the clock
        is too coarse for it (a sampled Gaussian needs 1.5 samples)."""
        return cls(max(HALF_POWER / bandwidth, 1.5 * interval), interval)

    @property
    def half(self) -> int:
        """Samples from the kernel's centre to its end."""
        return int(np.ceil(REACH * self.width / self.interval))

    def taps(self, derivative: int = 0) -> Array:
        """Return the kernel (2·half + 1,), or its first or second derivative by time.

        The moments are set right, so that a constant, a ramp and a parabola come out exact.
        """
        time = np.arange(-self.half, self.half + 1) * self.interval
        ratio = time / self.width
        bell = np.exp(-0.5 * ratio**2)
        bell /= bell.sum()
        taps: Array = bell
        if derivative == 1:
            taps = -time * bell
            taps /= -(taps @ time)
        elif derivative != 0:
            taps = (ratio**2 - 1.0) * bell
            taps -= taps.sum() * bell
            taps = taps * 2.0 / (taps @ time**2)
        return taps

    def apply(self, values: Array, derivative: int = 0) -> Array:
        """Convolve `values` (n,), without phase shift; the ends are held."""
        padded = np.pad(values, self.half, mode='edge')
        smooth: Array = signal.fftconvolve(padded, self.taps(derivative), mode='valid')
        return smooth


@dataclass(frozen=True)
class Motion:
    """A contiguous piece of a recording on an even clock.

    Attributes:
        name: the recording's name.
        time: (n,) [s] on the recording's clock.
        position: (n,) [rad] as measured (encoder counts and all).
        effort: (n,) [N·m].
        known: (n,) False where the samples are interpolated over a hole.
        interval: [s].
        bandwidth: [Hz] of the smoothing kernel.
        count: of the encoder [rad]; 0 where it has none.
    """

    name: str
    time: Array
    position: Array
    effort: Array
    known: NDArray[np.bool_]
    interval: float
    bandwidth: float = BANDWIDTH
    count: float = 0.0

    @cached_property
    def kernel(self) -> Kernel:
        """The kernel that both sides of the equation pass."""
        return Kernel.for_bandwidth(self.bandwidth, self.interval)

    @cached_property
    def velocity(self) -> Array:
        """(n,) [rad/s] hardly smoothed: what friction's form near standstill is fed.

        A smoothed velocity would smear friction's reversal beyond what the kernel smears, and
        that error has the shape of J·ω̇. The counts' edges, joined by straight lines, leave no
        jumps to smooth away.
        """
        kernel = Kernel(max(FRICTION_WIDTH, 1.5 * self.interval), self.interval)
        return kernel.apply(self._without_counts(), 1)

    def _without_counts(self) -> Array:
        change = np.flatnonzero(np.diff(self.position))
        if change.size < 2:
            return self.position
        # At the instant of a count the encoder is right; between two counts nothing is known.
        return np.interp(self.time, 0.5 * (self.time[change] + self.time[change + 1]),
                         0.5 * (self.position[change] + self.position[change + 1]))

    @cached_property
    def smooth_velocity(self) -> Array:
        """(n,) [rad/s] through the whole kernel."""
        return self.kernel.apply(self.position, 1)

    @cached_property
    def smooth_acceleration(self) -> Array:
        """(n,) [rad/s²] through the whole kernel."""
        return self.kernel.apply(self.position, 2)

    @cached_property
    def top_speed(self) -> float:
        """The speed that one sample in a hundred exceeds [rad/s]."""
        return float(np.percentile(np.abs(self.smooth_velocity), 99.0))

    @cached_property
    def standing(self) -> NDArray[np.bool_]:
        """(n,) True inside stops; a passage through zero at a reversal is no stop."""
        slow = np.abs(self.smooth_velocity) < 0.01 * self.top_speed
        shortest = round(0.1 / self.interval)
        inside = ndimage.binary_opening(slow, np.ones(max(3, shortest)))
        # The model's friction has a low-speed form, so a stop's edges stay in the fit.
        standing: NDArray[np.bool_] = ndimage.binary_erosion(
            inside, np.ones(2 * self.kernel.half + 3))
        return standing

    @cached_property
    def rows(self) -> NDArray[np.int64]:
        """(m,) samples that a fit uses: two kernel widths apart, clear of holes, stops, ends."""
        good = self.known & ~self.standing
        reach, stride = self.kernel.half, self.stride
        clear = ndimage.minimum_filter1d(good.astype(np.uint8), 2 * reach + 1, mode='constant')
        # upfirdn's output j is centred on sample j·stride - reach.
        every = np.arange(-(-2 * reach // stride) * stride - reach, self.time.size - reach, stride)
        rows: NDArray[np.int64] = every[clear[every] > 0]
        return rows

    @property
    def stride(self) -> int:
        """Samples between two rows that follow each other."""
        return max(1, round(2.0 * self.kernel.width / self.interval))

    def smooth(self, columns: Array) -> Array:
        """Pass `columns` (n,) or (k, n), modelled at every sample, through the kernel at `rows`.

        Returns (m,) or (k, m).
        """
        values = signal.upfirdn(self._taps, columns, 1, self.stride, axis=-1)
        chosen: Array = values[..., (self.rows + self.kernel.half) // self.stride]
        return chosen

    @cached_property
    def _taps(self) -> Array:
        return self.kernel.taps()

    @cached_property
    def powers(self) -> Array:
        """(7, n) position^0 … position^6 [rad^k], for polynomials that are evaluated often."""
        return np.cumprod(np.vstack([np.ones_like(self.position)]
                                    + [self.position] * 6), axis=0, dtype=np.float64)


def motions(recording: Recording, bandwidth: float = BANDWIDTH) -> list[Motion]:
    """Return the recording's contiguous pieces on an even clock, `bandwidth` [Hz]."""
    interval = recording.interval
    step = np.diff(recording.time)
    cuts = np.flatnonzero(step > max(LONGEST_HOLE, 10.0 * interval)) + 1
    count = count_of(recording.position)
    pieces = []
    for part in np.split(np.arange(recording.time.size), cuts):
        time = recording.time[part]
        if time.size < 20 or time[-1] - time[0] < max(SHORTEST_PIECE, 30 * interval):
            continue
        clock = time[0] + np.arange(int((time[-1] - time[0]) / interval + 1e-6) + 1) * interval
        known = np.ones(clock.size, bool)
        for hole in np.flatnonzero(np.diff(time) > 4.5 * interval):
            known &= (clock <= time[hole]) | (clock >= time[hole + 1])
        pieces.append(Motion(
            recording.name, clock, np.interp(clock, time, recording.position[part]),
            np.interp(clock, time, recording.effort[part]), known, interval, bandwidth, count))
    return pieces


def moving_pieces(recordings: Sequence[Recording], bandwidth: float = BANDWIDTH) -> list[Motion]:
    """Return the recordings' pieces in motion, those that a fit can use, at `bandwidth` [Hz]."""
    return [piece for recording in recordings for piece in motions(recording, bandwidth)
            if piece.rows.size and piece.top_speed > 0.0]
