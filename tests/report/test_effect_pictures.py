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
