# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Motion as it truly was where a law says by how much the measured position is off.

The error is taken at the very samples at which the sensor made it, and carried through the same
smoothing as the recorded position: what it does to velocity and acceleration is then exact, also
where it repeats faster than the smoothing lets through or than the recording samples.
"""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from engb_core.effects.base import (
    ACCELERATION,
    POSITION,
    TIME,
    TIME_STEP,
    TORQUE,
    VELOCITY,
)
from engb_core.physics.compiled import kernel
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import Physics
from engb_core.physics.walk import Walk
from engb_core.recording import Recording
from engb_core.signals.gaussian import filtered, gaussian_kernel
from engb_core.signals.motion import Motion
from engb_core.signals.sharp_motion import between_samples, ORDER

__all__ = ['at_recorded_samples', 'carried', 'effort_of_recording']

Array = NDArray[np.float64]


def carried(recording: Recording, motion: Motion, values: Array) -> tuple[Array, Array, Array]:
    """Return what values (k,) at the recording's samples become on the motion's grid when they
    pass as the position does: themselves, their rate and its rate, (n,) each."""
    if motion.sharp:
        raw = between_samples(recording, motion, values)
        smooth = sosfiltfilt(butter(ORDER, motion.bandwidth, fs=1.0 / motion.step, output='sos'),
                             raw)
        rate = np.gradient(smooth, motion.step)
        return smooth, rate, np.gradient(rate, motion.step)
    fine = recording.interval
    stride = max(1, round(motion.step / fine))
    full: Array = np.arange(int(np.floor(recording.time[-1] / fine + 1e-6)) + 1,
                            dtype=np.float64) * fine
    raw = motion.edges.joined(full, values)
    smooth, rate, curve = (
        filtered(raw, gaussian_kernel(motion.bandwidth, fine, derivative))[::stride].copy()
        for derivative in range(3))
    return smooth, rate, curve


def at_recorded_samples(recording: Recording, motion: Motion, samples: Array) -> Array:
    """Return the table (k, SAMPLE_SIZE) at the recording's own samples, with the position as it
    was recorded and all else from the motion's `samples` (n, SAMPLE_SIZE)."""
    table = np.empty((recording.time.size, samples.shape[1]))
    _interpolated(samples, recording.time, float(motion.time[0]), motion.step, table)
    table[:, TIME] = recording.time
    table[:, TIME_STEP] = recording.interval
    table[:, POSITION] = recording.position
    return table


@kernel
def _interpolated(samples: Array, times: Array, begin: float, step: float, table: Array) -> None:
    # The grid is even, so that where each sample falls need not be searched for.
    last = samples.shape[0] - 1
    for row in range(times.size):
        place = min(max((times[row] - begin) / step, 0.0), float(last))
        before = min(int(place), max(last - 1, 0))
        share, after = place - before, min(before + 1, last)
        for column in range(samples.shape[1]):
            value = samples[before, column]
            table[row, column] = value + share * (samples[after, column] - value)


def _unwarped(recording: Recording, late: Array) -> Array:
    """Return what is to be added to positions (k,) that were measured `late` (k,) [s]."""
    if not np.isfinite(late).all():
        return np.zeros(late.size)
    # What would have been measured before an earlier instant's value came at once with it.
    instants = np.maximum.accumulate(recording.time - late)
    return np.interp(recording.time, instants, recording.position) - recording.position


def effort_of_recording(recording: Recording, motion: Motion, samples: Array, physics: Physics,
                        moving: NDArray[np.bool_] | None = None,
                        walk: Walk | None = None, told: float = math.inf) -> Array:
    """Return the effort (n,) [N·m] that the recorded motion needs, with its position corrected by
    what `physics` says of the sensor; where effort is a command, the one that was recorded while
    the drive acted on another.

    Args:
        recording: what was sampled.
        motion: of it.
        samples: (n, SAMPLE_SIZE) of that motion; the columns of the stages are filled in.
        physics: model and effects.
        moving, walk: as for `effort_of_motion`.
        told: up to which frequency [Hz] the position tells the torque.
    """
    taps = gaussian_kernel(told, motion.step) if told < motion.bandwidth else None
    effort = _needed(recording, motion, samples, physics, moving, walk, taps)
    if motion.commanded is not None and physics.stages['command']:
        effort += motion.commanded.smoothed(physics, motion.time)
    return effort


def _table(recording: Recording, motion: Motion, samples: Array, physics: Physics,
           walk: Walk | None) -> Array:
    """Return the table (k, SAMPLE_SIZE) at the recording's own samples that the corrections look
    at: once for all where they look at the motion alone."""
    if not all(physics.of_motion[effect] for _, effect, _ in physics.corrections):
        effort_of_motion(samples, motion.step, replace(physics, corrections=()), walk=walk)
        return at_recorded_samples(recording, motion, samples)
    if walk is None:
        return at_recorded_samples(recording, motion, samples)
    if walk.recorded is None:
        walk.recorded = at_recorded_samples(recording, motion, samples)
    return walk.recorded


def _needed(recording: Recording, motion: Motion, samples: Array, physics: Physics,
            moving: NDArray[np.bool_] | None, walk: Walk | None, taps: Array | None) -> Array:
    if not physics.corrections:
        return effort_of_motion(samples, motion.step, physics, moving, walk, taps)
    plain = replace(physics, corrections=())
    table = _table(recording, motion, samples, physics, walk)
    error = np.zeros(recording.time.size)
    state = physics.fresh_state()
    for function, effect, late in physics.corrections:
        function.loop(physics.parameters[effect], state[effect], table, TORQUE)
        error += _unwarped(recording, table[:, TORQUE]) if late else table[:, TORQUE]
    corrected = samples.copy()
    if np.isfinite(error).all():
        for column, values in zip((POSITION, VELOCITY, ACCELERATION),
                                  carried(recording, motion, error), strict=True):
            corrected[:, column] += values
    return effort_of_motion(corrected, motion.step, plain, moving, taps=taps)
