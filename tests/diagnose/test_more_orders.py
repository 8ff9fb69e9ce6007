# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Cogging of several unrelated orders: one effect with a list of them."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.hypothesis import Variant, variants_of
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.search.every_effect import _other_forms, with_variant
from engb_core.diagnose.search.more_orders import with_more_orders, without_idle_orders
from engb_core.effects.catalogue import get_effect
from engb_core.effects.cogging_torque import with_orders
from engb_core.model import EffectSetting, Friction, Joint, LoadTorque, Model, Motor
from engb_core.physics.plant import physics_of
from engb_core.recording import Recording

# A motor on its own.
MODEL = Model(Motor(0.05, 1e-4, 1e-4), LoadTorque(), Friction(0.01, 0.0, 0.1))
TIME = np.arange(24000) / 1000.0
POSITION = (12.0 * np.sin(2 * np.pi * 0.05 * TIME) + 4.0 * np.sin(2 * np.pi * 0.21 * TIME)
            + 0.4 * np.sin(2 * np.pi * 1.1 * TIME))
VELOCITY = np.gradient(POSITION, TIME)


def recording(*waves):
    """Return MODEL's motor with these waves of torque, (amplitude, order, phase) each."""
    effort = (1e-4 * np.gradient(VELOCITY, TIME) + 1e-4 * VELOCITY
              + 0.01 * np.clip(VELOCITY / 0.1, -1.0, 1.0))
    for amplitude, order, phase in waves:
        effort = effort + amplitude * np.sin(order * POSITION + phase)
    noise = 5e-4 * np.random.default_rng(3).standard_normal(TIME.size)
    return Recording('run', TIME, POSITION, effort + noise)


WAVES = ((0.008, 7.0, 0.3), (0.006, 12.0, -1.0), (0.004, 5.0, 2.0))


def cogging(run):
    fitter = Fitter(problem_of([run], MODEL), 1)
    variant, = variants_of(get_effect('cogging_torque'), fitter.problem.scene)
    return fitter, with_variant(fitter, fitter.base(), variant)


def test_each_order_is_found_with_its_size():
    fitter, fit = cogging(recording(*WAVES))
    more = with_more_orders(fitter, fit)
    values = more.hypothesis.named(more.vector, 0)
    found = {round(values[f'order{end}'], 1): values[f'amplitude{end}']
             for end in ('', '_2', '_3')}
    assert found == {order: pytest.approx(size, rel=0.05) for size, order, _ in WAVES}
    assert 'amplitude_4' in values and values['amplitude_4'] == 0.0


def test_a_wave_of_several_orders_has_no_other_form():
    """Its further orders are constants of the plain wave: a whole diagnosis had ended in an error.
    """
    fitter, fit = cogging(recording(*WAVES))
    more = with_more_orders(fitter, fit)
    assert 'order_2' in [entry.name for entry in more.hypothesis.variants[0].effect.parameters]
    assert not list(_other_forms(more.hypothesis, fitter))


def test_an_order_that_does_not_stand_out_leaves_the_list():
    fitter, fit = cogging(recording(WAVES[0], WAVES[1]))
    two = with_more_orders(fitter, fit)
    constants = fit.hypothesis.variants[0].constants
    four = fitter.hypothesis((Variant(with_orders(4), ()),), two.hypothesis.numbers)
    # Between the two that are there stands one that is nearly nothing, and last comes another.
    first, second = two.vector[:-3], two.vector[-3:]
    idle = fitter.evaluate(four, np.concatenate(
        [first, [1e-6, np.log(3.3), 0.1], second, [1e-6, np.log(21.0), 0.2]]))
    left = without_idle_orders(fitter, idle)
    assert left.hypothesis.named(left.vector, 0) == pytest.approx(
        two.hypothesis.named(two.vector, 0), rel=0.02, abs=1e-6)
    assert len(left.hypothesis.variants[0].constants) == len(constants) - 3
    assert without_idle_orders(fitter, left) is left


def test_a_leading_order_that_does_not_stand_out_gives_way_to_the_next():
    """A slow wave that stood for the form of the load curve is none once the curve is free."""
    fitter, fit = cogging(recording(WAVES[0]))
    two = fitter.hypothesis((Variant(with_orders(2), fit.hypothesis.variants[0].constants[3:]),),
                            fit.hypothesis.numbers)
    values = fit.hypothesis.named(fit.vector, 0)
    count = len(fit.hypothesis.numbers)
    harmonics = np.zeros(4)
    idle = fitter.evaluate(two, np.concatenate([
        fit.vector[:count], [1e-9, np.log(0.5), 0.0], harmonics,
        [values['amplitude'], np.log(values['order']), values['phase']]]))
    left = without_idle_orders(fitter, idle)
    told = left.hypothesis.named(left.vector, 0)
    assert told['order'] == pytest.approx(7.0, rel=1e-3)
    assert told['amplitude'] == pytest.approx(0.008, rel=0.05)
    assert 'amplitude_2' not in {entry.name
                                 for entry in left.hypothesis.variants[0].effect.parameters}


def test_two_waves_that_the_stroke_does_not_tell_apart_are_one():
    """Two waves of almost one order cancel, each of them larger than what is there."""
    fitter, fit = cogging(recording(WAVES[0]))
    three = fitter.hypothesis((Variant(with_orders(3), fit.hypothesis.variants[0].constants[6:]),),
                              fit.hypothesis.numbers)
    cancel = fitter.evaluate(three, np.concatenate(
        [fit.vector, [0.02, np.log(5.6010), 0.9], [0.02, np.log(5.6009), 0.9 - np.pi]]))
    left = without_idle_orders(fitter, fitter.refine(cancel))
    told = left.hypothesis.named(left.vector, 0)
    assert [told[f'amplitude_{number}'] for number in (2, 3)] == [0.0, 0.0]
    assert told['amplitude'] == pytest.approx(0.008, rel=0.05)


def test_one_order_stays_one():
    fitter, fit = cogging(recording(WAVES[0]))
    assert with_more_orders(fitter, fit) is fit


def test_a_model_file_holds_them():
    run = recording(*WAVES)
    settings = EffectSetting('cogging_torque', {
        'amplitude': 0.008, 'order': 7.0, 'phase': 0.3, 'amplitude_2': 0.006, 'order_2': 12.0,
        'phase_2': -1.0, 'amplitude_3': 0.004, 'order_3': 5.0, 'phase_3': 2.0,
        'second_sine': 0.0, 'second_cosine': 0.0})
    entry, = problem_of([run], MODEL).runs
    without, with_them = (entry.measured - entry.predicted(physics_of(model)) for model in (
        MODEL, replace(MODEL, effects=(settings,))))
    assert np.std(with_them) < 0.1 * np.std(without)


@pytest.mark.slow
def test_it_is_told_as_one_effect_and_nothing_beside_it():
    found = diagnose([recording(*WAVES)], MODEL)
    told = [entry for entry in found.effects if entry.probability >= 0.5]
    assert [entry.effect for entry in told] == ['cogging_torque']
    parameters = told[0].parameters
    assert sorted(round(parameters[name].value) for name in ('order', 'order_2', 'order_3')) \
        == [5, 7, 12]
    assert '12 times' in told[0].statement


@pytest.mark.filterwarnings('error:overflow')
def test_cogging_of_a_linear_axis_is_named_with_its_wave_number():
    scale = 0.007       # m a motor's radian; the screw's lead is 44 mm
    linear = replace(MODEL, joint=Joint('carriage', 'prismatic'), motor=replace(
        MODEL.motor, inertia=MODEL.motor.inertia / scale ** 2,
        viscous_friction=MODEL.motor.viscous_friction / scale ** 2),
        friction=replace(MODEL.friction, coulomb=MODEL.friction.coulomb / scale,
                         saturation_velocity=MODEL.friction.saturation_velocity * scale))
    turning = recording((0.008, 3.0, 0.3))
    run = replace(turning, position=turning.position * scale, effort=turning.effort / scale)
    found = diagnose([run], linear).effects
    assert [entry.effect for entry in found] == ['cogging_torque']
    assert found[0].parameters['order'].value == pytest.approx(3.0 / scale, rel=0.01)
    assert found[0].parameters['order'].unit == '1/m'
    assert found[0].parameters['amplitude'].value == pytest.approx(0.008 / scale, rel=0.05)
    assert 'repeats every 0.0147 m' in found[0].statement
