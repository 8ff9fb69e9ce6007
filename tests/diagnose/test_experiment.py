# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The next experiment: a reference that tells apart what a recording could not."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.control.reference import ReferenceSettings, ReferenceSource
from engb_core.control.trajectory import file_reference
from engb_core.diagnose.diagnosis import EffectFinding
from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.experiment.next_experiment import next_experiment
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.onset import Onset
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.effects.catalogue import get_effect
from engb_core.recording import Signal
from engb_ros.commands.diagnose import EXPERIMENT, write_results

from .simulated_brake import brake_with, equal_strokes, NOMINAL, recorded


def finding(effect, **alternatives):
    return EffectFinding(effect, 0.5, {}, 1.0, tuple(alternatives.items()), '')


def fitted(fitter, effect):
    variant = variants_of(get_effect(effect), fitter.problem.scene)[0]
    return fitter.fit(variant, rounds=8)


def proposal_for(recording, chosen, rivals, model=NOMINAL):
    fitter = Fitter(problem_of([recording], model))
    return next_experiment(
        fitter, fitter.finish(fitted(fitter, chosen)),
        [finding(chosen, **dict.fromkeys(rivals, 0.3))],
        [fitted(fitter, rival) for rival in rivals])


@pytest.fixture(scope='module')
def strokes():
    trajectory = equal_strokes(8.0)
    brake = brake_with('presliding_friction', presliding_distance=0.4)
    return recorded(brake, lambda time, _: trajectory.at(time), trajectory.duration)


@pytest.mark.parametrize('findings', [
    [], [finding('backlash')], [finding('backlash', presliding_friction=0.1)]])
def test_what_is_told_apart_needs_no_experiment(findings):
    assert next_experiment(None, None, findings, []) is None


def test_the_reference_keeps_within_what_was_recorded(strokes):
    proposal = proposal_for(strokes, 'presliding_friction', ['backlash', 'load_hysteresis'])
    assert proposal.discriminates == ('presliding_friction', 'backlash', 'load_hysteresis')
    for words in ('presliding friction', 'backlash', 'load hysteresis', 'times the noise'):
        assert words in proposal.reason.lower()
    assert 'next_experiment.csv' in proposal.reference
    time, position = proposal.time, proposal.position
    assert np.allclose(np.diff(time), 0.005)
    assert 15.0 < time[-1] <= 40.0
    assert position.min() >= strokes.position.min()
    assert position.max() <= strokes.position.max()
    speed = np.diff(position) / 0.005
    recorded_speed = np.abs(strokes.reference.velocity).max()
    assert np.abs(speed).max() <= recorded_speed
    assert np.abs(np.diff(speed) / 0.005).max() <= 80.0 * 1.02
    assert not speed[:20].any()
    assert not speed[-20:].any()
    assert abs(position[0] - strokes.position[0]) < 0.01
    assert abs(position[-1] - position[0]) < 1e-9


def test_what_began_within_one_of_several_recordings_acts_throughout_the_next(strokes):
    """The onsets of two recordings were held against the one that is planned: a fault."""
    fitter = Fitter(problem_of([strokes, replace(strokes, name='second')], NOMINAL))
    variant = variants_of(get_effect('presliding_friction'), fitter.problem.scene)[0]
    begun = fitter.fit(replace(variant, onset=Onset((np.inf, 3.0))), rounds=2, keep=1)
    rival = fitter.fit(variants_of(get_effect('friction_drift'), fitter.problem.scene)[0],
                       rounds=2, keep=1)
    proposal = next_experiment(fitter, begun,
                               [finding('presliding_friction', friction_drift=0.3)], [rival])
    assert proposal.discriminates == ('presliding_friction', 'friction_drift')
    assert proposal.time is not None


def test_what_drifts_is_repeated_early_and_late(strokes):
    proposal = proposal_for(strokes, 'friction_drift', ['presliding_friction'])
    assert 'once more' in proposal.reference
    assert proposal.time[-1] <= 40.0


def test_the_disc_is_asked_for_in_words(strokes):
    disc = Signal(strokes.time, np.where(strokes.time < 4.0, 0.0, 50.0))
    proposal = proposal_for(replace(strokes, signals={'disc_speed': disc}), 'self_energizing',
                            ['pad_creep'])
    assert 'with the disc standing and with the disc turning at 50 rad/s' in proposal.reference


def test_a_model_without_controller_gets_one(strokes):
    proposal = proposal_for(strokes, 'presliding_friction', ['backlash'],
                            replace(NOMINAL, controller=None))
    assert proposal.position is not None


def test_an_alternative_without_a_fit_is_still_told(strokes):
    fitter = Fitter(problem_of([strokes], NOMINAL))
    proposal = next_experiment(fitter, fitted(fitter, 'backlash'),
                               [finding('backlash', presliding_friction=0.2)], [])
    assert proposal.discriminates == ('backlash', 'presliding_friction')
    assert proposal.time is None
    assert 'reversals' in proposal.reference


def test_the_experiment_settles_what_a_poor_recording_left_open(tmp_path):
    """All strokes alike, and the file's friction 4 % off, so that none of the rivals stands with
    the file's numbers: a contact elsewhere is as likely as asymmetric friction. The proposed
    reference, run from its file in the loop, tells them apart."""
    model = replace(NOMINAL, friction=replace(NOMINAL.friction,
                                              coulomb=1.04 * NOMINAL.friction.coulomb))
    brake = brake_with('asymmetric_friction', asymmetry=0.15)
    poor = equal_strokes(8.0)
    first = recorded(brake, lambda time, _: poor.at(time), poor.duration)
    before = diagnose([first], model)
    rivals = dict(before.effects[0].alternatives)
    assert max(rivals.values()) > 0.1
    assert before.effects[0].probability < 0.8
    assert 'asymmetric_friction' in (before.effects[0].effect, *rivals)
    assert before.effects[0].effect in before.next_experiment.discriminates
    assert len(before.next_experiment.discriminates) > 1

    write_results(tmp_path, before)
    path = tmp_path / EXPERIMENT
    length = file_reference(path).duration
    assert length == pytest.approx(before.next_experiment.time[-1], abs=1e-3)
    source = ReferenceSource(ReferenceSettings('file', str(path)))
    second = recorded(brake, source.at, length + 0.5, 'next_experiment', seed=7)
    assert source.finished
    assert np.abs(second.effort).max() < 1.2 * np.abs(first.effort).max()

    after = diagnose([first, second], model)
    assert [entry.effect for entry in after.effects] == ['asymmetric_friction']
    assert all(probability < 0.1 for _, probability in after.effects[0].alternatives)
    assert after.next_experiment is None
