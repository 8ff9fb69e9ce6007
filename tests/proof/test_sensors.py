# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The sensors of drawn recordings: rates, filters and faults are all met, and do what they say."""
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.proof.sensors import draw_sensors, FAULTS, record, Recorded, Sensors
from tests.proof.test_truth_plant import plant_of
from tests.proof.truth_plant import Run, simulate

PLAIN = Sensors(rate=500.0, counts=8192.0, noise=0.002, colour=0.0, jitter=1e-7, lost=0.0, gaps=0,
                doubled=0.0, not_finite=0.0)


@pytest.fixture(scope='module')
def run() -> Run:
    from tests.proof.references import short_test
    return simulate(plant_of(counts=8192.0), short_test(np.random.default_rng(1), plain=True,
                                                        length=8.0))


def taken(run: Run, sensors: Sensors) -> Recorded:
    return record(run, sensors, np.random.default_rng(2))


def test_rates_filters_and_faults_are_all_drawn() -> None:
    rng = np.random.default_rng(5)
    drawn = [draw_sensors(rng) for _ in range(600)]
    assert {one.rate for one in drawn} == {100.0, 125.0, 200.0, 250.0, 500.0, 1000.0}
    slow = [one for one in drawn if one.rate <= 250.0]
    assert np.mean([one.anti_alias for one in slow]) == pytest.approx(0.5, abs=0.15)
    assert {name for one in drawn for name in one.faults} == set(FAULTS)
    assert {one.counts for one in drawn} == {1024.0, 4096.0, 8192.0}
    clean = [draw_sensors(rng, 0.6) for _ in range(300)]
    assert np.mean([one.lost > 0.0 for one in clean]) == pytest.approx(0.6, abs=0.1)
    assert {one.clock for one in clean} == {-1e-4, 0.0, 1e-4}


def test_each_fault_does_what_its_name_says(run: Run) -> None:
    plain = taken(run, PLAIN)
    glitches = taken(run, replace(PLAIN, faults=('glitches',)))
    assert 2 <= np.sum(np.abs(glitches.position - plain.position) > 0.4) <= 9
    spikes = taken(run, replace(PLAIN, faults=('spikes',)))
    assert 2 <= np.sum(np.abs(spikes.effort - plain.effort) > 0.08) <= 12
    lost = taken(run, replace(PLAIN, faults=('bursts_lost',)))
    assert np.diff(np.sort(lost.stamp)).max() > 0.045
    assert np.diff(np.sort(plain.stamp)).max() < 0.01
    clipped = taken(run, replace(PLAIN, faults=('clipped_current',)))
    assert np.abs(clipped.effort).max() < 0.95 * np.abs(plain.effort).max()


def test_a_fast_clock_and_jitter_move_the_stamps(run: Run) -> None:
    fast = np.sort(taken(run, replace(PLAIN, clock=1e-4)).stamp)
    assert fast[-1] / np.sort(taken(run, PLAIN).stamp)[-1] - 1.0 == pytest.approx(1e-4, rel=0.05)
    steps = np.diff(np.sort(taken(run, replace(PLAIN, jitter=1e-4)).stamp))
    assert 0.5e-4 < np.std(steps) < 3e-4
