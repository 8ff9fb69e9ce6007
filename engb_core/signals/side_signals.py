# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Side signals without the noise of their sensors.

What a disc speed or a pad temperature does to the torque is computed from the signal as it was
recorded. Its noise would be torque there, and effects that smooth it would seem to explain
something.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from engb_core.recording import Recording, Signal
from engb_core.repeated_stamps import GAP_STEPS, usual_interval
from engb_core.signals.gaussian import gaussian_kernel, moving_on

__all__ = ['side_signal', 'without_noise']

Array = NDArray[np.float64]

# Corners of the smoothing [1/sample], each so much lower than the one before. The first, a
# Gaussian half a sample wide, tells whether there is any noise: where it does best the signal
# stays as it is. The last leaves a fifteenth of the noise; a lower one takes its time.
_HIGHEST, _LOWER = math.sqrt(math.log(2.0)) / math.pi, 2.0 ** -0.5
_LOWEST = _HIGHEST / 128.0


def side_signal(recording: Recording, name: str) -> Array | None:
    """Return a side signal at the recording's samples (n,) [its unit], without the noise of its
    sensor; None where it was not recorded."""
    found = recording.signals.get(name)
    if found is None:
        return None
    return Signal(found.time, without_noise(found)).at(recording.time)


def without_noise(signal: Signal) -> Array:
    """Return the values (k,) of a signal smoothed by a Gaussian of the width that predicts best
    what was left out, by generalized cross-validation (Craven and Wahba, Numerische Mathematik 31
    (1979) 377). What smoothing at its narrowest spoils more than it predicts has no noise, and is
    returned as it is."""
    values = np.asarray(signal.value, float)
    if values.size < 3 or not np.any(values != values[0]):
        return values
    # What is beyond a gap says nothing of this side.
    gaps = np.diff(signal.time) > GAP_STEPS * usual_interval(signal.time)
    parts = np.split(values, np.flatnonzero(gaps) + 1)
    best, least, corner = values, np.inf, _HIGHEST
    while corner > _LOWEST:
        taps = gaussian_kernel(corner, 1.0)
        if taps.size > 2 * max(part.size for part in parts):
            break
        smooth = np.concatenate([moving_on(part, taps) for part in parts])
        left = float(np.mean((values - smooth) ** 2)) / (1.0 - taps[taps.size // 2]) ** 2
        if left >= least:
            break
        best, least = values if corner == _HIGHEST else smooth, left
        corner *= _LOWER
    return best
