# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Mechanisms of which no file of engb_core has a description. Their ids begin with `outside_`.

A description is a file of engb_core/effects, named or `unexplained_*`; that a grammar of laws can
spell a mechanism is none. tests/proof/test_outside.py keeps the list: a kind that gets a
description is entered in `DESCRIBED_SINCE`.
"""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .catalogue import drawer, Hidden
from .nominal import Nominal

__all__ = ['DESCRIBED_SINCE', 'UNDESCRIBED', 'stratum_of']

_POSITION = ('position', 'motor_angle', 'screw_angle')
_DIRECTION = ('direction', 'velocity')
Shape = Callable[[np.random.Generator], tuple[float, float]]

# kind: (what acts, bounds of its size, its shape, what it depends on, memory, fair names)
UNDESCRIBED: dict[str, tuple[int, tuple[float, float], Shape, tuple, bool, tuple[str, ...]]] = {
    'outside_drive_dead_zone': (
        1, (2e-4, 0.08), lambda r: (r.uniform(0.01, 0.05), 1.0), (('effort', 'load'),), False, ()),
    'outside_current_polarity': (
        2, (0.003, 0.6), lambda r: (1.0, 1.0), (('effort', 'load'),), False,
        ('asymmetric_friction', 'torque_offset')),
    'outside_gain_over_speed': (
        3, (0.005, 0.9), lambda r: (r.uniform(15, 60), 1.0),
        (('velocity',), ('effort', 'load', 'acceleration')), False, ()),
    'outside_supply_ripple': (
        4, (0.004, 0.7), lambda r: (r.uniform(1.5, 9.0), r.uniform(0, 6.28)),
        (('time',), ('effort', 'load')), False, ()),
    'outside_current_slew': (
        5, (1e-3, 0.8), lambda r: (1.0, 1.0), (('effort', 'acceleration', 'time'),), True,
        ('actuation_lag',)),
    'outside_sensor_remanence': (
        6, (3e-4, 0.06), lambda r: (r.uniform(0.05, 0.15), 1.0),
        (('effort', 'load'),), True, ('load_hysteresis',)),
    'outside_inertial_friction': (
        7, (5e-7, 2e-3), lambda r: (1.0, 1.0), (('acceleration',), _DIRECTION), False, ()),
    'outside_film_switch': (
        8, (0.01, 0.9), lambda r: (r.uniform(18, 30), r.uniform(4, 9)),
        (('velocity',),), True, ('stribeck_friction',)),
    'outside_rub_after_reversal': (
        9, (0.02, 5.0), lambda r: (r.uniform(0.1, 0.6), 1.0),
        (('since_reversal', 'time'), _DIRECTION), True, ()),
    'outside_late_load_friction': (
        10, (0.003, 0.6), lambda r: (r.uniform(0.5, 3.0), 1.0),
        (('load', 'effort'), _DIRECTION), True, ('load_dependent_friction',)),
    'outside_disc_dither': (
        11, (0.01, 0.95), lambda r: (r.uniform(5, 40), 1.0),
        (('disc_speed',), _DIRECTION), False, ()),
    'outside_pad_damping': (
        12, (2e-3, 0.5), lambda r: (1.0, 1.0),
        (('velocity',), (*_POSITION, 'load')), False, ()),
    'outside_grease_over_distance': (
        13, (2e-5, 0.05), lambda r: (r.uniform(60, 400), 1.0),
        (('distance', 'time'), ('velocity',)), True, ()),
    'outside_inertia_over_angle': (
        14, (0.01, 0.85), lambda r: (r.uniform(0.15, 1.2), r.uniform(0, 6.28)),
        (_POSITION, ('acceleration', 'velocity')), False, ()),
    'outside_contact_wanders': (
        15, (1e-3, 5.0), lambda r: (1.0, 1.0),
        (('distance', 'heat', 'time'), (*_POSITION, 'load')), True, ('contact_shift',)),
    'outside_hot_contact': (
        16, (0.02, 8.0), lambda r: (1.0, 1.0),
        (('pad_temperature', 'heat', 'time'), (*_POSITION, 'load')), False,
        ('contact_shift', 'self_energizing')),
    'outside_encoder_ripple': (
        0, (3e-4, 0.12), lambda r: (float(r.integers(2, 5)), r.uniform(0, 6.28)),
        (('motor_angle', 'position', 'screw_angle'),), False, ('cogging_torque',)),
}
# Kinds that have got a description, by its name. They are drawn in their old place, so that the
# cases of a seed stay what they were, and count among the described ones.
DESCRIBED_SINCE = {'outside_gain_over_speed': 'unexplained_speed_gain',
                   'outside_drive_dead_zone': 'unexplained_crossover'}
NEEDS_DISC = ('outside_disc_dither', 'outside_hot_contact')


def stratum_of(name: str) -> str:
    """Return the stratum of a kind that is drawn in the place of the undescribed ones."""
    return 'described' if name in DESCRIBED_SINCE else 'undescribed'


def _register(name: str) -> None:
    kind, bounds, shape, depends_on, memory, fair = UNDESCRIBED[name]

    @drawer(name)
    def _draw(rng: np.random.Generator, base: Nominal, motion: str) -> Hidden:
        a, b = shape(rng)

        def put(plant: np.ndarray, m: float) -> None:
            if kind:
                plant['odd_kind'], plant['odd'], plant['odd_a'], plant['odd_b'] = kind, m, a, b
            else:
                plant['ecc'], plant['ecc_order'], plant['ecc_phase'] = m, a, b

        return Hidden(name, name.removeprefix('outside_').replace('_', ' '), put, bounds,
                      lambda c: {}, needs_disc=name in NEEDS_DISC, depends_on=depends_on,
                      memory=memory, fair=fair)


for _name in UNDESCRIBED:
    _register(_name)
