# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The names that the contract gives to effects (docs/contract.md, section 4)."""
from __future__ import annotations

__all__ = ['DRIVES', 'NUMBERS', 'TABLE_4']

NUMBERS = frozenset({
    'inertia_error', 'viscous_friction_error', 'coulomb_friction_error', 'load_stiffness_error',
    'contact_shift', 'torque_offset'})

TABLE_4 = NUMBERS | {
    'load_dependent_friction', 'asymmetric_friction', 'stribeck_friction', 'presliding_friction',
    'nonlinear_viscous_friction', 'friction_drift', 'cogging_torque', 'torque_ripple',
    'torque_saturation', 'actuation_lag', 'backlash', 'drivetrain_resonance', 'load_hysteresis',
    'pad_creep', 'self_energizing', 'pad_friction_fade', 'disc_runout'}

# What only a drive that is seen from outside shows.
DRIVES = frozenset({'effort_scale_error', 'effort_measurement_lag', 'command_delay',
                    'command_rate_limit', 'back_emf'})
