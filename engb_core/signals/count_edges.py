# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What an encoder's counts say for certain: where the position passes from one to the next.

Between two counts nothing is known, at the instant of a count the position is known well. Where
several counts pass from one sample to the next, a sample says as much as an edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.recording import Recording

__all__ = ['CountEdges', 'LEAST_STEPS', 'NO_STEP', 'OF_STEPS', 'edges_of', 'passing',
           'quantum_of', 'shown_in_counts']

Array = NDArray[np.float64]

# What is less is rounding of the arithmetic and no step [rad]; from more than so many steps a
# usual one is told, the one that so many are smaller than.
NO_STEP = 1e-12
LEAST_STEPS = 50
OF_STEPS = 0.02


@dataclass(frozen=True)
class CountEdges:
    """The counts' edges of a recording of n samples, and its two ends.

    Attributes:
        time: (k,) when [s]; the first and the last are the recording's ends.
        sample: (k − 2,) the sample before each edge.
        share: (k − 2,) part of the way from that to the next sample.
        going_on: how far beyond the outermost edges the ends lie, as a part of the way from these
            to their neighbours; 0 where the shaft stands there.
    """

    time: Array
    sample: NDArray[np.int64]
    share: Array
    going_on: tuple[float, float]

    def of(self, values: Array) -> Array:
        """Return what values (n,) at the samples are at the edges, (k,)."""
        ahead = np.minimum(self.sample + 1, values.size - 1)
        inner = values[self.sample] + self.share * (values[ahead] - values[self.sample])
        before, after = (
            outermost + going_on * (outermost - neighbour)
            for going_on, outermost, neighbour in zip(
                self.going_on, (inner[0], inner[-1]), (inner[1], inner[-2]), strict=True))
        return np.concatenate([[before], inner, [after]])

    def joined(self, time: Array, values: Array) -> Array:
        """Return what values (n,) at the samples are at other times (m,) [s], on the straight
        lines that join the edges, (m,)."""
        return np.interp(time, self.time, self.of(values))


def edges_of(recording: Recording) -> CountEdges:
    """Return the edges of a recording's counts, and the samples between two changes by several
    counts each; of a shaft that never moves, and of a sensor without counts, all samples."""
    time, position = recording.time, recording.position
    change = np.flatnonzero(np.diff(position))
    if change.size < 2:
        inner = np.arange(time.size)
        return CountEdges(np.concatenate([time[:1], time, time[-1:]]), inner,
                          np.zeros(inner.size), (0.0, 0.0))
    fast = passing(recording)
    single = change[~(fast[change] & fast[change + 1])]
    beside, share_beside = _beside_rest(recording, change)
    sample = np.concatenate([single, np.flatnonzero(fast), beside])
    share = np.concatenate([np.full(single.size, 0.5), np.zeros(np.count_nonzero(fast)),
                            share_beside])
    ahead = np.minimum(sample + 1, time.size - 1)
    edge = time[sample] + share * (time[ahead] - time[sample])
    order = np.argsort(edge, kind='stable')
    edge = edge[order]
    end = max(time[-1], edge[-1] + 1e-9)
    return CountEdges(
        np.concatenate([[time[0]], edge, [end]]), sample[order], share[order],
        (_going_on(edge[:2], time[0]), _going_on(edge[-1:-3:-1], end)))


def passing(recording: Recording, count: float | None = None) -> NDArray[np.bool_]:
    """Return which samples (n,) lie between two changes by several counts, none of them lost; at
    both ends of the recording there is but one change. A count is so many radians (None: the
    smallest step that is usual)."""
    quantum = quantum_of(recording.position) if count is None else count
    if quantum <= 0.0:
        return np.zeros(recording.time.size, bool)
    several = ((np.abs(np.diff(recording.position)) > 1.5 * quantum)
               & (np.diff(recording.time) < 1.5 * recording.interval))
    both: NDArray[np.bool_] = (np.concatenate([several[:1], several])
                               & np.concatenate([several, several[-1:]]))
    return both


def quantum_of(position: Array) -> float:
    """Return the encoder's count [rad]: the smallest step that occurs again and again."""
    steps = np.abs(np.diff(position))
    steps = steps[steps > NO_STEP]
    return float(np.quantile(steps, OF_STEPS)) if steps.size > LEAST_STEPS else 0.0


def shown_in_counts(values: Array, count: float, phase: float) -> Array:
    """Return what a sensor shows of values (n,): the middle of the count that each lies in, of
    which one begins `phase` (0 to 1) counts below zero."""
    shown: Array = count * (np.floor(values / count + phase) + 0.5 - phase)
    return shown


def _going_on(edge: Array, time: float) -> float:
    """Return how far beyond the outermost edge a recording's end at `time` lies, as a part of the
    way from that edge's neighbour: the shaft goes on at their speed, but by no more than what the
    next edge would have shown; before the first and after the last edge of a stroke it stands."""
    between = edge[0] - edge[1]
    if between == 0.0:
        return 0.0
    beyond = float((time - edge[0]) / between)
    return 0.0 if beyond > 1.0 else beyond


def _beside_rest(recording: Recording, change: NDArray[np.int64],
                 ) -> tuple[NDArray[np.int64], Array]:
    """Return the first and last edges of changes by several counts that a rest or lost samples
    stand beside, as the samples before them and how far on: a line from the middle of the change
    to the edge before the rest would have the shaft creep all that time."""
    time, position = recording.time, recording.position
    duration, jump = time[change + 1] - time[change], position[change + 1] - position[change]
    quantum = quantum_of(position)
    several = (quantum > 0.0) & (np.abs(jump) > 1.5 * quantum)
    lost = duration > 1.5 * recording.interval
    apart = np.diff(change) > 1
    first = np.flatnonzero(several & (lost | np.append(True, apart)))
    last = np.flatnonzero(several & (lost | np.append(apart, True)))
    half = 0.5 * quantum / np.abs(jump)
    return (change[np.concatenate([first, last])],
            np.concatenate([half[first], 1.0 - half[last]]))
