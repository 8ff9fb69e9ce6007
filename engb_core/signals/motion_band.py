# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Up to which frequency a recording's position counts tell the torque that the motion needs.

An encoder that rounds to counts of q, read every h seconds, adds a noise of variance q²/12 that is
white up to half the sampling rate (Bennett, Bell System Technical Journal 27 (1948) 446). Inertia
makes torque of it that grows with the fourth power of frequency: J²·(2πf)⁴·(q²/12)·2h per hertz.
The torque that there is to explain, and the noise of its own measurement, is what the recorded
effort holds per hertz. From where the first is more than the second, the motion says nothing of
the torque any more, and only adds noise; a light inertia with fine counts never gets there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from engb_core.recording import Recording
from engb_core.signals.count_edges import LEAST_STEPS, NO_STEP, OF_STEPS, quantum_of
from engb_core.signals.motion import Motion
from engb_core.signals.sampling_noise import SamplingNoise

__all__ = ['COMPARED', 'count_of', 'outweighed_from', 'position_variance', 'told_up_to']

# Up to here [Hz] a model is compared with a recording: what counts do above it passes no filter.
COMPARED = 20.0
# Length of the stretches whose spectra are averaged [s]: it resolves its inverse.
STRETCH = 1.0


def told_up_to(recording: Recording, inertia: float) -> float:
    """Return the frequency [Hz] from which what counts make of the inertia's torque outweighs the
    recorded effort; infinity where it never does.

    Args:
        recording: position in counts [rad], effort [N·m].
        inertia: of the model [kg·m²].
    """
    quantum = quantum_of(recording.position)
    if quantum <= 0.0 or not _in_counts(recording.position, quantum):
        return np.inf
    return outweighed_from(recording, inertia, quantum ** 2 / 12.0)


def outweighed_from(recording: Recording, inertia: float, variance: float) -> float:
    """Return the frequency [Hz] from which what a white noise of the position makes of the
    inertia's torque outweighs the recorded effort; infinity where it never does.

    Args:
        recording: of which the effort is asked [N·m].
        inertia: of the model [kg·m²].
        variance: of the position's noise [rad²].
    """
    step = recording.interval
    time = np.arange(int(np.floor(recording.time[-1] / step + 1e-6)) + 1) * step
    length = min(time.size, round(STRETCH / step))
    if length < 2:
        return np.inf
    effort = np.interp(time, recording.time, recording.effort)
    frequency, held = welch(effort, 1.0 / step, nperseg=length)
    # The mean is taken off each stretch: the first value is none.
    frequency, held = frequency[1:], held[1:]
    noise = (inertia * (2.0 * np.pi * frequency) ** 2) ** 2 * variance * 2.0 * step
    outweighed = np.flatnonzero(noise > held)
    return float(frequency[outweighed[0]]) if outweighed.size else np.inf


def position_variance(recording: Recording, motion: Motion, noise: SamplingNoise) -> float:
    """Return the mean variance [rad²] of a recording's positions, of its `noise` at the speeds of
    its `motion`, and no less than that of its counts."""
    return max(float(np.mean(noise.of(motion.velocity) ** 2)),
               count_of(recording.position) ** 2 / 12.0)


def count_of(position: NDArray[np.float64]) -> float:
    """Return the encoder's count [rad], also where its smallest usual step is several of them, as
    of a shaft behind a gear: then the least distance between two places that were told."""
    usual = quantum_of(position)
    if usual <= 0.0 or _in_counts(position, usual):
        return usual
    apart = _apart(position)
    # Places are often written with so few digits that neighbours seem to differ in distance.
    return float(np.mean(apart[apart < 1.5 * apart.min()]))


def _apart(position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far the places that were told lie from their next neighbours [rad]."""
    apart = np.diff(np.unique(position))
    return apart[apart > NO_STEP]


def _in_counts(position: NDArray[np.float64], quantum: float) -> bool:
    """Whether the steps of a position are multiples of its smallest usual one: those of a position
    that is given finely, and only moves slowly at times, lie a quarter of it off on average. Steps
    at one speed are alike whatever they are given in, so the larger ones are asked if there are
    as many as the smallest one was told from; and the places that they lead to, which lie nearer
    together than a step that is two counts or more."""
    if np.quantile(_apart(position), OF_STEPS) < 0.75 * quantum:
        return False
    steps = np.abs(np.diff(position)) / quantum
    steps = steps[steps > 0.5]
    several = steps[steps > 1.5]
    if several.size > LEAST_STEPS:
        steps = several
    return bool(np.mean(np.abs(steps - np.round(steps))) < 0.5 * 0.25)
