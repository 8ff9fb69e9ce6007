# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Parts of `engb reproduce` that need no reproduction: runs, words, and what is refused."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from engb_core.control.excitation import ExcitationSettings
from engb_core.control.reference import ReferenceSettings
from engb_core.errors import InputError
from engb_core.model import Model
from engb_core.recording import Recording, Reference, Signal
from engb_core.report.layout import Page
from engb_core.reproduce import chosen
from engb_core.reproduce.in_process import replay, run_experiment
from engb_core.reproduce.nominal_chapter import compare_cogging
from engb_core.reproduce.plan import _rest_after, Experiment
from engb_core.reproduce.reproduction_page import _beyond
from engb_core.reproduce.self_energizing_chapter import standing_and_turning
from engb_core.reproduce.validation_chapter import _offsets, track
from engb_core.reproduce.ways import Bias, mirror_centres, Spread
from engb_core.reproduce.ways_compared import _nearest, told

TIME = np.arange(0.0, 3.0, 0.01)


def experiment(**more):
    return Experiment('run', 'nominal', '', 'a test', chosen.FORM, 0.2, **more)


def test_a_run_is_excited_or_tracks_and_has_what_its_brake_measures():
    excited = run_experiment(experiment(excitation=ExcitationSettings(), observed=True),
                             chosen.NOMINAL)
    assert excited.reference is None and 'disturbance' in excited.signals
    tracked = run_experiment(experiment(reference=ReferenceSettings(kind='strokes')),
                             chosen.NOMINAL)
    assert tracked.reference is not None and 'disturbance' not in tracked.signals
    bench = 'load_cell' in tracked.signals
    plain = replace(experiment(excitation=ExcitationSettings()), brake=Model())
    assert bench and 'load_cell' not in run_experiment(plain, Model()).signals


@pytest.mark.parametrize('call', [
    lambda: run_experiment(experiment(), chosen.NOMINAL),
    lambda: replay(replace(experiment(reference=ReferenceSettings(kind='strokes')),
                           brake=Model()), Model())])
def test_a_run_of_nothing_and_a_brake_that_does_not_wear_are_refused(call):
    with pytest.raises(InputError, match='run: (nothing to track|only a bench brake)'):
        call()


def test_a_brake_s_own_state_is_told_a_hundred_times_a_second():
    found = replay(experiment(reference=ReferenceSettings(kind='strokes')), chosen.NOMINAL)
    assert found.time.size == found.wear.size == 20
    assert np.median(np.diff(found.time)) == pytest.approx(0.01)


def test_a_rest_is_told_of_a_trajectory_alone():
    assert _rest_after(ReferenceSettings(), 1) == 0.0
    strokes = ReferenceSettings(kind='strokes', amplitudes=(12.0, 12.0), slow_speeds=())
    first, second = (_rest_after(strokes, number) for number in (1, 2))
    assert 0.0 < first < second


# ---- words

def spread(way, *loads, gain=0.0):
    return Spread('a', way, tuple(Bias('a', way, load, 0.0, gain, 0.1) for load in loads))


def test_several_seeds_have_a_deviation_and_one_has_none():
    assert '±' in told(spread('one', 1e-3, 2e-3), 'load')
    assert '±' not in told(spread('one', 1e-3), 'load')
    assert told(spread('one', 1e-3, gain=-0.02), 'load_gain').startswith('−')


def test_ways_that_the_seeds_do_not_tell_apart_are_as_near():
    ways = {name: spread(name, *loads) for name, loads in (
        ('best', (1e-3, 1.1e-3, 0.9e-3)), ('alike', (1.2e-3, 0.9e-3, 1.1e-3)),
        ('worse', (5e-3, 5.1e-3, 5.2e-3)))}
    text = _nearest(ways, 'load')
    assert text.startswith('nearest by “best”') and 'as well by “alike”' in text
    assert 'worse' not in text


def recorded(reference=None, disc=None):
    signals = {} if disc is None else {'disc_speed': Signal(TIME, disc)}
    return Recording('run', TIME, np.sin(TIME), np.cos(TIME), None, reference, signals)


def test_what_was_not_recorded_is_told():
    bare = recorded()
    for call in (track, lambda run: compare_cogging(run, run)):
        for run in (bare, recorded(Reference(TIME, np.sin(TIME)))):
            with pytest.raises(InputError, match='no reference recorded; record the topic'):
                call(run)
    assert mirror_centres(bare, [], []) == []
    with pytest.raises(InputError, match='has no table of stops'):
        _offsets(track(recorded(Reference(TIME, np.sin(TIME), np.cos(TIME)))), experiment())


@pytest.mark.parametrize(('disc', 'words'), [
    (None, 'no disc_speed recorded'), (np.zeros(TIME.size), 'must stand first and then turn'),
    (np.full(TIME.size, 5.0), 'must stand first and then turn')])
def test_a_disc_stands_first_and_then_turns(disc, words):
    with pytest.raises(InputError, match=words):
        standing_and_turning(recorded(disc=disc))


def test_the_parts_before_and_after_a_disc_turns_are_taken():
    disc = np.clip(TIME - 1.0, 0.0, 1.0) * 20.0
    standing, turning = standing_and_turning(recorded(disc=disc))
    assert standing.time[-1] == pytest.approx(1.0, abs=0.03)
    assert np.ptp(turning.time) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(('diagnosis', 'words', 'absent'), [
    (None, [], ['What was left out']),
    (SimpleNamespace(effects=(), unexplained=None), ['It gives no name.'], ['Effect']),
    (SimpleNamespace(effects=(SimpleNamespace(effect='pad_creep', probability=0.9,
                                              statement='It creeps.'),),
                     unexplained=SimpleNamespace(statement='Something is left.')),
     ['It creeps.', 'Something is left.'], ['It gives no name.'])])
def test_the_page_tells_a_diagnosis_where_there_is_one(monkeypatch, diagnosis, words, absent):
    from engb_core.reproduce import reproduction_page
    monkeypatch.setattr(reproduction_page, 'wear_figure', lambda wear: None)
    monkeypatch.setattr(reproduction_page, 'force_figure', lambda wear: None)
    monkeypatch.setattr(Page, 'figure', lambda page, figure: None)
    page = Page('a')
    _beyond(page, SimpleNamespace(beyond=SimpleNamespace(wear=None, diagnosis=diagnosis),
                                  more=SimpleNamespace(label='brake')))
    text = page.html()
    assert all(word in text for word in words) and not any(word in text for word in absent)
