# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The pictures of effects show what they are about, and nothing that misleads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from engb_core.diagnose.diagnosis import Diagnosis, Trace
from engb_core.effects.catalogue import catalogue
from engb_core.model import EffectSetting, Friction, Model
from engb_core.report.effect_pictures import effect_pictures
from engb_core.report.pictures import Units
from tests.docs_scripts import docs_script

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope='module')
def gallery():
    return docs_script('make_gallery')


def _trace(**channels):
    """Return ten seconds at 50 Hz whose motion pauses from 5.7 to 6 s and creeps from 8 s on."""
    time = np.arange(0.0, 10.0, 0.02)
    time = time[(time < 5.7) | (time > 6.0)]
    velocity = np.where(time < 8.0, 5.0, 0.1) * np.where(np.sin(3.0 * time) > 0.0, 1.0, -1.0)
    position = np.cumsum(velocity) * 0.02
    effort = 0.1 * np.sin(0.7 * time) + np.where(np.abs(time - 6.1) < 0.05, 0.5, 0.0)
    zero = np.zeros(time.size)
    given = {'acceleration': zero, 'model_load': np.linspace(0.0, 1.0, time.size),
             'motor_angle': np.mod(position, 2.0 * np.pi), **channels}
    return Trace('a', False, time, position, velocity, effort, 0.9 * effort, effort,
                 np.ones(time.size, bool), 0.001, given)


def _pictures(effect, trace, model):
    units = Units(Diagnosis('explained', (), (), (), None, (), None, model))
    return effect_pictures(effect, [trace], model, units)


def test_a_lag_is_shown_within_one_motion():
    """Half of the picture had been the standstill before the motion."""
    panel = _pictures('actuation_lag', _trace(), Model())[0].panels[0]
    times = np.asarray(panel.series[0].x)
    assert times.min() > 6.0
    assert np.max(np.diff(times)) < 0.03


def test_dry_friction_over_load_is_of_a_shaft_that_slides():
    """Below the velocity at which friction is full it is less, whatever the load."""
    model = Model(friction=Friction(0.01, 0.1, 0.5))
    panel = _pictures('load_dependent_friction', _trace(), model)[0].panels[0]
    largest = max(float(np.max(series.x)) for series in panel.series)
    trace = _trace()
    assert largest <= np.max(trace.channels['model_load'][np.abs(trace.velocity) > 0.5])


def test_a_wave_of_many_cycles_a_turn_has_points_enough():
    order = 12.0
    model = Model(effects=(EffectSetting('cogging_torque', {
        'order': order, 'amplitude': 0.01, 'phase': 0.0}),))
    rng = np.random.default_rng(0)
    angle = rng.uniform(0.0, 40.0, 6000)
    trace = _trace()
    time = np.arange(6000) * 0.01
    wave = 0.01 * np.sin(order * angle)
    zero = np.zeros(6000)
    trace = Trace('a', False, time, angle, zero + 1.0, wave, zero, wave, np.ones(6000, bool),
                  0.001, {'acceleration': zero, 'model_load': zero,
                   'motor_angle': np.mod(angle, 2.0 * np.pi), 'without:cogging_torque': zero})
    panel = _pictures('cogging_torque', trace, model)[0].panels[0]
    points = next(series for series in panel.series if series.name == 'measured')
    assert np.asarray(points.x).size >= 6 * order
    assert np.max(points.y) > 0.9 * (0.01 if panel.y.unit == 'N·m' else 10.0)


def test_a_model_without_the_effect_has_no_spectrum_of_it():
    """On an axis in powers of ten, nothing cannot be drawn; the legend had named it."""
    zero = np.zeros(_trace().time.size)
    trace = _trace(**{'without:drivetrain_resonance': 0.9 * _trace().effort + zero})
    figure = _pictures('drivetrain_resonance', trace, Model())[0]
    assert [series.name for series in figure.panels[0].series] == ['measured', 'corrected model']
    assert 'model as given' in figure.caption


def test_the_gallery_shows_the_true_inertia(gallery):
    traces, model = gallery.traces_of(catalogue()['inertia_error'])
    units = Units(Diagnosis('explained', (), (), (), None, (), None, model))
    panel = effect_pictures('inertia_error', traces, model, units)[0].panels[0]
    before, after = (np.asarray(series.y) for series in panel.series[:2])
    x = np.asarray(panel.series[0].x)
    ratio = (after @ x) / (before @ x)
    assert ratio == pytest.approx(1.6, rel=0.03)


def test_no_equation_needs_accents_that_a_typewriter_face_cannot_set():
    """A combining dot (U+0307) stands beside its letter in most of them."""
    assert [effect.id for effect in catalogue().values() if '\u0307' in effect.equation] == []


def test_what_another_effect_adds_is_taken_off_friction():
    """Cogging, found beside Stribeck friction, had scattered its points by twice the friction."""
    model = Model(friction=Friction(0.01, 0.0, 0.05), effects=(
        EffectSetting('stribeck_friction', {'breakaway_ratio': 2.0, 'stribeck_velocity': 1.0,
                                            'shape': 1.0}),
        EffectSetting('cogging_torque', {'order': 5.0, 'amplitude': 0.02, 'phase': 0.0})))
    rng = np.random.default_rng(1)
    time = np.arange(3000) * 0.01
    velocity = rng.choice([-1.0, 1.0], 3000) * np.geomspace(0.2, 20.0, 3000)
    angle = rng.uniform(0.0, 40.0, 3000)
    zero = np.zeros(3000)
    friction = np.sign(velocity) * 0.01 * (1.0 + np.exp(-np.abs(velocity)))
    cogging = 0.02 * np.sin(5.0 * angle)
    trace = Trace('a', False, time, angle, velocity, friction + cogging,
                  0.01 * np.sign(velocity), friction + cogging, np.ones(3000, bool), 0.001,
                  {'acceleration': zero, 'model_load': zero, 'motor_angle': angle % 6.28,
                   'without:cogging_torque': friction,
                   'without:stribeck_friction': 0.01 * np.sign(velocity) + cogging})
    panel = _pictures('stribeck_friction', trace, model)[0].panels[0]
    factor = 1e3 if panel.y.unit == 'mN·m' else 1.0
    for series in panel.series:
        if series.name.startswith(('measured', 'corrected')):
            x = np.asarray(series.x)
            assert np.asarray(series.y) == pytest.approx(
                factor * 0.01 * (1.0 + np.exp(-x)), rel=0.03)
        else:
            assert np.asarray(series.y) == pytest.approx(factor * 0.01)


def _uniform(size=4000, **channels):
    """Return a trace of both directions over all positions, with what a picture needs."""
    rng = np.random.default_rng(3)
    position = rng.uniform(0.0, 40.0, size)
    velocity = rng.choice([-1.0, 1.0], size) * rng.uniform(0.5, 5.0, size)
    load = 1e-3 * position
    effort = load + 0.01 * np.sign(velocity)
    given = {'acceleration': np.zeros(size), 'model_load': load, 'load': load,
             'motor_angle': position % 6.28, 'model_shift': 1e-3 * np.sign(velocity),
             'since_reversal': position % 3.0, 'time': np.arange(size) * 0.01, **channels}
    return Trace('a', False, np.arange(size) * 0.01, position, velocity, effort, 0.9 * effort,
                 effort, np.ones(size, bool), 0.001, given)


@pytest.mark.parametrize(('disc', 'names'), [
    (np.arange(4000) * 0.0 + 20.0, {'measured'}),                       # always turning
    (np.where(np.arange(4000) < 2000, 20.0, 0.0),
     {'measured, disc turning', 'measured, disc standing'}),
    (np.zeros(4000), {'measured'}), (None, {'measured'})])
def test_a_load_curve_is_shown_with_and_without_the_disc_turning(disc, names):
    trace = _uniform(**({} if disc is None else {'disc_speed': disc}))
    figure = next(figure for figure in _pictures('self_energizing', trace, Model())
                  if 'over position' in figure.title)
    found = {series.name: np.asarray(series.y) for series in figure.panels[0].series}
    assert {name for name in found if name.startswith('measured')} == names
    factor = 1e3 if figure.panels[0].y.unit == 'mN·m' else 1.0
    for name in names:
        assert np.max(found[name]) == pytest.approx(factor * 0.0395, rel=0.05)


def test_a_fade_is_shown_over_what_changes_more():
    warm = np.linspace(20.0, 300.0, 4000)
    over = [_pictures('pad_friction_fade', _uniform(disc_speed=speed, pad_temperature=warm),
                      Model())
            for speed in (np.full(4000, 5.0), np.linspace(-9.0, 9.0, 4000))]
    assert [figures[0].title.split(' over ')[-1] for figures in over] == [
        'pad temperature', 'disc speed']
    assert np.asarray(over[0][0].panels[0].series[0].y) == pytest.approx(0.9, rel=0.3)


@pytest.mark.parametrize('lacking', ['disc_speed', 'load'])
def test_a_picture_without_what_it_is_over_is_left_out(lacking):
    size = 4000
    channels = {'disc_speed': np.linspace(0.0, 9.0, size), 'pad_temperature': np.zeros(size)}
    if lacking == 'disc_speed':
        channels = {}
    else:
        channels['load'] = np.zeros(size)
    assert _pictures('pad_friction_fade', _uniform(**channels), Model()) == []


def test_no_picture_of_a_recording_of_a_few_samples_fails():
    """Means of fewer samples than a bin needs would be noise."""
    for effect in catalogue().values():
        for figure in _pictures(effect.id, _uniform(30), Model()):
            for panel in figure.panels:
                assert panel.series, effect.id


def test_every_picture_of_a_linear_axis_is_of_numbers_and_none_fails():
    bare = _uniform()
    bare.channels.pop('motor_angle')
    for effect in catalogue().values():
        for figure in _pictures(effect.id, bare, Model()):
            assert all(np.isfinite(series.y).all() for panel in figure.panels
                       for series in panel.series), effect.id


def test_a_shaft_at_one_place_gives_no_curve_over_it():
    trace = _uniform(acceleration=np.full(4000, 2.0))
    assert _pictures('inertia_error', trace, Model()) == []
