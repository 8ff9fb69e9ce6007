# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What position counts take off an identified inertia, and the bandwidth at which that is little.

Least squares take the regressors for exact. An encoder that rounds to counts of q adds to the
acceleration a noise of variance σ² = q²/12·Σg″² (g″: the kernel's taps), which no torque belongs
to: the inertia comes out too small by the part

    λ = m·σ²·[(XᵀX)⁻¹]_JJ,

m rows, X the regression's columns (errors in variables: Fuller, Measurement Error Models (1987),
section 1.1). σ² grows with the fifth power of the bandwidth; what the strokes of a brake need lies
at 1 to 5 Hz.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from engb_core.identify.smoothing import BANDWIDTH, Motion, moving_pieces
from engb_core.recording import Recording

__all__ = ['attenuation', 'below_the_counts']

Array = NDArray[np.float64]

# No inertia is known to less than this part [-], from masses and lengths either.
LEAST_ERROR = 0.01
# The lowest bandwidth [Hz]: what the brake does itself must pass (assumption 1 of the paper). Each
# step of half an octave divides the noise's variance by six.
LOWEST, STEP = 5.0, 2.0 ** -0.5
# The speed up to which friction rises, as a part of the fastest: it is not known yet.
SATURATION = 0.02


def below_the_counts(recordings: Sequence[Recording], pieces: list[Motion], degree: int,
                     ) -> list[Motion]:
    """Return the pieces in motion at the highest bandwidth at which counts take no more off the
    inertia than nobody knows it to, or at the lowest; `pieces` themselves, where they will do.

    Args:
        recordings: of one brake.
        pieces: their pieces in motion.
        degree: of the polynomial that the load is fitted by.
    """
    bandwidth = BANDWIDTH
    while pieces and bandwidth > LOWEST and attenuation(pieces, degree) > LEAST_ERROR:
        bandwidth = max(bandwidth * STEP, LOWEST)
        pieces = moving_pieces(recordings, bandwidth)
    return pieces


def attenuation(pieces: Sequence[Motion], degree: int) -> float:
    """Return the part (0 to 1) by which counts make the inertia too small.

    Args:
        pieces: the motions that it is identified from.
        degree: of the polynomial that the load is fitted by.
    """
    fastest = max(piece.top_speed for piece in pieces)
    table = np.concatenate([_columns(piece, SATURATION * fastest, degree) for piece in pieces])
    noise = sum(piece.rows.size * piece.count ** 2 / 12.0
                * float(np.sum(piece.kernel.taps(2) ** 2)) for piece in pieces)
    # What the others leave of the acceleration: its square sum is the inverse's first entry's.
    others = table[:, 1:] / np.maximum(np.linalg.norm(table[:, 1:], axis=0), 1e-300)
    axes = np.linalg.qr(others)[0]
    own = table[:, 0] - axes @ (axes.T @ table[:, 0])
    return float(min(noise / max(own @ own, 1e-300), 1.0))


def _columns(piece: Motion, saturation: float, degree: int) -> Array:
    """Return acceleration, velocity and what load and friction are fitted by, (m, 4 + 2·degree),
    through the kernel."""
    shape = np.clip(piece.velocity / saturation, -1.0, 1.0)
    reach = max(float(np.abs(piece.position).max()), 1e-300)
    powers = (piece.position / reach) ** np.arange(degree + 1)[:, None]
    return np.column_stack([
        piece.smooth_acceleration[piece.rows], piece.smooth_velocity[piece.rows],
        piece.smooth(np.concatenate([powers, powers * shape])).T])
