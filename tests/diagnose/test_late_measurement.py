# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Effort that is recorded later than the torque: told, and told from torque that comes late."""

import pytest

from engb_core.bench.sensors import SensorSettings
from engb_core.bench.virtual_brake import VirtualBrake
from engb_core.diagnose.engine import diagnose
from engb_core.model import Friction, LoadTorque, Model
from tests.diagnose.simulated_brake import brake_with, lively, NOMINAL

QUIET = SensorSettings(effort_noise=0.0, effort_resolution=0.0)


def test_the_simulated_bench_records_effort_late():
    bench = VirtualBrake(brake_with('effort_measurement_lag', lag=0.05), sensors=QUIET)
    plain = VirtualBrake(NOMINAL, sensors=QUIET)
    told = []
    for brake in (bench, plain):
        for _ in range(50):
            brake.command(0.1)
            seen = brake.advance()
        told.append((seen.position, seen.effort))
    assert told[0][0] == told[1][0]
    assert told[1][1] == 0.1
    # After one time constant.
    assert told[0][1] == pytest.approx(0.1 * (1.0 - 2.718281828 ** -1.0), rel=1e-6)


@pytest.mark.slow
def test_it_is_named_with_its_time():
    found = diagnose([lively(brake_with('effort_measurement_lag', lag=0.03))], NOMINAL)
    told = {entry.effect: entry for entry in found.effects if entry.probability >= 0.5}
    assert set(told) == {'effort_measurement_lag'}
    assert told['effort_measurement_lag'].parameters['lag'].value == pytest.approx(0.03, rel=0.1)


@pytest.mark.slow
def test_late_torque_is_not_taken_for_it():
    found = diagnose([lively(brake_with('actuation_lag', lag=0.006))], NOMINAL)
    assert [entry.effect for entry in found.effects if entry.probability >= 0.5] \
        == ['actuation_lag']


def test_a_model_without_it_measures_at_once():
    bench = VirtualBrake(Model(load_torque=LoadTorque(), friction=Friction()), sensors=QUIET)
    bench.command(0.2)
    assert bench.advance().effort == 0.2
