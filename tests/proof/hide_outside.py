# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Mechanisms without a name of which the library has a description (an `unexplained_*` file)."""
from __future__ import annotations

import numpy as np

from .catalogue import Context, drawer, Hidden
from .nominal import Nominal

__all__ = ['DESCRIBED']

DESCRIBED = {
    'outside_dent': 'unexplained_spot', 'outside_passing_fault': 'unexplained_episode',
    'outside_encoder_eccentricity': 'unexplained_eccentricity',
    'outside_vibration': 'unexplained_vibration', 'outside_ageing_at_rest': 'unexplained_rest',
    'outside_load_speed_efficiency': 'unexplained_loss',
    'outside_position_friction': 'unexplained_surface',
    'outside_hot_motor': 'unexplained_gain_drift'}


def _none(context: Context) -> dict[str, float]:
    return {}


def _top(motion: str) -> float:
    return 22.0 if motion == 'routine' else 34.0


@drawer('outside_dent')
def _dent(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind, at, width = int(rng.integers(1, 3)), rng.uniform(0.2, 0.7), rng.uniform(0.4, 1.6)

    def put(plant: np.ndarray, m: float) -> None:
        plant['dent_kind'], plant['dent'] = kind, m
        plant['dent_at'], plant['dent_width'] = at * _top(motion), width

    return Hidden('outside_dent', ('bump', 'bump and dip')[kind - 1], put, (5e-4, 0.2), _none,
                  depends_on=(('position', 'motor_angle', 'screw_angle', 'load'),))


@drawer('outside_passing_fault')
def _fault(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind, start, length = int(rng.integers(1, 3)), rng.uniform(8, 40), rng.uniform(2.5, 8.0)

    def put(plant: np.ndarray, m: float) -> None:
        plant['fault_kind'], plant['fault'] = kind, m * (20.0 if kind == 1 else 1.0)
        plant['fault_from'], plant['fault_to'] = start, start + length

    return Hidden('outside_passing_fault', ('rubbing', 'extra load')[kind - 1], put,
                  (1e-3, 0.2), _none, depends_on=(('time',),))


@drawer('outside_encoder_eccentricity')
def _eccentricity(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    phase = rng.uniform(0, 2 * np.pi)

    def put(plant: np.ndarray, m: float) -> None:
        plant['ecc'], plant['ecc_phase'] = m, phase

    return Hidden('outside_encoder_eccentricity', 'once per turn', put, (2e-3, 0.35), _none,
                  depends_on=(('motor_angle', 'position', 'screw_angle'),))


@drawer('outside_vibration')
def _vibration(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind, hertz, phase = int(rng.integers(1, 3)), rng.uniform(4, 17), rng.uniform(0, 2 * np.pi)

    def put(plant: np.ndarray, m: float) -> None:
        plant['vibe_kind'], plant['vibe'] = kind, m
        plant['vibe_hertz'], plant['vibe_phase'] = hertz, phase

    return Hidden('outside_vibration', ('steady tone', 'beating tone')[kind - 1], put,
                  (2e-4, 0.05), _none, depends_on=(('time',),))


@drawer('outside_ageing_at_rest')
def _ageing(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    time, slip = rng.uniform(0.1, 1.0), rng.uniform(0.5, 3.0)

    def put(plant: np.ndarray, m: float) -> None:
        plant['age'], plant['age_time'], plant['age_slip'] = m, time, slip

    return Hidden('outside_ageing_at_rest', 'logarithmic in rest', put, (0.02, 4.0), _none,
                  depends_on=(('time_at_rest', 'time', 'since_reversal'),), memory=True)


@drawer('outside_load_speed_efficiency')
def _efficiency(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    speed = rng.uniform(15, 60) if rng.random() < 0.5 else 1e6

    def put(plant: np.ndarray, m: float) -> None:
        plant['spur'], plant['spur_speed'] = m, speed

    name = 'product' if speed > 1e5 else 'product, levelling off'
    return Hidden('outside_load_speed_efficiency', name, put, (2e-5, 0.03), _none,
                  depends_on=(('load', 'position', 'effort'), ('velocity',)))


@drawer('outside_position_friction')
def _patch(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    kind = int(rng.integers(1, 3))
    at = rng.uniform(0.2, 0.8) * _top(motion)
    length = rng.uniform(6, 20) if kind == 1 else rng.uniform(1.0, 4.0)

    def put(plant: np.ndarray, m: float) -> None:
        plant['patch_kind'], plant['patch'] = kind, m
        plant['patch_at'], plant['patch_length'] = at, length

    bounds = ((0.02, 0.9), (0.02, 4.0))[kind - 1]
    return Hidden('outside_position_friction', ('wave', 'worn zone')[kind - 1], put, bounds,
                  _none, depends_on=(('position', 'motor_angle', 'screw_angle'),
                                     ('direction', 'velocity')))


@drawer('outside_hot_motor')
def _heat(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
    time = rng.uniform(6, 40)

    def put(plant: np.ndarray, m: float) -> None:
        plant['heat'], plant['heat_time'] = m, time

    return Hidden('outside_hot_motor', 'torque constant over winding heat', put, (0.005, 0.4),
                  _none, depends_on=(('heat', 'time'), ('effort', 'load')), memory=True)
