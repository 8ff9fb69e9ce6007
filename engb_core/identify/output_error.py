# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""J and B of the linear motor by output error, on SciPy's own tools, beside the classical fits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import signal
from scipy.optimize import least_squares

from engb_core.errors import InputError
from engb_core.identify.confidence import coloured_covariance, Estimate
from engb_core.identify.nominal_plant import LinearFit
from engb_core.identify.smoothing import Motion, motions
from engb_core.model import Motor
from engb_core.recording import Recording

__all__ = ['fit_output_error']

Array = NDArray[np.float64]

# The velocity is smoothed: samples closer than this say the same [s].
APART = 0.01


def fit_output_error(recordings: Sequence[Recording], start: Motor | None = None) -> LinearFit:
    """Simulate 1/(J·s + B), driven by the measured torque, and fit its velocity by least squares.

    The linear model with noise on its output only (Ljung, System Identification, section 4.2),
    discretised exactly for a torque held over each sample. Coulomb friction, which it lacks,
    counts as J and B.

    Args:
        recordings: step tests or sweeps of the unloaded motor, from a standstill.
        start: J and B to start from.

    Raises:
        InputError: nothing moves.
    """
    pieces = [piece for recording in recordings for piece in motions(recording)
              if piece.top_speed > 0.0]
    if not pieces:
        raise InputError('the motor does not move in any of these runs')
    motor = start or Motor()
    found = least_squares(lambda logs: _misfit(pieces, *np.exp(logs)),
                          np.log([motor.inertia, motor.viscous_friction]), x_scale=0.1)
    inertia, viscous = np.exp(found.x)
    sizes = [_misfit([piece], inertia, viscous).size for piece in pieces]
    # Between separate runs there is room for any correlation to die down.
    place = np.concatenate([np.arange(size) + 500 * number + sum(sizes[:number])
                            for number, size in enumerate(sizes)])
    covariance, freedom = coloured_covariance(found.jac, found.fun, place)
    deviation = np.sqrt(np.diag(covariance)) * (inertia, viscous)
    return LinearFit(Estimate(float(inertia), float(deviation[0]), 'kg·m²', True, freedom),
                     Estimate(float(viscous), float(deviation[1]), 'N·m·s/rad', True, freedom))


def _misfit(pieces: Sequence[Motion], inertia: float, viscous: float) -> Array:
    """Return simulated less measured velocity of all pieces (m,) [rad/s]."""
    parts = []
    for piece in pieces:
        discrete = signal.cont2discrete(([1.0], [inertia, viscous]), piece.interval, 'zoh')
        numerator, denominator = np.ravel(discrete[0]), discrete[1]
        simulated = piece.kernel.apply(signal.lfilter(numerator, denominator, piece.effort))
        every = max(1, round(APART / piece.interval))
        parts.append((simulated - piece.smooth_velocity)[::every])
    return np.concatenate(parts)
