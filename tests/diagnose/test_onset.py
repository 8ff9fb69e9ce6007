# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Effects that begin within the recordings: told with their time, and only where there are any."""

from dataclasses import replace
import json
import math
from pathlib import Path
from types import SimpleNamespace

import jsonschema
import numpy as np
import pytest

from engb_core.diagnose import onset_search
from engb_core.diagnose.diagnosis import EffectFinding
from engb_core.diagnose.document import to_document
from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.evidence import unseen_errors
from engb_core.diagnose.full_bandwidth import CorrectedModels, explained_problem
from engb_core.diagnose.hypothesis import Variant, variants_of
from engb_core.diagnose.nameless import without_what_passes_once
from engb_core.diagnose.onset import LEAST_VALUES, Onset, onsets_tried, OnsetScreen
from engb_core.diagnose.onset_search import _complexity, with_onset
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.score.reduced_chi_square import excess
from engb_core.diagnose.selection import Selection
from engb_core.diagnose.unknown.openset import Explanation
from engb_core.effects.catalogue import catalogue, get_effect
from engb_core.model import EffectSetting
from engb_core.recording import Recording

from .simulated_brake import brake_with, lively, NOMINAL

SCHEMA = Path(__file__).resolve().parents[2] / 'docs' / 'diagnosis.schema.json'
BEGINS = 5.2
OFFSET = 0.03


def with_effort(recording: Recording, effort: np.ndarray, name: str = 'run') -> Recording:
    return Recording.from_samples(name, recording.time, recording.position, effort,
                                  recording.velocity)


@pytest.fixture(scope='module')
def clean() -> Recording:
    return lively(NOMINAL)


@pytest.fixture(scope='module')
def slipped(clean) -> Recording:
    """A current sensor whose zero jumps."""
    return with_effort(clean, clean.effort + np.where(clean.time >= BEGINS, OFFSET, 0.0))


@pytest.fixture(scope='module')
def diagnosis(slipped):
    return diagnose([slipped], NOMINAL)


def test_an_effect_that_begins_is_told_with_its_time(diagnosis):
    first = diagnosis.effects[0]
    assert first.effect == 'torque_offset'
    assert first.onset is not None
    assert first.onset[0] == 'run'
    assert first.onset[1] == pytest.approx(BEGINS, abs=0.1)
    assert abs(first.parameters['offset'].value) == pytest.approx(OFFSET, rel=0.05)
    assert first.statement.startswith('From 5.')


def test_the_corrected_model_holds_it_throughout_and_is_judged_from_its_begin_on(
        diagnosis, slipped, clean):
    assert 'torque_offset' in [entry.effect for entry in diagnosis.model.effects]
    effort = next(entry for entry in diagnosis.held_out if entry.quantity == 'effort')
    without_it = np.concatenate(unseen_errors(problem_of([clean], NOMINAL), NOMINAL))
    assert effort.rms_after < 1.1 * np.sqrt(np.mean(without_it ** 2))
    # Judged as if it acted from the first sample on, the model would be far off.
    throughout = unseen_errors(problem_of([slipped], NOMINAL), diagnosis.model)
    assert np.sqrt(np.mean(np.concatenate(throughout) ** 2)) > 3.0 * effort.rms_after


def test_the_document_has_the_onset(diagnosis):
    document = to_document(diagnosis)
    jsonschema.validate(document, json.loads(SCHEMA.read_text()))
    onset = document['effects'][0]['onset']
    assert onset['recording'] == 'run'
    assert onset['time'] == pytest.approx(BEGINS, abs=0.1)


def test_mismatch_is_located_after_the_onset(diagnosis):
    assert diagnosis.time
    assert min(entry.begin for entry in diagnosis.time) > BEGINS - 0.2


def test_two_things_that_change_at_one_moment_are_both_told(clean):
    """A blow: beside the first one something without a name had been told."""
    more = OFFSET + 0.015 * np.sin(6.0 * clean.position)
    found = diagnose([with_effort(clean, clean.effort + np.where(
        clean.time >= BEGINS, more, 0.0))], NOMINAL)
    begins = {entry.effect: entry.onset for entry in found.effects if entry.probability >= 0.5}
    assert set(begins) == {'torque_offset', 'cogging_torque'}
    assert all(onset[1] == pytest.approx(BEGINS, abs=0.1) for onset in begins.values())


def test_what_begins_later_is_no_second_thing_of_one_moment(clean):
    """Of what grows slowly any two steps at two moments take away the most."""
    fitter = Fitter(problem_of([clean], NOMINAL))
    variants = tuple(
        replace(variants_of(get_effect(name), fitter.problem.scene)[0],
                onset=Onset(begins=(begin,)))
        for name, begin in (('torque_offset', BEGINS), ('torque_saturation', BEGINS + 1.0)))
    hypothesis = fitter.hypothesis(variants)
    fit = fitter.evaluate(hypothesis, np.concatenate([
        hypothesis.start_of_numbers(), [0.01], [0.1, 0.5, 0.2]]))
    found = onset_search._at_one_moment(fitter, fit)
    assert [onset.begins for _, onset in found.hypothesis.onsets] == [(BEGINS,)] * 2
    assert onset_search._at_one_moment(fitter, found) is found


def test_a_wave_that_begins(clean):
    wave = np.where(clean.time >= 4.0, 0.012 * np.sin(6.0 * clean.position + 0.4), 0.0)
    found = diagnose([with_effort(clean, clean.effort + wave)], NOMINAL)
    assert found.effects[0].effect == 'cogging_torque'
    assert found.effects[0].onset is not None
    assert found.effects[0].onset[1] == pytest.approx(4.0, abs=0.15)


@pytest.mark.parametrize(('effect', 'parameters'), [
    ('cogging_torque', {'amplitude': 0.012, 'order': 6.0, 'phase': 0.3}),
    ('asymmetric_friction', {'asymmetry': 0.4})])
def test_what_acts_throughout_has_no_onset(effect, parameters):
    found = diagnose([lively(brake_with(effect, **parameters))], NOMINAL)
    assert found.effects[0].effect == effect
    assert found.effects[0].onset is None


def test_of_two_recordings_only_the_second_has_it(clean, slipped):
    later = with_effort(slipped, slipped.effort, 'later')
    found = diagnose([clean, later], NOMINAL)
    assert found.effects[0].effect == 'torque_offset'
    assert found.effects[0].onset is not None
    recording, time = found.effects[0].onset
    assert (recording, time) == ('later', pytest.approx(BEGINS, abs=0.1))


def test_friction_that_jumps_has_jumped_from_the_first_sample_on_in_the_corrected_model(clean):
    """What grows over the recording and begins in its middle can't be told from what is there at
    once, as far as this recording goes; in any other it would grow again."""
    friction = NOMINAL.friction
    load = np.polynomial.Polynomial(NOMINAL.load_torque.coefficients)(clean.position)
    level = friction.coulomb + friction.load_gain * np.abs(load)
    sliding = np.clip(clean.velocity / friction.saturation_velocity, -1.0, 1.0)
    jump = np.where(clean.time >= BEGINS, 0.5 * level * sliding, 0.0)
    fitter = Fitter(problem_of([with_effort(clean, clean.effort + jump)], NOMINAL))
    base = fitter.base()
    (variant,) = variants_of(get_effect('friction_drift'), fitter.problem.scene)
    drifts = fitter.refine(fitter.evaluate(
        fitter.hypothesis((variant,), base.hypothesis.numbers),
        np.array([*base.vector, 1.5, np.log(0.5), np.log(5.0)])))
    whole = excess(base, fitter)
    found = with_onset(fitter, Selection(drifts, (), whole, whole, excess(drifts, fitter)))
    (begun,) = found.chosen.hypothesis.variants
    assert begun.onset is not None
    assert [entry.name for entry in begun.effect.parameters] == ['friction_ratio']
    assert found.chosen.vector[-1] == pytest.approx(1.5, abs=0.1)


@pytest.mark.parametrize(('settling', 'shape', 'sudden'), [
    (0.5, 5.0, True), (0.5, 1.0, False), (20.0, 1.0, False)])
def test_a_drift_as_steep_as_it_can_be_is_a_change_at_one_moment(clean, settling, shape, sudden):
    """It claims as much as an effect with an onset; one that never settles is a slow one."""
    fitter = Fitter(problem_of([clean], NOMINAL))
    base = fitter.base()
    (variant,) = variants_of(get_effect('friction_drift'), fitter.problem.scene)
    drifts = fitter.evaluate(fitter.hypothesis((variant,), base.hypothesis.numbers), np.array(
        [*base.vector, 1.5, np.log(settling), np.log(shape)]))
    assert _complexity(drifts) == (2 if sudden else 1)


def test_coulomb_friction_that_jumps_is_told_as_such(clean):
    """What rubs in proportion to the load stays: neither all of the friction nor drag changes."""
    # 0.5 rad/s of saturation, as in the nominal model.
    rubs = 0.02 * np.clip(clean.velocity / 0.5, -1.0, 1.0)
    jumped = with_effort(clean, clean.effort + np.where(clean.time >= BEGINS, rubs, 0.0))
    first = diagnose([jumped], NOMINAL).effects[0]
    assert first.effect == 'coulomb_friction_error'
    assert first.probability > 0.5
    assert first.onset[1] == pytest.approx(BEGINS, abs=0.2)
    assert first.parameters['coulomb'].value == pytest.approx(0.032, abs=0.003)


@pytest.mark.parametrize('in_file', [NOMINAL.friction.load_gain, 0.0])
def test_friction_per_load_that_jumps_is_told_as_such(in_file):
    """A screw that runs dry: what rubs whatever the load stays."""
    nominal = replace(NOMINAL, friction=replace(NOMINAL.friction, load_gain=in_file))
    clean = lively(nominal)
    load = np.polynomial.Polynomial(NOMINAL.load_torque.coefficients)(clean.position)
    rubs = 0.08 * np.abs(load) * np.clip(clean.velocity / NOMINAL.friction.saturation_velocity,
                                         -1.0, 1.0)
    jumped = with_effort(clean, clean.effort + np.where(clean.time >= BEGINS, rubs, 0.0))
    first = diagnose([jumped], nominal).effects[0]
    assert first.effect == 'load_dependent_friction'
    assert first.probability > 0.5
    assert first.onset[1] == pytest.approx(BEGINS, abs=0.2)
    assert first.parameters['load_gain'].value == pytest.approx(in_file + 0.08, abs=0.01)


@pytest.mark.parametrize(('effect', 'name', 'more'), [
    ('inertia_error', 'inertia', 1.0), ('viscous_friction_error', 'viscous_friction', 1.5)])
def test_an_inertia_and_a_drag_that_jump_are_told_as_such(clean, effect, name, more):
    """A payload that is picked up, a lubricant that is gone."""
    nominal = getattr(NOMINAL.motor, name)
    over = np.gradient(clean.velocity, clean.time) if name == 'inertia' else clean.velocity
    jumped = with_effort(clean, clean.effort + np.where(
        clean.time >= BEGINS, more * nominal * over, 0.0))
    first = diagnose([jumped], NOMINAL).effects[0]
    assert first.effect == effect
    assert first.probability > 0.5
    assert first.onset[1] == pytest.approx(BEGINS, abs=0.3)
    assert first.parameters[name].value == pytest.approx((1.0 + more) * nominal, rel=0.1)


def stepped(begin: int, count: int = 400, size: float = 0.5):
    """Return times, a number's column, an effect's column, and an effort in which the effect
    begins at one value."""
    generator = np.random.default_rng(3)
    time = np.arange(count) / 40.0
    number, effect = np.sin(3.0 * time), np.cos(2.0 * time)
    effort = 0.2 * number + size * np.where(np.arange(count) >= begin, effect, 0.0)
    return time, number[:, None], effect[:, None], effort + 0.01 * generator.standard_normal(count)


def asked(times, numbers, effect, effort):
    return OnsetScreen(times, numbers, effort, np.full(effort.size, 100.0), np.zeros(1),
                       np.zeros(1)).least(effect)


def test_the_moment_of_least_cost_is_found_with_the_size():
    time, number, effect, effort = stepped(begin=170)
    cost, onset, sizes = asked([time], number, effect, effort)
    assert onset is not None
    assert onset.time == pytest.approx(time[170], abs=0.06)
    assert sizes[0] == pytest.approx(0.5, abs=0.01)
    assert cost == pytest.approx(400.0, rel=0.2)


def test_every_recording_is_asked():
    # The first recording is without it, the third has it throughout.
    parts = [stepped(begin) for begin in (400, 250, 0)]
    _, onset, _ = asked([part[0] for part in parts], *(
        np.concatenate([part[place] for part in parts]) for place in (1, 2, 3)))
    assert onset is not None
    assert onset.begins[0] == math.inf
    assert onset.begins[2] == -math.inf
    assert onset.run == 1
    assert onset.time == pytest.approx(parts[0][0][250], abs=0.06)
    assert onset.before([part[0] for part in parts]).sum() == pytest.approx(650, abs=3)


def test_a_recording_too_short_to_leave_both_sides_has_no_onset():
    time, number, effect, effort = stepped(begin=20, count=2 * LEAST_VALUES - 1)
    assert asked([time], number, effect, effort)[1] is None


def test_other_recordings_all_none_or_the_later_ones():
    assert len(onsets_tried([np.zeros(1)], 0)) == 1
    tried = {tuple('x' if math.isnan(value) else value > 0 for value in entry)
             for entry in onsets_tried([np.zeros(1)] * 3, 1)}
    assert tried == {(True, 'x', False), (False, 'x', False), (True, 'x', True)}


def test_a_prediction_has_the_effect_after_its_onset_only(clean):
    fitter = Fitter(problem_of([clean], NOMINAL))
    (variant,) = variants_of(get_effect('torque_offset'), fitter.problem.scene)
    onset = Onset((BEGINS,))
    begun = fitter.hypothesis((Variant(variant.effect, variant.constants, onset),))
    numbers = fitter.base().vector
    without = fitter.predict(fitter.hypothesis(), numbers)
    vector = np.array([*numbers, OFFSET])
    added = fitter.predict(begun, vector) - without
    before = onset.before(fitter.problem.times)
    assert np.all(added[before] == 0.0)
    throughout = fitter.predict(fitter.hypothesis((variant,)), vector) - without
    assert np.array_equal(added[~before], throughout[~before])


def test_a_model_that_is_judged_has_it_after_its_onset_only(clean):
    problem = problem_of([clean], NOMINAL)
    model = brake_with('torque_offset', offset=OFFSET)
    (run,) = problem.runs
    gated = replace(problem, onsets=(('torque_offset', Onset((BEGINS,))),)).predicted(run, model)
    before = run.time < BEGINS
    assert np.array_equal(gated[before], problem.predicted(run, NOMINAL)[before])
    assert np.array_equal(gated[~before], problem.predicted(run, model)[~before])


@pytest.mark.parametrize('effect', [entry for entry in catalogue().values() if entry.at_once],
                         ids=lambda effect: effect.id)
def test_what_is_there_at_once_is_held_in_the_last_parameters(effect):
    held = [entry.name for entry in effect.parameters[-len(effect.at_once):]]
    assert set(held) == set(effect.at_once)


def test_friction_that_jumps_says_so():
    assert 'times what it was' in get_effect('friction_drift').statement(
        {'friction_ratio': 1.2, 'settling': 1e-3, 'shape': 1.0})
    assert EffectSetting('friction_drift', {'friction_ratio': 1.2, 'settling': 1e-3,
                                            'shape': 1.0, 'duration': 9.0})


@pytest.mark.parametrize('count', [2 * LEAST_VALUES, 2 * LEAST_VALUES + 1])
def test_a_recording_with_hardly_a_moment_to_begin_at(count):
    """A real machine's recording with just twice the least number of values ended the program."""
    residual = np.linspace(-1.0, 1.0, count)
    _, onset, _ = OnsetScreen([np.arange(count) * 0.01], np.ones((count, 1)), residual,
                              np.ones(count), np.ones(1), np.zeros(1)).least(np.ones((count, 1)))
    assert (onset is None) == (count == 2 * LEAST_VALUES)


def test_what_passes_but_once_is_in_the_model_only_if_it_is_likely_or_worth_it(clean, slipped):
    """What grows with time tells nothing of the next recording; what begins acts on from there."""
    def held(recording: Recording, size: float, probability: float) -> list[str]:
        fitter = Fitter(problem_of([recording], NOMINAL))
        (offset,) = variants_of(get_effect('torque_offset'), fitter.problem.scene)
        (cogging,) = variants_of(get_effect('cogging_torque'), fitter.problem.scene)
        (drift, *_) = variants_of(get_effect('friction_drift'), fitter.problem.scene)
        hypothesis = fitter.hypothesis(
            (cogging, drift, replace(offset, onset=Onset((BEGINS,)))))
        vector = np.clip(hypothesis.prior[0], *hypothesis.bounds)
        vector[-1] = size
        fit = fitter.finish(fitter.evaluate(hypothesis, vector))
        explanation = Explanation(fit, None)
        told = CorrectedModels(explanation, explanation.models(),
                               explained_problem(fitter, fit), fit)
        findings = [EffectFinding(effect, probability, {}, 0.5, (), '')
                    for effect in ('torque_offset', 'friction_drift')]
        return [entry.effect for model in without_what_passes_once(fitter, told, findings).models
                for entry in model.effects if entry.effect != 'sampling_delay']

    assert held(slipped, OFFSET, 0.8) == ['cogging_torque', 'friction_drift', 'torque_offset']
    assert held(slipped, OFFSET, 0.4) == ['cogging_torque', 'torque_offset']
    assert held(clean, 0.01 * OFFSET, 0.4) == ['cogging_torque']


def test_a_gain_that_jumps(clean):
    """The current sensor reads 7 % too much from one moment on: no saturation of the motor."""
    louder = with_effort(clean, clean.effort * np.where(clean.time >= BEGINS, 1.07, 1.0))
    first = diagnose([louder], NOMINAL).effects[0]
    assert (first.effect, first.onset is not None) == ('effort_scale_error', True)
    assert first.parameters['scale'].value == pytest.approx(1.0 / 1.07, abs=0.005)


def test_a_wave_that_begins_is_no_beat_of_two(clean):
    """Two waves of nearly one order that beat can stand for one that begins."""
    wave = 0.008 * np.sin(2.0 * clean.position + 0.4)
    begun = with_effort(clean, clean.effort + np.where(clean.time >= BEGINS, wave, 0.0))
    found = diagnose([begun], NOMINAL).effects
    assert [entry.effect for entry in found] == ['cogging_torque']
    assert found[0].onset is not None and found[0].onset[1] == pytest.approx(BEGINS, abs=0.2)
    assert found[0].parameters['order'].value == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize(('before', 'in_all', 'begins'), [
    ((9.0, 1.0), (9.0, 1.0), True), ((3.0, 2.9), (9.6, 1.0), True),
    ((3.0, 2.9), (1.7, 1.0), False), ((1.0, 3.0), (9.6, 1.0), False)],
    ids=['it is not there before', 'it gives up so as not to be', 'a miss of formulas',
         'it explains before'])
def test_what_cannot_act_throughout_begins(monkeypatch, before, in_all, begins):
    """(throughout, with the onset): excess before the onset, and of all; 10 without the effect."""
    fit, throughout = (SimpleNamespace(hypothesis=SimpleNamespace(
        onsets=(('backlash', Onset((5.0,))),))) for _ in range(2))
    fitter = SimpleNamespace(problem=SimpleNamespace(times=[np.linspace(0.0, 10.0, 100)]))

    def of(values: tuple[float, float]):
        return lambda entry, *_: values[0] if entry is throughout else values[1]

    monkeypatch.setattr(onset_search, 'reduced_chi_square_of',
                        lambda entry, *_: 1.0 + of(before)(entry))
    monkeypatch.setattr(onset_search, 'excess', of(in_all))
    assert onset_search._begins(fitter, fit, throughout, 10.0) == begins
