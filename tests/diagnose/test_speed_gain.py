# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A drive that gives less torque per effort the faster it turns: no drag, and no saturation."""

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.recording import Recording

from .simulated_brake import lively, NOMINAL

# The field angle lags by so many radians per rad/s: what is left of the torque is the cosine.
BEHIND = 0.012


@pytest.fixture(scope='module')
def diagnosis():
    clean = lively(NOMINAL)
    given = np.cos(BEHIND * clean.velocity)
    assert 0.6 < given.min() < 0.95, 'the drive shows it, and still turns'
    return diagnose([Recording.from_samples('run', clean.time, clean.position,
                                            clean.effort / given, clean.velocity)], NOMINAL)


def test_no_name_is_given_to_it(diagnosis):
    assert not [entry.effect for entry in diagnosis.effects if entry.probability >= 0.5]


def test_it_is_told_what_it_depends_on(diagnosis):
    assert diagnosis.unexplained is not None
    assert set(diagnosis.unexplained.depends_on) == {'velocity', 'effort'} \
        or diagnosis.unexplained.depends_on == ('velocity',)


def test_the_corrected_model_predicts_it(diagnosis):
    effort = next(entry for entry in diagnosis.held_out if entry.quantity == 'effort')
    assert effort.rms_after < 0.3 * effort.rms_before
