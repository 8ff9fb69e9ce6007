# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Parts the disturbance into an even part, the load, and an odd part, friction (step 4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.identify.resampling import Resampled

__all__ = ['EvenOdd', 'decompose', 'even_odd', 'join']

Array = NDArray[np.float64]


@dataclass(frozen=True)
class EvenOdd:
    """Even and odd disturbance over position, all (M,).

    `position` θ_R [rad], `velocity` [rad/s] half the difference of the clamp's and the release's,
    so positive; `even`, `odd` [N·m] with the sign of d̂, so −T_L and −T_C.
    """

    position: Array
    velocity: Array
    even: Array
    odd: Array


def even_odd(values: Array) -> tuple[Array, Array]:
    """Return the even and odd part of `values` (M,) about its middle, equations (37), (38)."""
    mirrored = values[::-1]
    return 0.5 * (values + mirrored), 0.5 * (values - mirrored)


def decompose(data: Resampled) -> EvenOdd:
    """Apply (37) and (38) to the clamp data followed by the release data.

    Over clamp and then release the positions run up and mirror back down, so the first half of
    the even and odd parts, which is returned, belongs to `data.position`.
    """
    even, odd = even_odd(np.concatenate([data.clamp, data.release[::-1]]))
    half = data.position.size
    return EvenOdd(data.position, 0.5 * (data.clamp_velocity - data.release_velocity),
                   even[:half], odd[:half])


def join(parts: Sequence[EvenOdd]) -> EvenOdd:
    """Return the parts of several strokes as one, in order of strokes."""
    return EvenOdd(*(np.concatenate([getattr(part, name) for part in parts])
                     for name in ('position', 'velocity', 'even', 'odd')))
