# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Side signals without the noise of their sensors.

What a disc speed or a pad temperature does to the torque is computed from the signal as it was
recorded. Its noise would be torque there, and effects that smooth it would seem to explain
something.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from engb_core.recording import Recording, Signal

__all__ = ['side_signal', 'without_noise']

Array = NDArray[np.float64]

# Widths of the smoothing [samples], each so many times the one before. The narrowest tells
# whether there is any noise: where it does best the signal stays as it is. The widest leaves a
# fifteenth of the noise; a wider one takes its time.
_NARROWEST, _WIDER, _WIDEST = 0.5, 2.0 ** 0.5, 64.0
# A pause of so many usual intervals parts a signal: what is beyond says nothing of this side.
_PAUSE = 4.5


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
    steps = np.diff(signal.time)
    if values.size < 3 or not np.any(values != values[0]):
        return values
    breaks = np.flatnonzero(steps > _PAUSE * float(np.median(steps))) + 1
    parts = np.split(values, breaks)
    longest = max(part.size for part in parts)
    best, least, width = values, np.inf, _NARROWEST
    while width < min(0.25 * longest, _WIDEST):
        smooth = np.concatenate([_smoothed(part, width) for part in parts])
        kept = 1.0 / (width * np.sqrt(2.0 * np.pi)) if width > 1.0 else float(
            gaussian_filter1d(np.eye(1, 33, 16)[0], width)[16])
        predicted = float(np.mean((values - smooth) ** 2)) / (1.0 - kept) ** 2
        if predicted >= least:
            break
        best, least = values if width == _NARROWEST else smooth, predicted
        width *= _WIDER
    return best


def _smoothed(values: Array, width: float) -> Array:
    """Return values (n,) passed through a Gaussian, continued beyond both ends at the speed that
    they have there."""
    reach = min(int(np.ceil(4.0 * width)), values.size - 1)
    if reach < 1:
        return values
    longer = np.pad(values, reach, mode='reflect', reflect_type='odd')
    smooth: Array = gaussian_filter1d(longer, width)[reach:-reach]
    return smooth
