# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A wave that hardly repeats along the stroke is one if its order is a whole number."""

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.waves import _beside_chance
from engb_core.recording import Recording

from .simulated_brake import lively, NOMINAL


@pytest.fixture(scope='module')
def clean() -> Recording:
    return lively(NOMINAL)


def with_wave(clean: Recording, order: float) -> Recording:
    """Return the recording with a wave that comes about three times along the stroke."""
    wave = 0.01 * (np.sin(order * clean.position + 0.7) + 0.2 * np.sin(2 * order * clean.position))
    return Recording.from_samples('run', clean.time, clean.position, clean.effort + wave,
                                  clean.velocity)


@pytest.mark.parametrize(('order', 'named'), [(1.0, True), (1.31, False)])
def test_a_slow_wave_of_whole_order_is_named(clean, order, named):
    turns = np.ptp(clean.position) / (2.0 * np.pi)
    assert turns * order < 5.0
    diagnosis = diagnose([with_wave(clean, order)], NOMINAL)
    said = {entry.effect: entry.probability for entry in diagnosis.effects}
    assert (said.get('cogging_torque', 0.0) > 2.0 / 3.0) == named


@pytest.mark.parametrize(('order', 'deviation', 'times'), [
    (6.01, 0.01, 25.0), (6.03, 0.01, 1.0), (0.7, 0.1, 1.0), (1.0, 0.5, 1.0)])
def test_a_whole_order_counts_for_as_much_as_it_is_rare_by_chance(order, deviation, times):
    assert _beside_chance(order, deviation) == pytest.approx(times)
