# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A current sensor that reads nothing around zero, and too little elsewhere: no saturation."""

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.recording import Recording

from .simulated_brake import lively, NOMINAL

UNREAD = 0.02   # [N·m]


@pytest.fixture(scope='module')
def diagnosis():
    clean = lively(NOMINAL)
    read = np.sign(clean.effort) * np.maximum(np.abs(clean.effort) - UNREAD, 0.0)
    assert 0.01 < np.mean(read == 0.0) < 0.5, 'some of it is not read, most is'
    return diagnose([Recording.from_samples('run', clean.time, clean.position, read,
                                            clean.velocity)], NOMINAL)


def test_no_name_is_given_to_it(diagnosis):
    """It had been saturation from next to no effort on, with numbers that make up for it."""
    assert not [entry.effect for entry in diagnosis.effects if entry.probability >= 0.5]


def test_it_is_told_what_it_depends_on(diagnosis):
    assert diagnosis.unexplained is not None
    assert 'effort' in diagnosis.unexplained.depends_on


def test_the_corrected_model_predicts_it(diagnosis):
    effort = next(entry for entry in diagnosis.held_out if entry.quantity == 'effort')
    assert effort.rms_after < 0.3 * effort.rms_before
