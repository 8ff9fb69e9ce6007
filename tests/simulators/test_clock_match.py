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


def tones(seed: int, seconds: float = 30.0) -> Recording:
    """Return a motion under a command of tones, of the same kind for any seed."""
    draw = np.random.default_rng(seed)
    time = np.arange(round(seconds * RATE)) / RATE
    wanted = sum(size * np.sin(2.0 * np.pi * rate * time + phase) for rate, size, phase in zip(
        draw.uniform(0.1, 0.4, 3), (9.0, 4.0, 2.0), draw.uniform(0.0, 6.28, 3), strict=True))
    return Recording.from_samples('run', time, wanted, np.zeros(time.size),
                                  reference=Reference(time, wanted))


@pytest.mark.parametrize('commands', [True, False])
def test_commands_of_one_kind_are_not_the_same(commands):
    """Tones at nearby rates are alike for a while, and more than half of their energy with it."""
    runs = [tones(seed) if commands else replace(tones(seed), reference=None)
            for seed in range(12)]
    found = [clock_match(one, other) for number, one in enumerate(runs)
             for other in runs[number + 1:]]
    assert [match for match in found if match is not None] == []
    assert all(clock_match(run, run) is not None for run in runs)


@pytest.mark.parametrize('every', [1, 5, 25])
def test_a_command_that_is_logged_seldom_is_the_same(every):
    whole = tones(3)
    rows = np.arange(0, whole.time.size, every)
    seldom = replace(whole, reference=Reference(whole.time[rows], whole.position[rows]))
    found = clock_match(whole, seldom)
    assert found is not None and found.common > 0.9
    assert found.drift == pytest.approx(0.0, abs=max(4.0 * found.drift_std, 1e-6))


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
