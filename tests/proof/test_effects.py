# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Every effect comes out in the size that was asked for, in every formulation."""
from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.proof import cases  # noqa: F401  registers all drawers
from tests.proof.catalogue import Hidden, known
from tests.proof.effects_drive import wave
from tests.proof.effects_friction import stribeck_excess
from tests.proof.hide_friction import presliding_distance
from tests.proof.hide_load import creep_time, hysteresis_ratio
from tests.proof.hide_numbers import LOAD_NUMBERS
from tests.proof.hide_outside import DESCRIBED
from tests.proof.hide_undescribed import UNDESCRIBED
from tests.proof.machines import draw_machine
from tests.proof.nominal import Nominal
from tests.proof.plant_record import blank_plant
from tests.proof.references import disc_profile, DiscProfile, Reference, short_test
from tests.proof.sensors import Sensors
from tests.proof.sizing import Bench, Sizer

TARGET = 2.5
TABLE_4 = {
    'inertia_error', 'viscous_friction_error', 'coulomb_friction_error', 'load_stiffness_error',
    'contact_shift', 'torque_offset', 'load_dependent_friction', 'asymmetric_friction',
    'stribeck_friction', 'presliding_friction', 'nonlinear_viscous_friction', 'friction_drift',
    'cogging_torque', 'torque_ripple', 'torque_saturation', 'actuation_lag', 'backlash',
    'drivetrain_resonance', 'load_hysteresis', 'pad_creep', 'self_energizing',
    'pad_friction_fade', 'disc_runout'}


@pytest.fixture(scope='module')
def scene() -> tuple[Reference, DiscProfile, Sensors]:
    rng = np.random.default_rng(8)
    reference = short_test(rng, plain=False)
    sensors = Sensors(1000.0, 8192.0, 0.0025, 0.0, 1e-7, 0.0, 0, 0.0, 0.0)
    return reference, disc_profile(rng, reference), sensors


def test_catalogue_is_table_4_and_more() -> None:
    names = set(known())
    outside = {name for name in names if name.startswith('outside_')}
    assert names - outside == TABLE_4
    assert outside == set(DESCRIBED) | set(UNDESCRIBED)
    assert len(outside) >= 24
    assert len(UNDESCRIBED) >= 14


def formulations(name: str, draws: int = 40) -> dict[str, Hidden]:
    """One effect of each formulation that comes up."""
    rng = np.random.default_rng(0)
    _, _, base = draw_machine(rng, 'brake')
    drawn = [known()[name](rng, base, 'rich') for _ in range(draws)]
    return {hidden.formulation: hidden for hidden in drawn}


@pytest.mark.parametrize('name', sorted(TABLE_4))
def test_effects_have_two_formulations_but_numbers(name: str) -> None:
    single = name.endswith('_error') or name in ('contact_shift', 'torque_offset')
    assert len(formulations(name)) >= (1 if single else 2)


def test_curves_are_not_those_of_the_library() -> None:
    # What the library could reproduce exactly with its free shapes would prove little.
    x = np.linspace(0.0, 4.0, 81)[1:]
    for kind in (1, 2, 3, 4):
        excess = np.array([stribeck_excess(kind, ratio) for ratio in x])
        best = min(np.abs(excess - np.exp(-x ** shape)).max()
                   for shape in np.linspace(0.6, 2.5, 39))
        assert best > 0.01, kind
    turn = np.linspace(0.0, 2.0 * np.pi, 256, endpoint=False)
    for kind, second in ((1, 0.15), (2, 0.35), (3, 1.0)):
        values = np.array([wave(kind, a, second, 0.4) for a in turn])
        spectrum = np.abs(np.fft.rfft(values))
        assert spectrum[0] < 1e-9 * spectrum[1]
        assert spectrum[3:].max() > 0.01 * spectrum[1], kind


@pytest.mark.parametrize('name', sorted(known()))
def test_size_comes_out_as_asked(name: str, scene: tuple) -> None:
    reference, disc, sensors = scene
    rng = np.random.default_rng(5)
    _, plant, base = draw_machine(rng, 'brake')
    while (base.contact is None) == (name in ('backlash', 'torque_offset')):
        _, plant, base = draw_machine(rng, 'brake')
    plant['saturation'], plant['counts'] = 0.0, 8192.0
    base = replace(base, saturation=0.05)
    hidden = known()[name](rng, base, 'rich')
    bench = Bench((reference,), (disc,), np.ones(2), sensors)
    held = LOAD_NUMBERS if name in ('asymmetric_friction', 'torque_offset') else ()
    magnitude, ratio = Sizer(plant, base, hidden, bench, held).find(TARGET)
    assert hidden.bounds[0] < magnitude < hidden.bounds[1]
    assert ratio == pytest.approx(TARGET, rel=0.12)


def test_a_linear_load_curve_is_shifted_too() -> None:
    line = Nominal(1.0, 0.0, (0.5, 2.0, 0.0, 0.0), None, 0.0, 0.0, 1.0)
    hidden = known()['contact_shift'](np.random.default_rng(1), line, 'strokes')
    shift = hidden.describe(SimpleNamespace(magnitude=0.25))['shift']
    assert hidden.lack(line, 0.25).load == pytest.approx((0.5 + 2.0 * shift, 2.0, 0.0, 0.0))


def test_stribeck_velocity_is_where_the_excess_is_down_to_a_third() -> None:
    for kind in (1, 2, 3, 4):
        assert stribeck_excess(kind, 1.0) == pytest.approx(np.exp(-1.0))


def test_presliding_distance_of_lugre_is_its_bristle_length() -> None:
    plant = blank_plant()
    plant['bristle_kind'], plant['bristle_length'] = 1, 0.3
    plant['slip_length'] = 0.3
    assert presliding_distance(plant) == pytest.approx(0.3, rel=0.02)


def test_creep_time_of_one_element_is_its_own() -> None:
    assert creep_time(np.array([0.2]), np.array([1.7])) == pytest.approx(1.7, rel=1e-3)


def test_hysteresis_of_play_vanishes_without_radius() -> None:
    plant = blank_plant()
    plant['load'] = (0.0, 2e-3, 1e-4, 2e-6)
    plant['hyst_kind'], plant['play_weight'] = 2, 0.2
    plant['play_radius'], plant['hyst'] = 1.0, 1e-9
    assert hysteresis_ratio(plant, 30.0) < 1e-6
    plant['hyst'] = 1.0
    assert hysteresis_ratio(plant, 30.0) > 0.01
