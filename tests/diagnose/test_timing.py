# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Torque and effort that are apart by less than a sample are told, with what it may be."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.diagnosis import Timing
from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.timing import later_than_sampled, timing_of
from engb_core.effects.catalogue import get_effect
from engb_core.model import Model
from engb_core.recording import Recording

from .simulated_brake import brake_with, lively, NOMINAL

# The simulated bench tells the effort of the step before, that much of a sample too early.
EARLY = 0.94


def apart(parts: float, brake: Model = NOMINAL) -> Recording:
    """Return a recording whose effort is that of so many samples later than its position."""
    recording = lively(brake, seed=3)
    step = float(np.median(np.diff(recording.time)))
    return replace(recording, effort=np.interp(
        recording.time + (EARLY + parts) * step, recording.time, recording.effort))


def told(recording: Recording) -> Timing | None:
    fitter = Fitter(problem_of([recording], NOMINAL))
    return timing_of(fitter, fitter.finish(fitter.base()))


@pytest.mark.parametrize(('parts', 'cause'), [
    (0.55, 'actuation_lag'), (-0.4, 'effort_measurement_lag')])
def test_less_than_a_sample_is_told_with_its_causes(parts, cause):
    recording = apart(parts)
    timing = told(recording)
    assert timing is not None
    step = float(np.median(np.diff(recording.time)))
    assert timing.delay.value == pytest.approx(parts * step, abs=3.0 * timing.delay.std)
    assert np.sign(timing.delay.value) == np.sign(parts)
    assert timing.causes == (cause, 'sampling_delay')
    assert not timing.at_bound
    assert 'do not tell which' in timing.statement


def test_what_is_not_apart_is_not_told():
    assert told(apart(0.0)) is None


@pytest.mark.parametrize(('parts', 'late'), [(-0.8, False), (0.4, False), (1.3, True)])
def test_more_than_half_a_sample_is_later_than_samples_are_apart(parts, late):
    fitter = Fitter(problem_of([apart(parts)], NOMINAL))
    assert later_than_sampled(fitter, fitter.base()) == late


def test_a_lag_of_about_a_sample_has_its_name():
    recording = apart(1.3)
    found = diagnose([recording], NOMINAL)
    assert [finding.effect for finding in found.effects] == ['actuation_lag']
    step = float(np.median(np.diff(recording.time)))
    assert found.effects[0].parameters['lag'].value == pytest.approx(1.3 * step, abs=0.4 * step)
    assert found.effects[0].probability > 0.8


def test_more_than_half_a_sample_is_told_as_the_least():
    timing = told(apart(1.3))
    assert timing is not None
    assert timing.at_bound
    assert 'at least' in timing.statement


def test_beside_a_lag_nothing_more_is_told():
    fitter = Fitter(problem_of([apart(1.3)], NOMINAL))
    variant = variants_of(get_effect('actuation_lag'), fitter.problem.scene)[0]
    assert timing_of(fitter, fitter.finish(fitter.refine(fitter.fit(variant, keep=2)))) is None


@pytest.mark.slow
@pytest.mark.parametrize('parts', [0.0, 0.55])
def test_nothing_is_missing_where_samples_are_apart_but_the_model_predicts_better_with_it(parts):
    said = diagnose([apart(parts)], NOMINAL)
    assert said.verdict == 'consistent' and not said.effects
    effort = said.held_out[0]
    if not parts:
        assert said.timing is None and said.model == NOMINAL
        return
    assert said.timing is not None
    assert [entry.effect for entry in said.model.effects] == ['sampling_delay']
    assert effort.rms_after < 0.95 * effort.rms_before


@pytest.mark.slow
def test_it_is_told_beside_what_is_missing():
    said = diagnose([apart(0.55, brake_with('asymmetric_friction', asymmetry=0.3))], NOMINAL)
    assert said.effects[0].effect == 'asymmetric_friction'
    assert said.timing is not None
    assert said.timing.causes == ('actuation_lag', 'sampling_delay')
