# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A short recording of a simulated machine whose numbers are known, for the tests beside."""
from __future__ import annotations

from pathlib import Path

import numpy as np

from .bagfile import Bench, write_recording
from .nominal import Nominal
from .plant_record import blank_plant
from .references import short_test
from .sensors import record, Sensors
from .truth_plant import simulate

__all__ = ['recorded']

_NUMBERS = {'inertia': 7e-5, 'viscous': 1e-3, 'coulomb': 0.012, 'kp': 0.4, 'ki': 1.5,
            'kd': 0.0055, 'limit': 0.75, 'ff_inertia': 7e-5, 'offset': -0.01}


def recorded(folder: Path, name: str, seed: int, length: float | None = None,
             rate: float = 1000.0, **numbers: float) -> Path:
    """Write a recording into a folder.

    Args:
        folder: where.
        name: of the recording.
        seed: of reference and noise.
        length: [s] (None: about 25).
        rate: of the samples [Hz].
        numbers: of the plant, where they differ from the usual ones.
    """
    rng = np.random.default_rng(seed)
    reference = short_test(rng, plain=False, length=length)
    plant = blank_plant()
    for key, value in (_NUMBERS | numbers).items():
        plant[key] = value
    run = simulate(plant, reference)
    sensors = Sensors(rate, 8192.0, 0.002, 0.0, 1e-7, 0.0, 0, 0.0, 0.0)
    feed = Nominal(7e-5, 0.0, (0.0, 0.0, 0.0, 0.0), None, 0.0, 0.0, 1.0)
    return write_recording(folder, name, Bench('/engb', 'file', 10**18),
                           record(run, sensors, rng), run, reference, feed, None, rng)
