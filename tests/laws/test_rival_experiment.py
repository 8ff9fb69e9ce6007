# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Where several laws do as well, the proposed reference tells them apart."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from engb_core.control.reference import ReferenceSettings, ReferenceSource
from engb_core.diagnose.engine import _proposed
from engb_core.diagnose.hypothesis import Variant
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.effects.law import law_effect
from engb_core.laws.forms import Atom, Form, Slot
from engb_core.laws.judgement import Found
from engb_core.laws.law_search import Candidate
from engb_core.laws.rival_experiment import experiment_between
from engb_core.model import EffectSetting, Model
from engb_core.recording import Recording
from engb_ros.commands.diagnose import EXPERIMENT, write_experiment
from tests.diagnose.simulated_brake import equal_strokes, NOMINAL, recorded

DIRECTION = Atom('direction', 'direction')
# After a reversal something is pushed along: over the way or for a time. Strokes that are all
# alike can't tell which.
WAY = Form('torque', (DIRECTION, Atom('fresh', 'exp(-since_reversal / {0})', (
    Slot('rad', 4.0, 0.01, 20.0, True),))), 0.02)
TIME = Form('torque', (DIRECTION, Atom('fresh in time', 'exp(-time_since_reversal / {0})', (
    Slot('s', 0.3, 0.003, 10.0, True),))), 0.02)
HIDDEN = EffectSetting('law', {'a': 0.03, 'b': 0.3},
                       'a * direction * exp(-time_since_reversal / b)', 'torque',
                       {'velocity': (-40.0, 40.0)})
BRAKE = replace(NOMINAL, effects=(HIDDEN,))


def candidate(fitter: Fitter, base: Fit, form: Form) -> Candidate:
    effect = law_effect(form.formula, 'torque', form.parameters(), {'velocity': (-40.0, 40.0)})
    variant = Variant(effect, tuple(effect.defaults.values()))
    hypothesis = fitter.hypothesis((variant,), base.hypothesis.numbers)
    begun = fitter.evaluate(hypothesis, np.clip(np.concatenate([base.vector, [
        np.log(value) if parameter.logarithmic else value for value, parameter in
        zip(form.starts(), effect.parameters, strict=True)]]), *hypothesis.bounds))
    return Candidate(form, fitter.finish(fitter.refine(begun)), None)


def fitted(recordings: list[Recording], model: Model = NOMINAL) -> tuple[Fitter, list[Candidate]]:
    fitter = Fitter(problem_of(recordings, model), 1)
    base = fitter.finish(fitter.refine(fitter.base()))
    return fitter, [candidate(fitter, base, form) for form in (TIME, WAY)]


def left(fitter: Fitter, law: Candidate) -> float:
    """Return the mean square of what a law leaves (noise = 1)."""
    return float(np.mean((law.fit.residual / fitter.sigma)[fitter.judged] ** 2))


def found(fitter: Fitter, chosen: Candidate, *rivals: Candidate, settled: bool = False) -> Found:
    return Found(fitter, chosen, {}, 0.9, 10.0, 1.0, rivals, settled, np.zeros(0))


@pytest.fixture(scope='module')
def poor() -> Recording:
    strokes = equal_strokes(12.0)
    return recorded(BRAKE, lambda time, _: strokes.at(time), strokes.duration)


@pytest.fixture(scope='module')
def told(poor):
    fitter, (time, way) = fitted([poor])
    return fitter, time, way, experiment_between(found(fitter, time, way))


def test_the_reference_says_which_laws_it_tells_apart(told):
    _, time, way, proposal = told
    assert proposal is not None and proposal.time is not None
    assert len(proposal.discriminates) == 2
    assert 'time_since_reversal' in proposal.discriminates[0]
    assert 'exp(-since_reversal' in proposal.discriminates[1]
    assert all(law in proposal.reason for law in proposal.discriminates)
    assert 'times the noise' in proposal.reason
    assert 'next_experiment.csv' in proposal.reference


def test_it_keeps_within_what_was_recorded(told, poor):
    *_, proposal = told
    assert proposal.time[-1] <= 40.0
    assert poor.position.min() <= proposal.position.min()
    assert proposal.position.max() <= poor.position.max()
    assert np.abs(np.diff(proposal.position)).max() / 0.005 \
        <= np.abs(poor.reference.velocity).max()


def test_the_laws_part_on_it_and_did_not_before(told, poor, tmp_path):
    """Run on the bench, the reference leaves the true law alone; more of the old strokes, as long,
    would not have."""
    fitter, time, way, proposal = told

    write_experiment(tmp_path / EXPERIMENT, proposal)
    source = ReferenceSource(ReferenceSettings('file', str(tmp_path / EXPERIMENT)))

    def apart(*more: Recording) -> float:
        both, (true, false) = fitted([poor, *more])
        rows = both.judged.sum()
        return 0.5 * float(rows) * (left(both, false) - left(both, true))

    strokes = equal_strokes(float(proposal.time[-1]))
    again = recorded(BRAKE, lambda now, _: strokes.at(now), strokes.duration, 'again', seed=7)
    following = recorded(BRAKE, source.at, float(proposal.time[-1]), 'next_experiment', seed=7)
    assert apart(following) > 5.0 * max(apart(again), 10.0)


def test_a_settled_law_and_one_without_rivals_need_none(told):
    fitter, time, way, _ = told
    assert experiment_between(found(fitter, time, way, settled=True)) is None
    assert experiment_between(found(fitter, time)) is None


def test_laws_that_no_motion_tells_apart_are_said_to_be_alike(told):
    """The same law twice: no reference parts them, and the sentence says so."""
    fitter, time, _, _ = told
    proposal = experiment_between(found(fitter, time, time))
    assert proposal is not None and len(proposal.discriminates) == 2
    assert 'they come to nearly the same' in proposal.reason


def test_a_diagnosis_proposes_it(told):
    """Where no name needs an experiment the law that won has its own."""
    fitter, time, way, proposal = told
    outcome = SimpleNamespace(
        fitter=fitter, explanation=SimpleNamespace(fit=time.fit), findings=[],
        selection=SimpleNamespace(rivals=[]), law=SimpleNamespace(found=found(fitter, time, way)))
    assert _proposed(outcome).discriminates == proposal.discriminates
    assert _proposed(SimpleNamespace(**{**vars(outcome), 'law': None})) is None
