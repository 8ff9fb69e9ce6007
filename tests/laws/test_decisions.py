# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a law is held against: levels on blocks left out are given here, no fit is made."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from engb_core.diagnose import engine, full_bandwidth
from engb_core.diagnose.diagnosis import EffectFinding, Unexplained
from engb_core.effects.catalogue import get_effect
from engb_core.errors import InputError
from engb_core.laws import competition, judgement
from engb_core.laws.forms import Atom, Form, Slot
from engb_core.laws.judgement import Found, Nearest
from engb_core.model import EffectSetting, Model


@dataclass(frozen=True)
class Fit:
    """A fit of these effects, of so many numbers, that reaches this level on blocks left out."""

    names: tuple[str, ...]
    level: float
    size: int = 5

    @property
    def hypothesis(self):
        return SimpleNamespace(ids=self.names, size=self.size, onsets=(), variants=tuple(
            SimpleNamespace(effect=get_effect(name)) for name in self.names))


@dataclass(frozen=True)
class Candidate:
    form: Form
    fit: Fit
    score: SimpleNamespace


# The parts of a mean square on six blocks.
UNEVEN = np.array([0.8, 1.2] * 3) / 6.0


def found(level, *, names=(), fitter=None, settled=True, size=5, before=10.0):
    fit = Fit((*names, 'torque_offset'), level, size)
    form = Form('torque', (Atom('load', 'load'),), 1.0)
    candidate = Candidate(form, fit, SimpleNamespace(level=level, by_block=level * UNEVEN[::-1]))
    return Found(fitter or FITTER, candidate, {}, 0.9, before, level, (), settled, np.zeros(2))


def fitter_with(problem='problem', load_shape=False):
    return SimpleNamespace(load_shape=load_shape, problem=problem, finish=lambda fit: fit,
                           refine=lambda fit: fit, evaluate=lambda hypothesis, vector: vector)


FITTER = fitter_with()


@pytest.fixture(autouse=True)
def levels(monkeypatch):
    monkeypatch.setattr(competition, '_on_blocks', lambda fitter, fit: fit.level)
    monkeypatch.setattr(competition, '_score_on_blocks', lambda fitter, fit: SimpleNamespace(
        level=fit.level, by_block=fit.level * UNEVEN))
    monkeypatch.setattr(competition, 'noise_by_block', lambda fitter: np.full(6, 1.0 / 6.0))


# ---- a law against names

@pytest.mark.parametrize(('named', 'law', 'likely', 'else_', 'beats'), [
    (5.0, 1.0, False, False, True),         # clearly better
    (1.01, 1.0, False, False, False),       # not clearly
    (9.9, 1.0, True, False, True),          # likely names explain too small a part
    (2.0, 1.0, True, False, False),         # likely names explain much, of the same things
    (2.0, 1.0, True, True, True),           # … of other things, and add nothing beside the law
])
def test_a_law_beats_names_by_what_they_leave(monkeypatch, named, law, likely, else_, beats):
    monkeypatch.setattr(competition, '_speaks_of', lambda law, variants: not else_)
    monkeypatch.setattr(competition, '_beside', lambda law, named: law)
    monkeypatch.setattr(competition, '_without_idle_names', lambda law: law)
    assert competition._beats(FITTER, found(law), Fit(('backlash',), named), likely) == beats


@pytest.mark.parametrize(('coordinate', 'name', 'else_'), [
    ('direction', 'asymmetric_friction', False),   # an offset without load is that, too
    ('velocity', 'asymmetric_friction', False),
    ('position', 'asymmetric_friction', True),
    ('position', 'cogging_torque', False),         # which the motor's angle reveals
])
def test_who_speaks_of_the_direction_speaks_of_the_velocity(coordinate, name, else_):
    law = found(1.0)
    form = Form('torque', (Atom(coordinate, coordinate),), 1.0)
    law = replace(law, candidate=replace(law.candidate, form=form))
    variants = Fit((name,), 1.0).hypothesis.variants
    assert competition._speaks_of(law, variants) == (not else_)


@pytest.mark.parametrize(('text', 'name', 'one'), [
    ('drag(load, {0})', 'load_hysteresis', True),
    ('drag(position, {0})', 'load_hysteresis', True),         # from which the load follows
    ('step({0} - since_reversal, 1.0)', 'load_hysteresis', False),   # whatever the load
    ('exp(-abs(velocity) / {0})', 'stribeck_friction', True),
    ('exp(-abs(velocity) / {0})', 'asymmetric_friction', True)])
def test_another_formula_of_a_name_speaks_of_what_the_name_acts_on(text, name, one):
    law = found(1.0)
    form = Form('torque', (Atom(text, text, (Slot('rad', 1.0, 0.1, 9.0),)),), 1.0)
    law = replace(law, candidate=replace(law.candidate, form=form))
    (variant,) = Fit((name,), 1.0).hypothesis.variants
    assert competition._is_one_of(law, variant) == one


def test_a_plainer_law_needs_to_be_about_as_good_as_a_free_load_curve():
    law, curve = found(1.0, size=5), Fit((), 1.0, 12)
    assert competition._beats(FITTER, law, curve, False)
    assert not competition._beats(FITTER, law, replace(curve, size=4), False)


def test_names_are_asked_on_the_problem_of_the_law(monkeypatch):
    asked = []
    other = fitter_with('another problem')
    other.evaluate = lambda hypothesis, vector: asked.append('again') or Fit(('backlash',), 5.0)
    free = fitter_with(load_shape=True)
    monkeypatch.setattr(competition, '_on', lambda fitter, fit: asked.append('free') or fit)
    named = Fit(('backlash',), 5.0)
    object.__setattr__(named, 'vector', None)
    for law in (found(1.0, fitter=other), found(1.0, fitter=free)):
        assert competition._beats(FITTER, law, named, False)
    assert asked == ['again', 'free']


@pytest.mark.parametrize(('without', 'left'), [(1.001, ()), (9.0, ('backlash',))])
def test_a_name_that_stood_for_the_law_is_dropped(monkeypatch, without, left):
    law = found(1.0, names=('backlash',))
    monkeypatch.setattr(law.fitter, 'finished_without', lambda fit, gone: Fit(
        tuple(name for place, name in enumerate(fit.names) if place not in gone), without),
        raising=False)
    for name, value in (('estimates', {}), ('excess_removed', 0.5),
                        ('contribution_of_last', np.ones(2))):
        monkeypatch.setattr(competition, name, lambda *_, value=value: value)
    kept = competition._without_idle_names(law)
    assert kept.candidate.fit.names == (*left, 'torque_offset')
    assert (kept is law) == bool(left)
    assert kept.after == (1.0 if left else without)


@pytest.mark.parametrize(('law', 'level', 'likely', 'wins'), [
    (found(1.0), 9.0, 0.05, True), (found(3.0), 3.35, 1.0, False), (found(1.0), 1.01, 0.05, False),
    (found(1.0, settled=False), 9.0, 0.05, False), (None, 9.0, 0.05, False)])
def test_a_law_stands_instead_of_names_that_leave_noise_where_it_is_likelier(
        monkeypatch, law, level, likely, wins):
    monkeypatch.setattr(competition, '_named', lambda fitter, fit: Fit(('backlash',), level))
    monkeypatch.setattr(competition, '_without_load_shape', lambda fitter: fitter)
    monkeypatch.setattr(competition, '_refitted_numbers', lambda fitter: None)
    monkeypatch.setattr(competition, 'find_law', lambda *_, **__: law)
    monkeypatch.setattr(competition, '_beats', lambda *_, **__: True)
    monkeypatch.setattr(competition, '_won', lambda *_: 'won')
    told = SimpleNamespace(explanation=SimpleNamespace(fit=None))
    got = competition.law_instead(FITTER, told, likely, print)
    assert got == ('won' if wins else None)


@pytest.mark.parametrize(('names', 'beaten', 'wins'), [
    (('backlash',), True, True), (('backlash',), False, False),
    (('backlash', 'pad_creep'), False, True)])
def test_a_law_may_be_another_form_of_one_name_but_hardly_of_several(
        monkeypatch, names, beaten, wins):
    for name, value in (('_named', lambda fitter, fit: Fit(names, 9.0)),
                        ('_without_load_shape', lambda fitter: fitter),
                        ('_refitted_numbers', lambda fitter: None),
                        ('find_law', lambda *_, **__: found(1.0)),
                        ('_beats', lambda *_, **__: beaten), ('_won', lambda *_: 'won')):
        monkeypatch.setattr(competition, name, value)
    told = SimpleNamespace(explanation=SimpleNamespace(fit=None))
    assert competition.law_instead(FITTER, told, 0.05, print) == ('won' if wins else None)


@pytest.mark.parametrize(('described', 'part', 'words'), [
    (0.5, 0.9, None), (5.0, 0.4, 'explains only 40 % of it'),
    (5.0, 0.95, 'not surely enough to be a law (it explains 95 % of it)')])
def test_what_came_nearest_is_told_unless_a_description_does_better(monkeypatch, described, part,
                                                                    words):
    nearest = Nearest(found(1.0).candidate, part)
    left = Unexplained(0.5, (), 'none', False, (), 'Something is left.')
    told = SimpleNamespace(explanation=SimpleNamespace(fit=Fit((), described), table=None))
    text = competition.nearest_told(FITTER, told, nearest, left)
    if words is None:
        assert text is left
        return
    assert text.depends_on == ('load',) and words in text.statement


# ---- the search for one

def search(*levels, acts_as='torque'):
    form = Form(acts_as, (Atom('load', 'load'),), 1.0)
    return SimpleNamespace(fitter=None, before=SimpleNamespace(level=10.0), candidates=tuple(
        SimpleNamespace(form=form, score=SimpleNamespace(level=level), fit=None)
        for level in levels))


@pytest.fixture
def searched(monkeypatch):
    """Return what is said of a search."""
    def look(made, *, believed=False, near=False, pays=True, again=None, resolved=None):
        monkeypatch.setattr(judgement, 'search_laws', lambda *_: made)
        monkeypatch.setattr(judgement, '_plainest', lambda fitter, all_: (all_[0], []))
        monkeypatch.setattr(judgement, 'is_promising', lambda *_: True)
        monkeypatch.setattr(judgement, '_without_stops', lambda *_: again)
        monkeypatch.setattr(judgement, '_where_resolved', lambda *_: resolved)
        monkeypatch.setattr(judgement, '_believed', lambda *_: believed)
        monkeypatch.setattr(judgement, '_approximates', lambda *_: near)
        monkeypatch.setattr(judgement, '_gain', lambda search, entry: -entry.score.level)
        monkeypatch.setattr(judgement, '_pays', lambda *_: pays)
        monkeypatch.setattr(judgement, '_found',
                            lambda search, chosen, alike, approximate: (chosen, approximate))
        return judgement.find_law(None, None, lambda text: None, approximately=near)
    return look


def test_what_is_believed_comes_first_then_what_comes_near_then_nothing(searched):
    made = search(2.0, 1.5)
    assert searched(search()) is None
    assert searched(made, believed=True) == (made.candidates[0], False)
    assert searched(made, near=True) == (made.candidates[0], True)
    assert searched(made, near=True, resolved='sensor') == 'sensor'
    nearest = searched(made)
    assert nearest.candidate is made.candidates[1]
    assert nearest.explained == pytest.approx(8.5 / 9.0)
    assert searched(made, pays=False) is None


def test_a_delay_is_asked_once_more_without_stops(searched):
    late, again = search(2.0, acts_as='delay'), search(1.2, acts_as='delay')
    assert searched(late, believed=True, again=again) == (again.candidates[0], False)
    assert searched(late, believed=True, again=search()) is None


@pytest.mark.parametrize('before_stop', [0.0, 9.0])
def test_stops_are_left_out_only_for_longer_than_before_and_where_motion_remains(monkeypatch,
                                                                                 before_stop):
    problem = SimpleNamespace(before_stop=before_stop, runs=(), held_out=(), model=None)
    made = SimpleNamespace(fitter=SimpleNamespace(problem=problem))
    monkeypatch.setattr(judgement, '_delays', lambda fitter, law: np.array([0.01, -0.02]))

    def too_little(*_, **__):
        raise InputError('too little motion')

    monkeypatch.setattr(judgement, 'problem_of', too_little)
    assert judgement._without_stops(made, None, print) is made


# ---- what is made of it all

def outcome(verdict='explained', findings=(), unexplained=None):
    return engine._Outcome(
        SimpleNamespace(problem=SimpleNamespace(runs=[SimpleNamespace(
            predicted=lambda physics: np.array([float(physics)]))])), None, None, list(findings),
        np.zeros(1), verdict, unexplained, Model(effects=(EffectSetting(
            'drivetrain_resonance', {}),)), None)


@pytest.mark.parametrize(('verdict', 'left', 'said'), [
    ('consistent', None, 'explained'), ('unexplained', 0.8, 'partly_explained'),
    ('partly_explained', 0.5, 'partly_explained')])
def test_a_resonance_stands_beside_what_a_round_with_it_found(monkeypatch, verdict, left, said):
    monkeypatch.setattr(engine, 'physics_of', lambda model: len(model.effects))
    finding = EffectFinding('drivetrain_resonance', 0.9, {}, 0.6, (), 'It rings.')
    rest = None if left is None else Unexplained(left, (), 'none', False, (), 'x')
    resonance = SimpleNamespace(finding=finding, setting=finding)
    told = engine._beside(resonance, outcome(verdict, (), rest))
    assert told.verdict == said and told.findings == [finding]
    assert told.mismatch.tolist() == [1.0]      # the model with it less the one without
    if left is not None:
        assert told.unexplained.share == pytest.approx(0.4)


@pytest.mark.parametrize(('named', 'asked'), [(('stribeck_friction',), False),
                                              (('stribeck_friction', 'backlash'), True)])
def test_wrong_numbers_are_no_reason_to_ask_for_a_law(monkeypatch, named, asked):
    """They stand beside a law as they do beside names; several names can be bent to one law."""
    questions = []
    monkeypatch.setattr(engine, 'law_instead', lambda *given: questions.append(given))
    names = [EffectFinding(effect, 0.93, {}, 0.3, (), '')
             for effect in (*named, 'inertia_error', 'coulomb_friction_error')]
    fit = SimpleNamespace(hypothesis=SimpleNamespace(ids=named))
    told = replace(outcome(findings=names), explanation=SimpleNamespace(fit=fit))
    assert engine._unless_law_is_likelier(told, print) is told
    assert bool(questions) == asked


@pytest.mark.parametrize(('unseen', 'file', 'chosen'), [
    ((1.0, 2.0), 5.0, 0), ((2.0, 1.0), 5.0, 1), ((5.0, 5.0), 1.0, 2)])
def test_the_first_model_that_clearly_helps_is_taken(monkeypatch, unseen, file, chosen):
    monkeypatch.setattr(full_bandwidth, 'unseen_errors', lambda problem, model: [np.array([file])])
    monkeypatch.setattr(full_bandwidth, 'pooled', lambda errors: float(errors[0][0]))
    models = (Model(), Model(effects=()), Model())
    told = SimpleNamespace(models=models[:2], unseen=unseen, problem=None)
    assert full_bandwidth.that_helps(told, models[2:]) is models[chosen]


@pytest.mark.parametrize(('lag', 'motion', 'taken'), [(0.0, True, 0.0), (0.05, True, 'again'),
                                                      (0.05, False, 0.0)])
def test_torque_that_comes_late_is_judged_once_more_without_stops(monkeypatch, lag, motion, taken):
    def problem_of(*_, before_stop):
        if before_stop and not motion:
            raise InputError('too little motion')
        return SimpleNamespace(before_stop=before_stop)

    monkeypatch.setattr(engine, 'problem_of', problem_of)
    monkeypatch.setattr(engine, 'judged_wide', lambda problem: False)
    monkeypatch.setattr(engine, 'decimated', lambda problem, threads: problem)
    monkeypatch.setattr(engine, '_judged', lambda *_: SimpleNamespace(
        corrected=None, fitter=None, selection=SimpleNamespace(chosen=None)))
    monkeypatch.setattr(engine, 'lateness', lambda model: lag)
    problem, _ = engine._without_stops((), None, (), lambda text: None, 1)
    assert (problem.before_stop > 0.0) == (taken == 'again')
