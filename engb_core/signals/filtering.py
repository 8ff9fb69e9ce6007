# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The one low-pass through which measurement, model and hypotheses all pass.

Smoothing the velocity alone would manufacture friction that falls with speed near reversals;
here both sides of the torque balance pass the same filter. Samples at standstill carry no
weight: there friction takes whatever value holds the shaft, within its limits, so that no model
of motion can be held against it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from engb_core.physics.compiled import compiled
from engb_core.recording import Recording
from engb_core.signals.gaussian import filtered, gaussian_kernel
from engb_core.signals.motion import Motion
from engb_core.signals.order_periodogram import order_periodogram
from engb_core.signals.spread import robust_deviation

__all__ = ['ABOVE_BAND', 'Comparison', 'comparison_of', 'judgeable', 'low_passed_noise',
           'mostly_white', 'noise_in_motion', 'noise_of', 'noise_of_polled', 'slowest_speed',
           'turns_nowhere']

Array = NDArray[np.float64]

# Where what lies above the comparison's band begins, as a multiple of its corner.
ABOVE_BAND = 1.25
# A linear law of motion is told by so many values of its impulse response on either side, an
# eighth of a period of that corner apart, from so many independent values for each.
LAW_REACH, LAW_STEP, LEAST_VALUES = 5, 0.125, 3
# How long [s], and what part of the recording at most, nothing is judged of a shaft that was under
# way when the recording began: how its drivetrain was twisted nobody knows, and what that does
# dies out within a period or two of the slowest. A shaft that starts with the first sample has up
# to a tenth of its speed there, by smoothing.
UNDER_WAY, UNDER_WAY_PART, UNDER_WAY_SPEED = 0.5, 0.05, 0.1
# Part of the highest speed from which the shaft moves, and differences that tell a level.
MOVES, LEAST_DIFFERENCES = 0.05, 50


@dataclass(frozen=True)
class Comparison:
    """A mask-aware decimating low-pass: value k is the mean of moving samples around grid[k].

    Attributes:
        taps: (2r+1,) Gaussian.
        grid: (m,) indices into the motion's samples.
        weight: (n,) 1 where a sample may be judged, 0 at standstill and in gaps.
        scale: (m,) Σ taps·weight: how much of the window could be judged.
        noise_gain_whole: standard deviation of a filtered value, all of its window judgeable,
            for white noise of 1 in the recorded effort.
    """

    taps: Array
    grid: NDArray[np.int64]
    weight: Array
    scale: Array
    noise_gain_whole: float

    def __call__(self, values: Array) -> Array:
        """Return the filtered values (m,) of values (n,)."""
        return _decimate(values, self.weight, self.taps, self.grid, self.scale)

    def decimated(self, factor: int) -> Comparison:
        """Return the same filter for every so manieth sample; `factor` divides the grid."""
        first = self.taps.size // 2 % factor
        taps = self.taps[first::factor]
        made = replace(self, taps=taps / taps.sum(), grid=self.grid // factor,
                       weight=self.weight[::factor].copy(), scale=np.ones(self.grid.size))
        scale = made(np.ones(made.weight.size))
        # A window whose few judgeable samples are all skipped says nothing.
        return replace(made, scale=np.where(scale > 0.0, scale, np.inf))


@compiled
def _decimate(values: Array, weight: Array, taps: Array, grid: NDArray[np.int64],
              scale: Array) -> Array:
    reach = taps.size // 2
    out = np.empty(grid.size)
    for row in range(grid.size):
        centre = grid[row]
        first = max(0, centre - reach)
        last = min(values.size, centre + reach + 1)
        # Four sums side by side: one addition need not wait for the one before.
        first_sum = second_sum = third_sum = fourth_sum = 0.0
        tap = first - centre + reach
        whole = first + (last - first) // 4 * 4
        for index in range(first, whole, 4):
            first_sum += taps[tap] * weight[index] * values[index]
            second_sum += taps[tap + 1] * weight[index + 1] * values[index + 1]
            third_sum += taps[tap + 2] * weight[index + 2] * values[index + 2]
            fourth_sum += taps[tap + 3] * weight[index + 3] * values[index + 3]
            tap += 4
        for index in range(whole, last):
            first_sum += taps[tap] * weight[index] * values[index]
            tap += 1
        out[row] = (first_sum + second_sum + (third_sum + fourth_sum)) / scale[row]
    return out


def slowest_speed(motions: Sequence[Motion], saturation_velocity: float, speed: float) -> float:
    """Return the speed below which a shaft may well be standing [rad/s].

    Args:
        motions: their encoders count: between two counts nothing is known.
        saturation_velocity: of the model [rad/s]: it stands for a stick that the model does not
            describe.
        speed: the fastest of the motions [rad/s].
    """
    by_counts = max(motion.quantum for motion in motions) / 0.015
    by_model = 2.0 * saturation_velocity if 2.0 * saturation_velocity < 0.02 * speed else 0.0
    # A shaft that never moves has a speed of rounding errors only.
    return max(by_counts, by_model, 0.002 * speed, 1e-9)


def judgeable(motion: Motion, slowest: float, before_stop: float = 0.0) -> NDArray[np.bool_]:
    """Return where a model of motion can be held against the samples (n,): not at standstill,
    below `slowest` [rad/s], nor `before_stop` [s] earlier, nor in gaps, nor where a recording has
    just begun in the midst of a motion."""
    standing = (np.abs(motion.velocity) < slowest) | _under_way(motion)
    # The smoothing of position reaches a few milliseconds into the motion beside a stop.
    margin = 2 * int(round(0.004 / motion.step)) + 1
    bad: NDArray[np.bool_] = maximum_filter1d(standing | ~motion.known, margin)
    half = int(np.ceil(0.5 * before_stop / motion.step))
    if half == 0:
        return ~bad
    # A shaft may turn back by a count before it stands. Friction changes its sign there, and what
    # comes late of that must not be judged by one half.
    turns = np.diff(np.sign(motion.velocity), append=0.0) != 0.0
    turns &= _ahead(bad, half)
    return ~_ahead(maximum_filter1d(bad | turns, margin), half)


def _under_way(motion: Motion) -> NDArray[np.bool_]:
    """Return which samples (n,) come so soon after the begin of a recording in which the shaft
    moves already that what it remembers of before still acts."""
    moves = abs(motion.velocity[0]) > UNDER_WAY_SPEED * motion.speed
    found: NDArray[np.bool_] = moves & (
        motion.time < min(UNDER_WAY, UNDER_WAY_PART * motion.time[-1]))
    return found


def _ahead(bad: NDArray[np.bool_], half: int) -> NDArray[np.bool_]:
    """Return where one of the next 2·half + 1 samples is bad."""
    # A window whose origin is moved to its first sample looks ahead.
    found: NDArray[np.bool_] = maximum_filter1d(bad, 2 * half + 1, origin=-half)
    return found


def comparison_of(motion: Motion, bandwidth: float, slowest: float, before_stop: float = 0.0,
                  least_weight: float = 0.35) -> Comparison:
    """Make the filter for one motion.

    Args:
        motion: the run.
        bandwidth: −3 dB [Hz].
        slowest: speed below which the shaft counts as standing [rad/s].
        before_stop: how long before each stop nothing can be judged [s].
        least_weight: part of the window that must be judgeable for a value to be kept.
    """
    bandwidth = min(bandwidth, 0.2 / motion.step)
    taps = gaussian_kernel(bandwidth, motion.step)
    weight = judgeable(motion, slowest, before_stop).astype(float)
    if motion.fresh is not None:
        weight *= motion.fresh
    stride = max(1, int(round(1.0 / (2.5 * bandwidth) / motion.step)))
    grid = np.arange(0, motion.time.size, stride, dtype=np.int64)
    ones = np.ones(grid.size)
    scale = _decimate(np.ones_like(weight), weight, taps, grid, ones)
    # Where effort is polled, no window can be judged as a whole.
    most = 1.0 if motion.fresh is None else scale.max(initial=0.0)
    keep = scale > least_weight * most
    grid, scale = grid[keep], scale[keep]
    # The effort was white before it passed the motion's Gaussian: both together are one Gaussian.
    both = 1.0 / np.hypot(1.0 / bandwidth, 1.0 / motion.bandwidth)
    whole = np.sqrt(np.sum(gaussian_kernel(both, motion.recorded_step) ** 2))
    return Comparison(taps, grid, weight, scale, float(whole))


def noise_of(effort: Array, judged: NDArray[np.bool_] | None = None) -> float:
    """Return the standard deviation of the white part of the effort's noise [N·m], at those
    samples (n,) alone that are `judged`.

    From third differences, robustly: motion is smooth on the scale of three samples.
    """
    difference = np.diff(effort, n=3)
    if judged is not None:
        difference = difference[judged[1:-2]]
    return float(robust_deviation(difference) / np.sqrt(20.0))


def mostly_white(recording: Recording) -> bool:
    """Return whether most of the effort, while the shaft moves, changes from one sample to the
    next: white noise, or a current that is faster than the samples and was folded by them. What a
    shaft at rest shows says nothing of it."""
    speed = np.abs(np.gradient(recording.position, recording.time))
    moving = speed > MOVES * np.quantile(speed, 0.995)
    if np.count_nonzero(moving[1:-2]) < LEAST_DIFFERENCES:
        return False
    whole = float(np.var(recording.effort[moving]))
    return noise_of(recording.effort, moving) ** 2 > 0.5 * whole


def noise_in_motion(motion: Motion, comparison: Comparison, bandwidth: float, left: Array,
                    ) -> float:
    """Return the noise of the filtered effort [N·m] for a shaft that never stands still.

    A current sensor's noise is coloured, and differences of neighbouring samples see only its
    fastest part. Each of these holds the noise and something of what the model lacks, so that the
    least of them is told:

    - what lies just above the comparison's band, where motion leaves little beside, in a few
      places, its edges, which a median passes over; of the effort and of what the model leaves;
    - what lies there between the orders of the shaft, which are there all the time;
    - both, and what lies in the band itself, without what a linear law of acceleration, velocity
      and direction explains: a shaft that is shaken without a pause shows everywhere what the
      model lacks.

    Args:
        motion: the run.
        comparison: its filter.
        bandwidth: corner of the comparison [Hz].
        left: (n,) what the model leaves of the effort on the motion's grid [N·m].
    """
    moving = comparison.weight > 0.0
    corner = min(ABOVE_BAND * bandwidth, 0.2 / motion.step)
    below = gaussian_kernel(corner, motion.step)
    # White noise passes the motion's Gaussian, then what the second one leaves.
    first = gaussian_kernel(motion.bandwidth, motion.recorded_step)
    both = gaussian_kernel(1.0 / np.hypot(1.0 / motion.bandwidth, 1.0 / corner),
                           motion.recorded_step)
    taps = -both
    inset = (both.size - first.size) // 2
    taps[inset:inset + first.size] += first
    gain = float(np.sqrt(np.sum(taps ** 2)))
    told = []
    above = [signal - filtered(signal, below) for signal in (motion.effort, left)]
    laws = [values - filtered(values, below) for values in _shifted(motion, corner)]
    # Of a band-limited signal so many values are independent of one another.
    moves = motion.step * np.count_nonzero(moving)
    incoherent = _incoherent(above[1], laws, moving,
                             2.0 * (motion.bandwidth - corner) * moves)
    for signal in (*above, incoherent):
        if signal is None:
            continue
        told.append(robust_deviation(signal[moving]) / gain * comparison.noise_gain_whole)
        between = order_periodogram(motion, moving, corner, signal).noise()
        told += [] if between is None else [between * comparison.noise_gain_whole]
    whole = _incoherent_whole(motion, comparison, bandwidth, left,
                              2.0 * bandwidth * moves)
    return min(told if whole is None else [*told, whole])


def noise_of_polled(motion: Motion, comparison: Comparison, bandwidth: float, left: Array,
                    taken: Array) -> float:
    """Return the noise of an effort [N·m] that is taken more slowly than the position: of its
    third differences, which hold what changes from one value to the next as well, and of what no
    linear law of the motion explains, the lesser.

    Args:
        motion: the run.
        comparison: its filter, whose every window holds one value.
        bandwidth: corner of the comparison [Hz].
        left: (n,) what the model leaves of the effort on the motion's grid [N·m].
        taken: (k,) the efforts that were taken [N·m].
    """
    whole = _incoherent_whole(motion, comparison, bandwidth, left, np.inf)
    return min(noise_of(taken), np.inf if whole is None else whole)


def _incoherent_whole(motion: Motion, comparison: Comparison, bandwidth: float, left: Array,
                      independent: float) -> float | None:
    """Return the noise [N·m] that no linear law of the motion explains in the band itself, of at
    most so many independent values; None where there are too few to tell."""
    weight = np.sqrt(comparison.scale)
    laws = [comparison(values) * weight for values in _shifted(motion, bandwidth)]
    whole = _incoherent(comparison(left) * weight, laws, np.ones(weight.size, bool),
                        min(independent, weight.size))
    return None if whole is None else robust_deviation(whole)


def _shifted(motion: Motion, corner: float) -> list[Array]:
    """Return acceleration, velocity and direction (n,) some fractions of a period of a corner [Hz]
    earlier and later: the inputs of any linear law that remembers no longer than that."""
    apart = max(1, round(LAW_STEP / corner / motion.step))
    return [np.roll(values, shift * apart)
            for values in (motion.acceleration, motion.velocity, np.sign(motion.velocity))
            for shift in range(-LAW_REACH, LAW_REACH + 1)]


def _incoherent(values: Array, laws: list[Array], judged: NDArray[np.bool_], independent: float,
                ) -> Array | None:
    """Return what no linear law of the motion explains of values (n,), as large as the noise in
    it; None where there are too few to tell.

    The multiple coherence function tells that part frequency by frequency (Bendat and Piersol,
    Random Data, 4th edition, 2010, section 7.3); here the law's impulse response is found by least
    squares over time, since where the shaft stands nothing can be judged.

    Args:
        values: what is to be explained.
        laws: inputs (n,) each, one for each value of the impulse responses.
        judged: (n,) where the law is to hold.
        independent: how many values are independent of one another.
    """
    if independent < LEAST_VALUES * len(laws):
        return None
    inputs = np.stack(laws, axis=1)
    size = np.linalg.norm(inputs[judged], axis=0)
    inputs /= np.where(size > 0.0, size, 1.0)
    solution = np.linalg.lstsq(inputs[judged], values[judged], rcond=None)[0]
    # As many values as the law has are free no more.
    rest: Array = (values - inputs @ solution) * np.sqrt(independent / (independent - len(laws)))
    return rest


def low_passed_noise(motion: Motion, comparison: Comparison, stride: int,
                     rests: NDArray[np.bool_] | None = None) -> float | None:
    """Return the noise of the filtered effort while the shaft stands [N·m]; None: it never does.

    White noise is a guess; a current sensor's is coloured. At standstill effort is the loop's
    constant plus noise, and second differences over `stride` samples of the grid see the noise in
    the very band in which models are compared.

    Args:
        motion: the run.
        comparison: its filter.
        stride: of the differences [samples].
        rests: (n,) where the shaft is known to rest or to creep one way; None: wherever it may.
            Where it turns back, its friction does as well.
    """
    standing = (comparison.weight == 0.0) & motion.known & ~_under_way(motion)
    if rests is not None:
        standing &= rests
    standing = minimum_filter1d(standing, _seen(comparison, stride))
    whole = Comparison(comparison.taps, np.arange(motion.time.size, dtype=np.int64),
                       np.ones(motion.time.size), np.ones(motion.time.size),
                       1.0)
    filtered = whole(motion.effort)
    difference = (filtered[2 * stride:] - 2.0 * filtered[stride:-stride]
                  + filtered[:-2 * stride])[standing[stride:-stride]]
    if difference.size < 40 * stride:
        return None
    return float(robust_deviation(difference) / np.sqrt(6.0))


def turns_nowhere(recording: Recording, motion: Motion, comparison: Comparison, stride: int,
                  apart: float) -> NDArray[np.bool_]:
    """Return where (n,) the recorded position rests or creeps one way, but for so many radians,
    over all that one of `low_passed_noise`'s differences sees."""
    position = np.interp(motion.time, recording.time, recording.position)
    width = _seen(comparison, stride)
    ranges = maximum_filter1d(position, width) - minimum_filter1d(position, width)
    ends = np.pad(position, width // 2, mode='edge')
    on_the_whole = np.abs(ends[width - 1:] - ends[:position.size])
    found: NDArray[np.bool_] = ranges - on_the_whole <= apart
    return found


def _seen(comparison: Comparison, stride: int) -> int:
    return 2 * (comparison.taps.size // 2 + stride) + 1
