# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A recording's motion on an even grid: position without counts, velocity, acceleration.

Position comes in encoder counts. Between two counts nothing is known, at the instant of a count
the position is known well; so the counts' edges are joined by straight lines and smoothed by a
Gaussian whose derivatives give velocity and acceleration. Where several counts pass from one
sample to the next, the samples themselves are joined: the middle between two of them is a mean,
which attenuates a motion of frequency f by cos²(πfh) at a sampling interval h, and nothing
attenuates the measured effort likewise. No lag: it is all done offline, and model and measurement
pass the same filter afterwards (filtering.py).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline
from scipy.ndimage import maximum_filter1d

from engb_core.physics.command_law import Commanded, commanded_of
from engb_core.physics.sample_table import sample_table
from engb_core.recording import Recording
from engb_core.repeated_stamps import GAP_STEPS
from engb_core.signals.count_edges import CountEdges, edges_of, quantum_of
from engb_core.signals.gaussian import filtered, gaussian_kernel, moving_on
from engb_core.signals.held_effort import EFFORT_TAKEN
from engb_core.signals.side_signals import side_signal

__all__ = ['CUT_OFF', 'MOST_OF_RATE', 'MOTION_BANDWIDTH', 'Motion', 'bridged', 'motion_of',
           'with_position']

Array = NDArray[np.float64]
_Number = TypeVar('_Number', np.float64, np.bool_)

# Corner of the smoothing of position and effort [Hz]; below it the motion is believed.
MOTION_BANDWIDTH = 60.0
# Step of the grid in periods of that corner.
STEP_OF_PERIOD = 0.12
# The corner can't be higher than this part of the sampling rate.
MOST_OF_RATE = 0.2
# The speed beside a gap is taken over [s].
BESIDE_GAP = 0.01
# The side signal that is more than none where the recorded effort is only a bound of the true one.
CUT_OFF = 'effort_cut_off'


@dataclass(frozen=True)
class Motion:
    """One run on an even grid, all arrays (n,).

    Position, its derivatives and effort have passed the same Gaussian of `bandwidth` [Hz].
    `known` is False where the grid falls into a gap of the recording, where effort that was cut
    off reaches, and at its very ends; `recorded_step` [s] is the recording's own; `sharp` tells a
    motion of sharp_motion.py; `edges` are the counts' that the position was taken from;
    `commanded` says what effort was computed from, where it is a command; `fresh` where
    effort had just been taken, if that is done more slowly than the position (held_effort.py);
    `moving` how far a sharp motion's samples are joined by a spline, 0 to 1.
    """

    name: str
    step: float
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    effort: Array
    disc_speed: Array
    disc_angle: Array
    pad_temperature: Array
    known: NDArray[np.bool_]
    quantum: float
    has_disc: bool
    has_temperature: bool
    bandwidth: float
    recorded_step: float
    edges: CountEdges
    sharp: bool = False
    commanded: Commanded | None = None
    fresh: NDArray[np.bool_] | None = None
    moving: Array | None = None

    @property
    def speed(self) -> float:
        """How fast the motion goes, but for a few outliers [rad/s]."""
        return float(np.quantile(np.abs(self.velocity), 0.995))

    def samples(self) -> Array:
        """Return what the torque balance reads, (n, SAMPLE_SIZE), as effects/base.py orders it;
        the columns of its stages are still empty."""
        return sample_table(self.step, self.time, self.position, self.velocity,
                            self.acceleration, self.disc_speed, self.disc_angle,
                            self.pad_temperature)

    def decimated(self, factor: int) -> Motion:
        """Return the motion at every so manieth of its samples."""
        def every(values: NDArray[_Number]) -> NDArray[_Number]:
            return values[::factor].copy()

        return replace(
            self, step=factor * self.step, time=every(self.time), position=every(self.position),
            velocity=every(self.velocity), acceleration=every(self.acceleration),
            effort=every(self.effort), disc_speed=every(self.disc_speed),
            disc_angle=every(self.disc_angle), pad_temperature=every(self.pad_temperature),
            known=every(self.known), fresh=None if self.fresh is None else every(self.fresh),
            moving=None if self.moving is None else every(self.moving))


def motion_of(recording: Recording, bandwidth: float = MOTION_BANDWIDTH) -> Motion:
    """Bring a recording onto an even grid and derive its motion, smoothed at `bandwidth` [Hz]."""
    fine = recording.interval
    bandwidth = min(bandwidth, MOST_OF_RATE / fine)
    stride = max(1, int(round(STEP_OF_PERIOD / bandwidth / fine)))
    step = stride * fine
    full = _even(recording)
    edges = edges_of(recording)
    position, velocity, acceleration = _smoothed(recording, edges, full, bandwidth, stride)
    time = full[::stride]
    disc = side_signal(recording, 'disc_speed')
    temperature = side_signal(recording, 'pad_temperature')
    disc_speed = np.zeros(time.size) if disc is None else np.interp(time, recording.time, disc)
    return Motion(
        name=recording.name, step=step, time=time, position=position, velocity=velocity,
        acceleration=acceleration,
        effort=filtered(np.interp(full, recording.time, recording.effort),
                        gaussian_kernel(bandwidth, fine))[::stride].copy(),
        disc_speed=disc_speed,
        disc_angle=cumulative_trapezoid(disc_speed, dx=step, initial=0.0),
        pad_temperature=(np.full(time.size, 20.0) if temperature is None
                         else np.interp(time, recording.time, temperature)),
        known=_known(recording, time, fine, gaussian_kernel(bandwidth, fine).size // 2),
        quantum=quantum_of(recording.position),
        has_disc=disc is not None and bool(np.any(np.abs(disc) > 1e-6)),
        has_temperature=temperature is not None, bandwidth=bandwidth, recorded_step=fine,
        edges=edges, fresh=_fresh(recording, time, fine),
        commanded=commanded_of(recording, full, gaussian_kernel(bandwidth, fine)))


def with_position(motion: Motion, recording: Recording, position: Array) -> Motion:
    """Return a motion as `motion_of` derives it (no sharp one) where other positions in the same
    counts were recorded. What effort was computed from, where it is a command, stays as it is.

    Args:
        motion: of the recording.
        recording: whose stamps and other signals stay.
        position: (k,) what was recorded instead [rad].
    """
    fine = recording.interval
    stride = max(1, round(motion.step / fine))
    other = replace(recording, position=position)
    edges = edges_of(other)
    smooth, velocity, acceleration = _smoothed(other, edges, _even(recording), motion.bandwidth,
                                               stride)
    return replace(motion, position=smooth, velocity=velocity, acceleration=acceleration,
                   edges=edges)


def _even(recording: Recording) -> Array:
    """Return the even grid (n,) [s] that a recording is brought onto."""
    fine = recording.interval
    return np.arange(int(np.floor(recording.time[-1] / fine + 1e-6)) + 1, dtype=np.float64) * fine


def _smoothed(recording: Recording, edges: CountEdges, full: Array, bandwidth: float, stride: int,
              ) -> tuple[Array, Array, Array]:
    """Return position, velocity and acceleration (n,) at every so manieth place of an even grid.
    """
    fine = recording.interval
    raw = bridged(full, edges.joined(full, recording.position), recording)
    position, velocity, acceleration = (
        moving_on(raw, gaussian_kernel(bandwidth, fine, derivative))[::stride].copy()
        for derivative in range(3))
    return position, velocity, acceleration


def bridged(time: Array, position: Array, recording: Recording) -> Array:
    """Return `position` (n,) with every gap of the recording crossed by a cubic that keeps the
    speed on both sides: a straight line would have the motor jerk at both ends."""
    bridged = position.copy()
    edges = np.flatnonzero(np.diff(recording.time) > GAP_STEPS * recording.interval)
    for edge in edges:
        # The counts' edges beside the gap already lie half a sample away from it.
        begin = recording.time[edge] - recording.interval
        end = recording.time[edge + 1] + recording.interval
        before = np.interp(begin - BESIDE_GAP * np.arange(3), time, position)
        after = np.interp(end + BESIDE_GAP * np.arange(3), time, position)
        inside = slice(np.searchsorted(time, begin, 'right'), np.searchsorted(time, end))
        bridge = CubicHermiteSpline([begin, end], [before[0], after[0]],
                                    [-_slope(before), _slope(after)])
        bridged[inside] = bridge(time[inside])
    return bridged


def _slope(position: Array) -> float:
    """Return the speed at the first of three positions, each `BESIDE_GAP` after the other."""
    return float(2.0 * position[1] - 1.5 * position[0] - 0.5 * position[2]) / BESIDE_GAP


def _known(recording: Recording, time: Array, step: float, reach: int) -> NDArray[np.bool_]:
    # A recording may begin or end in the midst of a motion, where smoothing looks beyond its end.
    inside = (time > (reach - 1) * step) & (time < recording.time[-1] - (reach - 1) * step)
    following = np.clip(np.searchsorted(recording.time, time), 1, recording.time.size - 1)
    gap = recording.time[following] - recording.time[following - 1]
    # One lost sample is bridged by interpolation without harm.
    known: NDArray[np.bool_] = inside & ~maximum_filter1d(gap > 2.5 * step, 3)
    if CUT_OFF in recording.signals and time.size > 1:
        beyond = recording.signals[CUT_OFF].at(time) > 0.0
        spread = int(np.ceil(reach * step / (time[1] - time[0])))
        known &= ~maximum_filter1d(beyond, 2 * spread + 1)
    return known


def _fresh(recording: Recording, time: Array, step: float) -> NDArray[np.bool_] | None:
    if EFFORT_TAKEN not in recording.signals:
        return None
    taken = recording.signals[EFFORT_TAKEN].time
    after = np.clip(np.searchsorted(taken, time), 1, taken.size - 1)
    away = np.minimum(np.abs(time - taken[after]), np.abs(time - taken[after - 1]))
    return away <= 0.5 * step * (1.0 + 1e-6)
