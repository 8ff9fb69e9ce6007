# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A name has to help on what no fit has seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.evidence import pooled, unseen_errors
from engb_core.diagnose.problem import problem_of
from engb_core.model import Cogging
from engb_core.recording import Recording

from .simulated_brake import lively, NOMINAL


def with_slots(recording: Recording, only_where_fitted: bool) -> Recording:
    """Return the recording with a cogging torque added; perhaps only to what a fit may see."""
    run = problem_of([recording], NOMINAL).runs[0]
    seen = np.interp(recording.time, run.motion.time[run.comparison.grid], run.fitted) > 0.5
    moving = np.abs(np.interp(recording.time, run.motion.time, run.motion.velocity)) > 0.3
    where = moving & (seen | (not only_where_fitted))
    return replace(recording, effort=recording.effort + np.where(
        where, 0.01 * np.sin(3.0 * recording.position), 0.0))


@pytest.mark.parametrize('only_where_fitted', [True, False])
def test_what_does_not_carry_over_has_no_name(only_where_fitted):
    found = diagnose([with_slots(lively(NOMINAL), only_where_fitted)], NOMINAL)
    if only_where_fitted:
        assert found.verdict == 'unexplained'
        assert not found.effects
        assert 'cogging_torque would come nearest' in found.unexplained.statement
        assert 'kept out of the fit is no better' in found.unexplained.statement
    else:
        assert found.effects[0].effect == 'cogging_torque'


def test_what_helps_on_most_of_what_was_kept_has_its_name():
    """In one stretch of these it acts the other way, and outweighs the others."""
    recording = with_slots(lively(NOMINAL), only_where_fitted=False)
    run = problem_of([recording], NOMINAL).runs[0]
    ends = np.flatnonzero(np.diff(run.fitted)) + 1
    kept = [part for part in np.split(np.arange(run.fitted.size), ends) if not run.fitted[part[0]]]
    grid = run.motion.time[run.comparison.grid]
    odd = (recording.time >= grid[kept[1][0]]) & (recording.time <= grid[kept[1][-1]])
    moving = np.abs(np.interp(recording.time, run.motion.time, run.motion.velocity)) > 0.3
    recording = replace(recording, effort=recording.effort - np.where(
        odd & moving, 0.03 * np.sin(3.0 * recording.position), 0.0))
    problem = problem_of([recording], NOMINAL)
    slots = replace(NOMINAL, cogging=(Cogging(3.0, 0.01),))
    after, before = (unseen_errors(problem, model) for model in (slots, NOMINAL))
    assert pooled(after) > pooled(before)
    assert len(after) == len(before) == len(kept)
    assert np.median([pooled([now]) / pooled([then])
                      for now, then in zip(after, before, strict=True)]) < 0.5
    found = diagnose([recording], NOMINAL)
    assert found.effects[0].effect == 'cogging_torque'
