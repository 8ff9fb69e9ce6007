# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The numbers of one truth plant, as a record that the compiled loop reads.

A `*_kind` of 0 leaves the effect out; other values choose its formulation. SI units, motor side.
"""
from __future__ import annotations

import numpy as np

__all__ = ['PLANT', 'blank_plant', 'settings_of']

_F, _I = np.float64, np.int64

PLANT = np.dtype([
    # base plant
    ('inertia', _F), ('viscous', _F), ('load', _F, 4), ('contact', _F), ('turn', _F),
    ('bend_kind', _I), ('bend', _F), ('bend_at', _F), ('bend_width', _F),
    ('coulomb', _F), ('gain', _F), ('gain_power', _F), ('gain_scale', _F), ('gain_knee', _F),
    ('saturation', _F),
    # friction
    ('asym_coulomb', _F), ('asym_load', _F), ('asym_speed', _F),
    ('stribeck_kind', _I), ('stribeck_ratio', _F), ('stribeck_velocity', _F),
    ('bristle_kind', _I), ('bristle_length', _F),
    ('bristle_elastic', _F), ('bristle_damping', _F),
    ('slip_length', _F, 6), ('slip_weight', _F, 6),
    ('drag_kind', _I), ('drag', _F), ('drag_shape', _F), ('drift_kind', _I), ('drift', _F),
    ('drift_time', _F), ('drift_at', _F),
    # drive
    ('cog_kind', _I), ('cog_order', _F), ('cog', _F), ('cog_phase', _F), ('cog_second', _F),
    ('cog_second_phase', _F), ('ripple_kind', _I), ('ripple_order', _F), ('ripple', _F),
    ('ripple_phase', _F), ('ripple_second', _F), ('weak_kind', _I), ('weak', _F), ('weak_at', _F),
    ('lag_kind', _I), ('lag', _F), ('offset', _F),
    # train
    ('train_kind', _I), ('far_inertia', _F), ('stiffness', _F), ('damping', _F), ('gap', _F),
    ('far_coulomb', _F), ('far_gain', _F), ('hardening', _F), ('slack', _F),
    # load
    ('hyst_kind', _I), ('hyst', _F), ('hyst_length', _F), ('hyst_shape', _F), ('hyst_peak', _F),
    ('play_radius', _F, 5), ('play_weight', _F, 5),
    ('creep_kind', _I), ('creep_part', _F, 5), ('creep_time', _F, 5),
    ('self_kind', _I), ('self_gain', _F), ('self_speed', _F),
    ('fade_kind', _I), ('fade', _F), ('fade_from', _F), ('fade_to', _F),
    ('runout_kind', _I), ('runout', _F), ('runout_phase', _F), ('runout_second', _F),
    ('runout_shape', _F),
    # outside the library
    ('dent_kind', _I), ('dent', _F), ('dent_at', _F), ('dent_width', _F),
    ('fault_kind', _I), ('fault', _F), ('fault_from', _F), ('fault_to', _F),
    ('ecc', _F), ('ecc_phase', _F), ('ecc_order', _F),
    ('vibe_kind', _I), ('vibe', _F), ('vibe_hertz', _F),
    ('vibe_phase', _F), ('age', _F), ('age_time', _F), ('age_slip', _F), ('spur', _F),
    ('spur_speed', _F), ('patch_kind', _I), ('patch', _F), ('patch_at', _F),
    ('patch_length', _F), ('heat', _F), ('heat_time', _F),
    # one of these at a time: effects_outside.py says which, and what a and b mean
    ('odd_kind', _I), ('odd', _F), ('odd_a', _F), ('odd_b', _F),
    # controller
    ('kp', _F), ('ki', _F), ('kd', _F), ('limit', _F), ('ff_inertia', _F), ('ff_viscous', _F),
    ('counts', _F), ('filter_pole', _F),
])


def blank_plant() -> np.ndarray:
    """A record array of length one with every effect off and harmless divisors."""
    plant = np.zeros(1, PLANT)
    for name in ('gain_power', 'gain_scale', 'stribeck_ratio', 'stribeck_velocity',
                 'bristle_length', 'slip_length', 'drag_shape', 'drift_time', 'weak_at',
                 'hyst_length', 'hyst_shape', 'hyst_peak', 'creep_time', 'self_speed',
                 'dent_width', 'age_time', 'age_slip', 'spur_speed', 'patch_length',
                 'heat_time', 'fade_to', 'ecc_order', 'bend_width', 'odd_a', 'odd_b'):
        plant[name] = 1.0
    plant['contact'] = -1e9
    plant['filter_pole'] = 0.588
    plant['counts'] = 8192.0
    return plant


def settings_of(plant: np.ndarray) -> dict[str, float | list[float]]:
    """The record as plain numbers, for the truth file."""
    return {name: plant[name][0].tolist() for name in plant.dtype.names}
