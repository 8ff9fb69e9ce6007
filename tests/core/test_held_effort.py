# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A current that is polled on a slow cycle, beside a position on a fast one."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.identify.first_model import first_model
from engb_core.model import Friction, Model, Motor
from engb_core.recording import Recording
from engb_core.signals.data_faults import cleaned
from engb_core.signals.held_effort import effort_as_taken, effort_taken

TIME = np.arange(2400) * 0.0125
ANGLE = 1.2 * np.sin(2.0 * np.pi * 0.31 * TIME) + 0.3 * np.sin(2.0 * np.pi * 0.83 * TIME + 1.0)
SPEED = np.gradient(ANGLE, TIME)
TRUE = {'inertia': 0.012, 'viscous_friction': 0.09, 'coulomb': 0.5}


def polled(every: int, seed: int = 3, turned: float = 1.0) -> Recording:
    effort = (TRUE['inertia'] * np.gradient(SPEED, TIME) + TRUE['viscous_friction'] * SPEED
              + TRUE['coulomb'] * np.sign(SPEED))
    effort = turned * np.round(effort + np.random.default_rng(seed).normal(
        0.0, 0.02, TIME.size), 2)
    taken = np.arange(TIME.size) // every * every
    return Recording('log', TIME, np.round(ANGLE, 3), effort[taken])


def test_what_is_polled_is_told_from_what_is_measured():
    found = effort_taken(polled(8))
    assert found is not None
    assert np.all(found % 8 == 0)
    assert effort_taken(polled(1)) is None


def test_coarse_counts_of_a_slow_effort_are_no_poll():
    """They leave for the next count whenever it is nearer."""
    slow = replace(polled(1), effort=np.round(0.02 * ANGLE, 3))
    assert effort_taken(slow) is None
    assert effort_as_taken(slow) is slow


def test_a_clock_of_its_own():
    """The poll falls into seven samples or eight."""
    recording = polled(1)
    taken = np.searchsorted(TIME, np.floor(TIME / 0.0953) * 0.0953)
    assert effort_taken(replace(recording, effort=recording.effort[taken])) is not None


@pytest.mark.parametrize('every', [3, 8])
def test_a_first_model_of_a_polled_current(every):
    found = first_model([polled(every)])
    assert found.numbers['coulomb'].value == pytest.approx(TRUE['coulomb'], rel=0.1)
    assert found.numbers['viscous_friction'].value == pytest.approx(
        TRUE['viscous_friction'], rel=0.25)
    assert any(f'taken every {12.5 * every:.3g} ms' in line for line in found.not_told)


def test_it_is_told_and_no_physics_is_missing():
    model = Model(motor=Motor(inertia=TRUE['inertia'],
                              viscous_friction=TRUE['viscous_friction']),
                  friction=Friction(TRUE['coulomb'], 0.0, 0.01))
    recording = polled(8)
    assert [entry.fault for entry in cleaned(recording, model)[1]] == ['held_effort']
    found = diagnose([recording], model)
    assert found.verdict == 'consistent'
    assert [entry.fault for entry in found.data_faults] == ['held_effort']


def test_missing_friction_is_named_from_a_polled_current():
    model = Model(motor=Motor(inertia=TRUE['inertia'],
                              viscous_friction=TRUE['viscous_friction']),
                  friction=Friction(0.6 * TRUE['coulomb'], 0.0, 0.01))
    found = diagnose([polled(8)], model)
    assert found.effects[0].effect == 'coulomb_friction_error'
    assert found.effects[0].parameters['coulomb'].value == pytest.approx(
        TRUE['coulomb'], rel=0.1)
