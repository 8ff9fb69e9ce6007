# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What moved the load curve, and what needs none of the file's numbers changed."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.diagnosis import EffectFinding
from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.nominal import CURVATURE, DELAY, LOAD_NUMBERS, with_numbers
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.score.ranking import unlikeliness
from engb_core.diagnose.search.every_effect import search
from engb_core.diagnose.selection import select, Selection
from engb_core.effects.catalogue import get_effect
from engb_core.model import EffectSetting, Model
from engb_core.recording import Recording

from .simulated_brake import (
    brake_with,
    equal_strokes,
    NOMINAL,
    recorded,
    strokes_and_waves,
)

STROKES = equal_strokes(8.0)


def selected(brake: Model, model: Model = NOMINAL) -> Selection:
    recording = recorded(brake, lambda time, _: STROKES.at(time), STROKES.duration)
    return select(search(Fitter(problem_of([recording], model))))


def brake_with_both(first: EffectSetting, second: EffectSetting) -> Model:
    return replace(NOMINAL, effects=(first, second))


@pytest.mark.parametrize('offset', [0.006, -0.006])
def test_two_causes_may_have_moved_the_load_curve(offset):
    found = selected(brake_with_both(
        EffectSetting('torque_offset', {'offset': offset}),
        EffectSetting('load_stiffness_error', {'scale': 1.08})))
    assert set(found.chosen.hypothesis.ids) == {'torque_offset', 'load_stiffness_error'}
    assert all(len(fit.hypothesis.variants) == 2 for fit in found.rivals)


@pytest.mark.parametrize('shift', [0.5, -0.35])
def test_two_causes_that_one_nearly_explains(shift):
    """Friction that differs by direction is nearly an offset beside a load curve that moved."""
    friction = NOMINAL.friction
    brake = brake_with_both(EffectSetting('torque_offset', {'offset': -0.01 * shift}),
                            EffectSetting('contact_shift', {'shift': shift}))
    # Refitted around what is missing: the load curve was kept.
    refit = replace(NOMINAL, friction=replace(friction, coulomb=0.97 * friction.coulomb,
                                              load_gain=0.97 * friction.load_gain),
                    motor=replace(NOMINAL.motor, inertia=1.03 * NOMINAL.motor.inertia))
    found = selected(brake, refit)
    assert set(found.chosen.hypothesis.ids) == {'torque_offset', 'contact_shift'}


def test_a_load_curve_that_was_scaled_around_what_is_missing_hides_no_contact_that_moved():
    load, friction = NOMINAL.load_torque, NOMINAL.friction
    brake = brake_with_both(
        EffectSetting('stribeck_friction', {'breakaway_ratio': 2.5, 'stribeck_velocity': 8.0}),
        EffectSetting('contact_shift', {'shift': 0.9}))
    scaled = replace(NOMINAL, load_torque=replace(load, coefficients=tuple(
        0.92 * entry for entry in load.coefficients)),
        friction=replace(friction, coulomb=1.2 * friction.coulomb))
    strokes = strokes_and_waves(2)
    recording = recorded(brake, lambda time, _: strokes.at(time), strokes.duration, noise=0.002)
    found = select(search(Fitter(problem_of([recording], scaled))))
    assert set(found.chosen.hypothesis.ids) == {
        'stribeck_friction', 'contact_shift', 'load_stiffness_error'}


def test_a_shift_of_half_the_stroke_is_less_likely_than_an_offset():
    fitter = Fitter(problem_of([recorded(
        NOMINAL, lambda time, _: STROKES.at(time), STROKES.duration)], NOMINAL))
    low, high = fitter.problem.scene.position_range

    def nats(effect: str, size: float) -> float:
        variant, = variants_of(get_effect(effect), fitter.problem.scene)
        hypothesis = fitter.hypothesis((variant,))
        return unlikeliness(fitter.evaluate(
            hypothesis, np.append(hypothesis.start_of_numbers(), size)), fitter)

    assert nats('contact_shift', 0.5 * (high - low)) == pytest.approx(12.5)
    assert nats('contact_shift', 0.0) == nats('torque_offset', 0.01) == 0.0


def test_one_cause_needs_no_second_one():
    brake = replace(NOMINAL, effects=(EffectSetting(
        'asymmetric_friction', {'asymmetry': 0.2, 'of_load_friction': 1.6}),))
    assert selected(brake).chosen.hypothesis.ids == ('asymmetric_friction',)


def test_rivals_are_told_apart_by_a_file_that_stands():
    brake = replace(NOMINAL, effects=(EffectSetting('asymmetric_friction', {'asymmetry': 0.1}),))
    found = selected(brake)
    assert found.chosen.hypothesis.ids == ('asymmetric_friction',)
    rival = next(fit for fit in found.rivals if fit.hypothesis.ids == ('contact_shift',))
    assert {number.name for number in rival.hypothesis.numbers} == {DELAY}

    friction = NOMINAL.friction
    off = replace(NOMINAL, friction=replace(friction, coulomb=1.06 * friction.coulomb))
    unsure = selected(brake, off)
    assert all(len(fit.hypothesis.numbers) > 1 for fit in unsure.rivals)


def refitted(model: Model, recording: Recording, held: tuple[str, ...] = ()) -> Model:
    """Return a model whose numbers, but those that are held, were refitted on a recording."""
    fitter = Fitter(problem_of([recording], model))
    moved = tuple(number for number in fitter.numbers if number.name not in (
        DELAY, CURVATURE, *held))
    refit = fitter.refine(fitter.base(moved))
    return with_numbers(model, {
        number.name: float(np.exp(value) if number.logarithmic else value)
        for number, value in zip(moved, refit.vector, strict=True)})


def told(recording: Recording, model: Model) -> list[EffectFinding]:
    """Return what is said of a recording that is likelier right than wrong."""
    return [entry for entry in diagnose([recording], model).effects if entry.probability >= 0.5]


@pytest.mark.parametrize('seed, scale, held', [
    (1, 1.15, ()), (1, 0.9, ()), (3, 1.15, ('inertia', 'load_gain'))])
def test_numbers_that_a_refit_around_a_wrong_load_has_moved_are_not_told(seed, scale, held):
    """Neither one by one nor, where inertia and load happen to be off alike, as effort's scale."""
    strokes = strokes_and_waves(seed)
    recording = recorded(brake_with('load_stiffness_error', scale=scale),
                         lambda time, _: strokes.at(time), min(strokes.duration, 14.0))
    found = told(recording, refitted(NOMINAL, recording, (*LOAD_NUMBERS, *held)))
    assert [entry.effect for entry in found] == ['load_stiffness_error']
    assert found[0].parameters['scale'].value == pytest.approx(scale, rel=0.02)


@pytest.mark.parametrize('seed', [1, 2])
def test_a_name_is_not_given_up_for_a_description_that_needs_no_other_load_curve(seed):
    """The file's curve was refitted around the offset: a torque at one place sets it right."""
    model = replace(NOMINAL, load_torque=replace(NOMINAL.load_torque, contact_angle=5.0))
    brake = replace(model, effects=(EffectSetting('torque_offset', {'offset': -0.004}),))
    strokes = strokes_and_waves(seed)
    recording = recorded(brake, lambda time, _: strokes.at(time), min(strokes.duration, 14.0))
    found = diagnose([recording], refitted(model, recording)).effects
    assert [entry.effect for entry in found] == ['torque_offset']
    assert found[0].parameters['offset'].value == pytest.approx(-0.004, rel=0.2)
    # Friction that differs by direction does as much here, and is as likely beforehand.
    assert found[0].probability + dict(found[0].alternatives).get(
        'asymmetric_friction', 0.0) > 0.8
