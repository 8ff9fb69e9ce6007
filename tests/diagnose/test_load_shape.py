# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A load curve of a form that the model file cannot follow, alone and beside what is missing."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose import engine
from engb_core.diagnose.diagnosis import EffectFinding
from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.load_shape import (
    LOAD_SHAPE,
    load_shape_finding,
    nameless_curve,
    with_free_load_curve,
    with_table,
)
from engb_core.diagnose.nominal import Knots
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square
from engb_core.diagnose.search.every_effect import physics_effects, search
from engb_core.diagnose.selection import select
from engb_core.effects.base import LOAD
from engb_core.effects.load_curve_shape import EFFECT as LOAD_CURVE_SHAPE
from engb_core.effects.load_curve_shape import knot_of, KNOTS
from engb_core.model import EffectSetting, LoadTorque, Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.physics.sample_table import sample_table
from engb_core.recording import Recording

from .simulated_brake import brake_with, lively, NOMINAL

STROKE = 20.0


def test_a_load_that_is_the_same_everywhere_has_no_form():
    """A weight that a spindle lifts: no recording tells its stiffness, its hysteresis, or a
    friction that goes with it, and a table over the way would be one over time."""
    time = np.arange(0.0, 8.0, 1e-3)
    speed = 60.0 * (1.0 - np.exp(-time)) * np.sign(np.sin(0.7 * time) + 1e-9)
    speed = np.convolve(speed, np.ones(200) / 200.0, 'same')
    effort = 7.4e-5 * np.gradient(speed, time) + 1e-3 * speed + 0.02 * np.tanh(speed) + 0.01
    recording = Recording('spindle', time, np.cumsum(speed) * 1e-3, effort)
    model = replace(NOMINAL, load_torque=LoadTorque(coefficients=(0.01,)))
    fitter = Fitter(problem_of([recording], model), 1)
    assert not {'load_hysteresis', 'self_energizing', 'pad_creep'} & {
        effect.id for effect in physics_effects(fitter)}
    assert 'load_gain' not in [number.name for number in fitter.numbers]
    assert not LOAD_CURVE_SHAPE.applies(fitter.problem.scene)


def stiffer_at_the_end() -> EffectSetting:
    """A caliper that stiffens where the pad is through its soft layer: no cubic bends so fast."""
    angle = np.linspace(0.0, STROKE, KNOTS)
    torque = 0.06 / (1.0 + np.exp(-2.5 * (angle - 14.0)))
    return EffectSetting(LOAD_SHAPE, {
        'from': 0.0, 'to': STROKE,
        **{f'value_{knot:02d}': float(value) for knot, value in enumerate(torque)}})


def with_shape(model: Model) -> Model:
    return replace(model, effects=(*model.effects, stiffer_at_the_end()))


@pytest.fixture(scope='module')
def shaped():
    return lively(with_shape(NOMINAL))


def test_the_form_of_the_load_curve_is_told_and_held_in_the_corrected_model(shaped):
    found = diagnose([shaped], NOMINAL)
    assert [entry.effect for entry in found.effects if entry.probability > 0.5] == [LOAD_SHAPE]
    assert LOAD_SHAPE in [entry.effect for entry in found.model.effects]
    effort = next(entry for entry in found.held_out if entry.quantity == 'effort')
    assert effort.rms_after < 0.3 * effort.rms_before


def preloaded(place: float, preload: float) -> EffectSetting:
    """A spring that pulls back to one place from both sides: all of its preload within 0.3 rad."""
    angle = np.linspace(0.0, STROKE, 2001)
    knots = {'from': 0.0, 'to': STROKE, 'dense_at': place, 'dense_width': 0.3, 'dense_part': 0.7}
    lies = [float(np.interp(knot, [knot_of([*[0.0] * KNOTS, *knots.values()], at) for at in angle],
                            angle)) for knot in range(KNOTS)]
    return EffectSetting(LOAD_SHAPE, {**knots, **{
        f'value_{knot:02d}': float(preload * np.tanh((lies[knot] - place) / 0.1))
        for knot in range(KNOTS)}})


def test_knots_lie_where_the_curve_bends():
    """Evenly laid ones ring beside a step; where nothing bends they are even."""
    sprung = lively(replace(NOMINAL, effects=(preloaded(8.0, 0.03),)))
    fitter = Fitter(problem_of([sprung], NOMINAL))
    table = with_table(fitter, fitter.base())
    assert table.load_shape.at == pytest.approx(8.0, abs=1.0)
    assert table.load_shape.part > 0.0
    even = Fitter(fitter.problem, load_shape=Knots())
    left, beside = (reduced_chi_square(made.refine(made.base()), fitter) - 1.0
                    for made in (table, even))
    assert left < 0.5 * beside
    smooth = Fitter(problem_of([lively(NOMINAL)], NOMINAL))
    assert with_table(smooth, smooth.base()).load_shape == Knots()


def test_a_form_that_does_not_carry_over_explains_nothing(shaped, monkeypatch):
    """Nothing is named then, and what the table takes away is no explanation."""
    monkeypatch.setattr(engine, 'carries_over', lambda *_: False)
    found = engine.diagnose([shaped], NOMINAL)
    assert not found.effects and found.verdict == 'unexplained'
    assert found.unexplained.share > 0.9


@pytest.fixture(scope='module')
def slippery():
    """Return the nominal model with less than half of its Coulomb friction."""
    friction = replace(NOMINAL.friction, coulomb=0.4 * NOMINAL.friction.coulomb)
    return replace(NOMINAL, friction=friction)


def test_a_stiffness_that_is_off_is_told_also_where_the_curve_has_another_form():
    """A free table would take in the whole of it, and no number would be told."""
    bend = stiffer_at_the_end().parameters
    brake = brake_with('load_stiffness_error', scale=1.3)
    brake = replace(brake, effects=(*brake.effects, EffectSetting(LOAD_SHAPE, {
        name: 0.1 * value if name.startswith('value') else value
        for name, value in bend.items()})))
    found = diagnose([lively(brake)], NOMINAL)
    assert [entry.effect for entry in found.effects if entry.probability >= 0.5] == [
        'load_stiffness_error']
    # The bend lies where the load is largest, and is part of what the factor is.
    assert found.effects[0].parameters['scale'].value == pytest.approx(1.3, abs=0.06)
    effort = next(entry for entry in found.held_out if entry.quantity == 'effort')
    assert effort.rms_after < 0.05 * effort.rms_before


def test_a_wrong_number_is_told_beside_the_form(shaped, slippery):
    found = diagnose([shaped], slippery)
    assert {entry.effect for entry in found.effects if entry.probability >= 0.7} == {
        'coulomb_friction_error', LOAD_SHAPE}


def test_a_wrong_number_is_told_also_where_the_form_does_not_carry_over(
        shaped, slippery, monkeypatch):
    """A number that is off beside a free load curve and beside the file's own form is off."""
    monkeypatch.setattr(engine, 'that_carries', lambda *given: replace(given[-1], models=()))
    found = engine.diagnose([shaped], slippery)
    assert [entry.effect for entry in found.effects if entry.probability >= 0.5] == [
        'coulomb_friction_error']
    assert found.verdict == 'partly_explained'
    assert 0.01 < found.effects[0].share < 0.5
    assert found.model.friction.coulomb == pytest.approx(NOMINAL.friction.coulomb, rel=0.15)


def test_an_effect_is_named_beside_it():
    found = diagnose([lively(with_shape(brake_with(
        'cogging_torque', amplitude=0.012, order=6.0, phase=0.3)))], NOMINAL)
    assert 'cogging_torque' in [entry.effect for entry in found.effects
                                     if entry.probability > 0.5]


def test_a_table_holds_no_torque_where_nothing_is_touched():
    """A torque that is the same along the whole stroke was the load curve's form, before the
    contact as well, and friction that differs with the direction was not told."""
    cubic = LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6), contact_angle=6.0)
    file = replace(NOMINAL, load_torque=cubic)
    brake = with_shape(replace(file, effects=(
        EffectSetting('asymmetric_friction', {'asymmetry': 0.5}),)))
    recording = lively(brake)
    free = Fitter(problem_of([recording], file), load_shape=Knots())
    assert [number.name for number in free.numbers if number.name.startswith('value_')] == [
        f'value_{knot:02d}' for knot in range(1, KNOTS)]
    found = diagnose([recording], file)
    assert {entry.effect for entry in found.effects if entry.probability > 0.5} == {
        'asymmetric_friction', LOAD_SHAPE}
    # A load that nobody says to begin anywhere may be any.
    free = Fitter(problem_of([recording], NOMINAL), load_shape=Knots())
    assert 'value_00' in [number.name for number in free.numbers]


def test_no_free_curve_where_the_file_s_form_serves():
    fitter = Fitter(problem_of([lively(brake_with('asymmetric_friction', asymmetry=0.4))],
                               NOMINAL))
    assert with_free_load_curve(fitter, select(search(fitter))) is None


def test_a_load_curve_that_the_chosen_fit_holds_is_no_finding(shaped):
    """Of several causes one may be chosen with the file's load curve as it stands; that a refit
    with other numbers, which may end in another minimum, is worse says nothing of the form."""
    free = Fitter(problem_of([shaped], NOMINAL), load_shape=Knots())
    better = replace(free.nominal(), residual=np.zeros_like(free.measured))
    assert load_shape_finding(free, better) is None


def test_a_table_for_the_load_curve_says_on_what_it_depends():
    curve = EffectFinding(LOAD_SHAPE, 0.9, {}, 1.0, (), '')
    told = nameless_curve([curve])
    assert told is not None and told.depends_on == ('position',) and not told.memory
    assert nameless_curve([replace(curve, probability=0.3)]) is None
    assert nameless_curve([replace(curve, effect='backlash')]) is None


def test_the_load_curve_s_last_slope_goes_on_for_one_knot():
    """A stiffness does not end where a recording did; far beyond nothing is known."""
    values = {f'value_{index:02d}': 1e-3 * index for index in range(KNOTS)}
    setting = EffectSetting('load_curve_shape', {**values, 'from': 0.0, 'to': 11.0})
    model = Model(effects=(setting,))
    position = np.array([-5.0, -0.5, 0.0, 5.5, 11.0, 11.5, 20.0])
    samples = sample_table(1.0, np.arange(7.0), position, np.zeros(7), np.zeros(7))
    effort_of_motion(samples, 1.0, physics_of(model))
    assert np.allclose(samples[:, LOAD], 1e-3 * np.array([-1.0, -0.5, 0.0, 5.5, 11.0, 11.5, 12.0]),
                       atol=1e-7)


def test_a_buffer_at_the_end_is_no_loop():
    """A loop that remembers longer than the stroke is hardly one, and bends the load curve as a
    buffer does: what knows nothing of reversals and does as much takes its place."""
    run = lively(NOMINAL)
    buffer = 0.04 * (np.maximum(run.position - 12.0, 0.0) / 8.0) ** 1.5
    found = diagnose([replace(run, effort=run.effort + buffer)], NOMINAL)
    assert 'load_hysteresis' not in [entry.effect for entry in found.effects]
    assert LOAD_SHAPE in [entry.effect for entry in found.effects] \
        or found.unexplained.depends_on == ('position',)
