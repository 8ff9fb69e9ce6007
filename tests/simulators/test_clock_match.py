# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Offset and drift between a simulator's clock and a recorder's, and whether there is one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engb_core.recording import Recording, Reference
from engb_core.simulated.clock_match import clock_match
from tests.core.bench import strokes

RATE = 500.0


def recorded(tops: tuple[float, ...], offset: float = 0.0, drift: float = 0.0, late: int = 0,
             noise: float = 0.0, commands: bool = True, seed: int = 1) -> Recording:
    """Return a motion that follows strokes 4 ms late, on a clock with offset and drift."""
    wanted = strokes(tops, RATE)
    time = np.arange(wanted.size) / RATE
    draw = np.random.default_rng(seed)
    place = np.interp(time - 0.004, time, wanted) + draw.normal(0.0, noise, time.size)
    clock = 50.0 + offset + (1.0 + drift) * time
    return Recording.from_samples(
        'run', clock[late:], place[late:], np.gradient(np.gradient(place))[late:] * 1e-3,
        reference=Reference(clock, wanted) if commands else None)


TOPS = (20.0, 12.0, 18.0, 8.0)


@pytest.mark.parametrize('commands', [True, False])
@pytest.mark.parametrize(('offset', 'drift', 'late'), [
    (0.0, 0.0, 0), (0.37, 2e-4, 40), (-0.213, -3e-4, 0), (0.05, 4e-3, 300)])
def test_offset_and_drift_are_found(offset, drift, late, commands):
    simulated = recorded(TOPS, commands=commands)
    real = recorded(TOPS, offset, drift, late, 2e-3, commands)
    found = clock_match(real, simulated)
    # Both count from their first sample.
    truth = -(1.0 + drift) * late / RATE
    assert found.offset == pytest.approx(truth, abs=max(4.0 * found.offset_std, 1e-5))
    assert found.drift == pytest.approx(drift, abs=max(4.0 * found.drift_std, 1e-7))
    assert found.offset_std < 2e-3 and found.drift_std < 1e-4
    assert found.common > 0.9 and found.of_commands == commands


def test_other_commands_have_no_common_clock():
    for seed in range(6):
        tops = np.random.default_rng(seed).uniform(6.0, 22.0, (2, 5))
        assert clock_match(recorded(tuple(tops[0])), recorded(tuple(tops[1]))) is None


def test_what_stands_still_has_none_either():
    still = recorded(TOPS)
    still = replace(still, position=np.zeros(still.time.size), reference=None)
    assert clock_match(still, recorded(TOPS)) is None


def test_a_stretch_of_the_simulation_is_enough():
    whole = recorded(TOPS, commands=False)
    part = recorded(TOPS, 0.1, 1e-4, 900, 2e-3, commands=False)
    found = clock_match(part, whole)
    assert found.offset == pytest.approx(-(1.0 + 1e-4) * 1.8, abs=4.0 * found.offset_std)


def test_the_sentence_names_both_and_the_units():
    found = clock_match(recorded(TOPS, 0.2, 1e-4, 20, 1e-3), recorded(TOPS))
    said = found.statement('bench', 'model', 'm', 'N')
    assert 'bench' in said and 'model' in said and 'same commands' in said
    assert said.endswith('N rms.') and '+100 ±' in said
