# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A recording's motion, as sharp as encoder and sampling tell it: for predictions and last fits.

Motion starts and stops within milliseconds, and friction turns with it. The Gaussian that the
search uses (motion.py) has no overshoot, but smears such an edge; a Butterworth low-pass of the
same noise is sharper. Between the samples as they stand and the straight lines through the counts'
edges lies the truth: the former are late by half a count where motion is slow, the latter know
nothing of where between two counts the shaft came to rest. Where several counts pass from one
sample to the next a cubic spline joins the samples: straight lines attenuate a motion of frequency
f by sinc²(πfh) at a sampling interval h, and the torque of its acceleration with it (at 100 Hz an
eighth of what there is at 20 Hz).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from engb_core.recording import Recording
from engb_core.signals.count_edges import passing
from engb_core.signals.motion import bridged, Motion, motion_of
from engb_core.signals.motion_band import count_of

__all__ = ['MOST_OF_RATE', 'ORDER', 'band_limited', 'between_samples', 'sharp_motion_of']

Array = NDArray[np.float64]

# Corner [Hz] and order: friction turns within milliseconds.
BANDWIDTH, ORDER = 150.0, 3
# The corner can't be higher than this part of the sampling rate: of what is nearer to half of it
# the samples tell less than half.
MOST_OF_RATE = 0.45
# Periods of the corner after which the filter, there and back, has forgotten all but a millionth.
REMEMBERED = 5
# The grid's step [s], at which friction's turn is no matter of where the samples fall; coarser for
# more samples than these.
STEP = 2.5e-4
MOST_SAMPLES = 4_000_000
# Grid steps between two samples at most: the corner lies below the sampling rate, and nothing
# turns faster.
MOST_PARTS = 64


def sharp_motion_of(recording: Recording, step: float = STEP) -> Motion:
    """Bring a recording onto an even grid of about `step` [s], no coarser than its own, and derive
    its motion; position and effort are low-passed alike, there and back."""
    recorded = motion_of(recording, BANDWIDTH)
    bandwidth = min(BANDWIDTH, MOST_OF_RATE / recording.interval)
    count = recording.time[-1] / recording.interval
    most = min(MOST_PARTS, max(1, MOST_SAMPLES // count))
    parts = int(np.clip(round(recording.interval / step), 1, most))
    step = recording.interval / parts
    time = np.arange(int(np.floor(recording.time[-1] / step + 1e-6)) + 1, dtype=np.float64) * step
    fast = passing(recording, count_of(recording.position))
    grid = replace(recorded, time=time,
                   moving=np.interp(time, recording.time, fast.astype(float)))
    raw = bridged(time, between_samples(recording, grid, recording.position), recording)
    low_pass = butter(ORDER, bandwidth, fs=1.0 / step, output='sos')
    period = int(np.ceil(1.0 / bandwidth / step))
    # Differences at the very ends would be half the acceleration: they are taken beyond them.
    beyond = sosfiltfilt(low_pass, _going_on(raw, period), padlen=0)
    speed = np.gradient(beyond, step)
    inside = slice(REMEMBERED * period, REMEMBERED * period + raw.size)
    position, velocity, acceleration = (
        values[inside].copy() for values in (beyond, speed, np.gradient(speed, step)))
    effort = _low_passed(_curved(recording, time, recording.effort), bandwidth, step)

    def on_grid(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.interp(time, recorded.time, values)

    return replace(
        grid, step=step, position=position, velocity=velocity,
        acceleration=acceleration, effort=effort,
        disc_speed=on_grid(recorded.disc_speed), disc_angle=on_grid(recorded.disc_angle),
        pad_temperature=on_grid(recorded.pad_temperature),
        known=on_grid(recorded.known.astype(float)) > 0.5,
        fresh=None if recorded.fresh is None else on_grid(recorded.fresh.astype(float)) > 0.5,
        bandwidth=bandwidth, sharp=True)


def between_samples(recording: Recording, motion: Motion, values: Array) -> Array:
    """Return what values (n,) at a recording's samples, the position's or what its sensor adds to
    them, are on a sharp motion's grid (m,)."""
    assert motion.moving is not None, 'a sharp motion knows where samples are joined by a spline'
    time = motion.time
    straight = np.interp(time, recording.time, values)
    joined: Array = 0.5 * (motion.edges.joined(time, values) + straight)
    joined += motion.moving * (_curved(recording, time, values) - joined)
    return joined


def _curved(recording: Recording, time: Array, values: Array) -> Array:
    within = np.clip(time, recording.time[0], recording.time[-1])
    curved: Array = CubicSpline(recording.time, values)(within)
    return curved


def band_limited(values: Array, step: float, interval: float) -> Array:
    """Return values (n,) every `step` [s] without what samples every `interval` [s] cannot show,
    with no lag: friction turns within less."""
    return values if step >= interval else _low_passed(values, MOST_OF_RATE / interval, step)


def _low_passed(values: Array, corner: float, step: float) -> Array:
    """Return values (n,) every `step` [s] low-passed at a corner [Hz], there and back."""
    period = int(np.ceil(1.0 / corner / step))
    passed: Array = sosfiltfilt(butter(ORDER, corner, fs=1.0 / step, output='sos'), values,
                                padlen=min(values.size - 1, REMEMBERED * period))
    return passed


def _going_on(position: Array, period: int) -> Array:
    """Return positions (n,) with `REMEMBERED` periods of so many samples more at both ends: a
    recording may end in the midst of a motion, which goes on with the speed and the acceleration
    of its last period; without that it would seem to need no torque, or an endless one."""
    count, beyond = min(max(period, 3), position.size), np.arange(1, REMEMBERED * period + 1)
    if position.size < 3:
        return np.pad(position, beyond.size, mode='edge')
    inside = np.arange(count)
    before, after = (
        end[0] + np.polynomial.Polynomial.fit(inside, end - end[0], 2)(-beyond)
        for end in (position[:count], position[::-1][:count]))
    return np.concatenate([before[::-1], position, after])
