# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Rows of the page's tables of what was chosen and what was run."""

from __future__ import annotations

from collections.abc import Iterable
import math

from engb_core.bench.settings import BenchSettings
from engb_core.report.wording import number
from engb_core.reproduce import chosen
from engb_core.reproduce.plan import Experiment

__all__ = ['chosen_rows', 'run_rows']


def chosen_rows(*brakes: BenchSettings) -> list[tuple[str, ...]]:
    """Return one row a chosen number, one column a brake."""
    rows = [(name, *(get(brake) for brake in brakes)) for name, get in _NUMBERS]
    gains = ((name, f'p {gains.p:g}, i {gains.i:g}, d {gains.d:g}') for name, gains in (
        ('PID', chosen.GAINS), ('PID, low gains', chosen.POOR_GAINS)))
    same = (*gains, ('encoder, current noise',
                     f'{chosen.SENSORS["counts_per_revolution"]} counts, '
                     f'{1e3 * chosen.SENSORS["effort_noise"]:g} mN·m'),
            ('disc', f'±{chosen.DISC_SPEED:g} rad/s'))
    return rows + [(name, *(text,) * len(brakes)) for name, text in same]


def run_rows(plan: Iterable[Experiment]) -> list[tuple[str, ...]]:
    """Return one row an experiment."""
    return [(entry.name, entry.figures, entry.purpose, f'{entry.duration:.1f} s')
            for entry in plan]


def _stiffness(brake: BenchSettings) -> str:
    return ' + '.join(f'{number(value)}·s{power}' for value, power in zip(
        brake.mechanism.clamp_stiffness, ('', '²', '³'), strict=False)) + ' N, s in m'


def _friction(brake: BenchSettings) -> str:
    if brake.saturation_velocity:
        return f'saturates at {brake.saturation_velocity:g} rad/s'
    return (f'sticks by (13), T_sf {1e3 * brake.breakaway:g} mN·m, falls within '
            f'{brake.stribeck_velocity:g} rad/s')


_NUMBERS = (
    ('K_T, true', lambda brake: f'{number(brake.torque_constant)} N·m/A'),
    ('J, B', lambda brake: f'{number(brake.inertia)} kg·m², '
                           f'{number(brake.viscous_friction)} N·m·s/rad'),
    ('R, L, supply', lambda brake: f'{brake.resistance:g} Ω, {1e6 * brake.inductance:g} µH, '
                                   f'{brake.voltage:g} V'),
    ('current loop', lambda brake: f'{brake.current_bandwidth:g} Hz'),
    ('N_g, L', lambda brake: f'{brake.mechanism.gear_ratio:g}, '
                             f'{1e3 * brake.mechanism.screw_lead:g} mm'),
    ('l₁, l₂, β', lambda brake: f'{1e3 * brake.mechanism.lever_input:g} mm, '
                                f'{1e3 * brake.mechanism.lever_output:g} mm, '
                                f'{math.degrees(brake.mechanism.lever_bend):.0f}°'),
    ('r, d', lambda brake: f'{1e3 * brake.mechanism.gear_radius:g} mm, '
                           f'{1e3 * brake.mechanism.gear_offset:.3g} mm'),
    ('η driving, clearance', lambda brake: f'{brake.mechanism.efficiency:g}, '
                                           f'{1e3 * brake.mechanism.clearance:g} mm'),
    ('F_N(s)', _stiffness),
    ('C₀', lambda brake: f'{1e3 * brake.coulomb:g} mN·m'),
    ('friction at low speed', _friction),
    ('screw out of round', lambda brake: f'±{100 * brake.friction_waviness:g} % of friction'),
    ('caliper: hysteresis, creep', lambda brake: f'±{100 * brake.hysteresis:g} %, '
                                                 f'{100 * brake.creep:g} % in '
                                                 f'{brake.creep_time:g} s'),
    ('μ, and how it falls', lambda brake: f'{brake.pad_friction:g}; '
                                          f'{100 * brake.friction_by_speed:g} % an e-fold of '
                                          f'speed, {100 * brake.friction_by_force:g} % per '
                                          f'{1e-3 * brake.reference_force:g} kN, '
                                          f'{1e4 * brake.friction_by_heat:g}·10⁻⁴ per K'),
    ('run-out', lambda brake: f'±{1e6 * brake.runout:g} µm'),
    ('load cell', lambda brake: f'{100 * (brake.cell_gain - 1):+g} %, '
                                f'{brake.cell_noise:g} N, {brake.cell_cutoff:g} Hz'),
)
