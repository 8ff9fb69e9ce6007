# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The paper's own observer: causal, so that d̂ lags behind the position that it is drawn over.

At speed ω a low-pass of delay τ draws the load of θ − ω·τ over θ while clamping, and that of
θ + ω·τ while releasing: the even part mends itself, the odd part takes the load's slope for
friction, too small by ω·τ·dT_L/dθ. The cure is to pass the position through q as well: torque and
position then lag alike.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import signal

from engb_core.bench.sensors import VelocityFromPosition
from engb_core.control.disturbance_observer import DisturbanceObserver
from engb_core.control.loop import VELOCITY_CUTOFF
from engb_core.identify.paper_way import known_cogging, Observed
from engb_core.identify.smoothing import Motion
from engb_core.model import Model
from engb_core.recording import Recording

__all__ = ['drive_velocity', 'observe_causally', 'pass_through_q']

Array = NDArray[np.float64]


def observe_causally(piece: Motion, start: Model, recording: Recording, cutoff: float = 20.0,
                     delayed: bool = False, published: bool = False) -> Observed:
    """Do step 2 with the paper's causal observer.

    Args:
        piece: a motion of the recording.
        start: the nominal model, for J, B and known cogging.
        recording: whose velocity counts, as the observer in the loop sees it.
        cutoff: −3 dB point of q [Hz].
        delayed: draw d̂ over the position that passed q too (the cure).
        published: take d̂ from the recording's topic `disturbance`, as the node published it.
    """
    velocity = drive_velocity(recording, piece.time)
    observer = DisturbanceObserver(start.motor, cutoff)
    if published and 'disturbance' in recording.signals:
        found = recording.signals['disturbance'].at(piece.time)
    else:
        found = observer.filter(piece.time, velocity, piece.effort)
    waves = pass_through_q(known_cogging(piece, start), piece.interval, observer)
    if not delayed:
        return Observed(found + waves, piece.position, piece.smooth_velocity)
    return Observed(found + waves, pass_through_q(piece.position, piece.interval, observer),
                    pass_through_q(velocity, piece.interval, observer))


def drive_velocity(recording: Recording, time: Array) -> Array:
    """Return the drive's velocity (n,) [rad/s] at `time` (n,) [s], derived where it gives none."""
    velocity = recording.velocity
    if velocity is None:
        derived = VelocityFromPosition(VELOCITY_CUTOFF)
        velocity = np.array([derived.step(*sample) for sample in zip(
            recording.time.tolist(), recording.position.tolist(), strict=True)])
    return np.interp(time, recording.time, velocity)


def pass_through_q(values: ArrayLike, interval: float, observer: DisturbanceObserver) -> Array:
    """Return `values` (n,), `interval` [s] apart, through the observer's low-pass, discretised as
    it is there; the first value is taken as a standstill."""
    tau = observer.time_constant
    numerator = np.full(2, interval / (2.0 * tau + interval))
    denominator = [1.0, -(2.0 * tau - interval) / (2.0 * tau + interval)]
    settled = signal.lfilter_zi(numerator, denominator)
    found = np.asarray(values, float)
    for _ in range(observer.order):
        found = signal.lfilter(numerator, denominator, found, zi=settled * found[0])[0]
    return found
