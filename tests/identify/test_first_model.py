# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The first model of any axis: numbers near the truth, a load only where there is one."""

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.identify.first_model import first_model
from engb_core.recording import Recording
from tests.tables.other_benches import Drive
from tests.tables.other_benches import recorded as drive
from tests.tables.simulated_bench import sampled, TORQUE_CONSTANT

TIME = np.arange(16000) * 1e-3
ANGLE = 3.0 * np.sin(1.3 * TIME) + 1.1 * np.sin(4.7 * TIME + 1.0) + 0.4 * np.sin(11.0 * TIME)
SPEED, ACCELERATION = np.gradient(ANGLE, TIME), np.gradient(np.gradient(ANGLE, TIME), TIME)


def recorded(load, seed=0):
    effort = 2e-3 * ACCELERATION + 3e-3 * SPEED + 0.05 * np.sign(SPEED) + load(ANGLE)
    noise = np.random.default_rng(seed).normal(0.0, 2e-3, TIME.size)
    return Recording.from_samples('run', TIME, ANGLE, effort + noise)


@pytest.mark.parametrize(('load', 'form'), [
    (lambda angle: 0.0 * angle, 'none'),
    (lambda angle: 0.0 * angle + 0.02, 'offset'),
    (lambda angle: 0.03 * angle, 'polynomial of degree 1'),
    (lambda angle: 0.1 * np.sin(angle + 0.3), 'sinusoid'),
    (lambda angle: 0.05 * np.maximum(angle - 1.0, 0.0), 'contact, then a polynomial of degree 1'),
])
def test_the_form_of_the_load(load, form):
    found = first_model([recorded(load)])
    assert found.scores[0].form == form
    for name, truth in (('inertia', 2e-3), ('viscous_friction', 3e-3), ('coulomb', 0.05)):
        number = found.numbers[name]
        assert abs(number.value - truth) < max(4.0 * number.std, 0.03 * truth), (name, number)


@pytest.mark.parametrize(('load', 'truth'), [
    (lambda angle: 0.02 + 0.03 * angle, {'p0': (0.02, 'N·m'), 'p1': (0.03, 'N·m/rad')}),
    (lambda angle: 0.1 * np.sin(angle + 0.3), {'amplitude': (0.1, 'N·m'), 'phase': (0.3, 'rad')}),
    (lambda angle: 0.05 * np.maximum(angle - 1.0, 0.0),
     {'p1': (0.05, 'N·m/rad'), 'contact_angle': (1.0, 'rad')}),
    (lambda angle: 0.02 * np.maximum(angle + 1.0, 0.0) ** 2, {
        'p1': (0.0, 'N·m/rad'), 'p2': (0.02, 'N·m/rad²'), 'contact_angle': (-1.0, 'rad')}),
], ids=['polynomial', 'sinusoid', 'contact', 'curved contact'])
def test_the_load_s_numbers_are_those_of_the_model_file(load, truth):
    """With their units and deviations, which hold the truth; of 16 draws each within 3.5."""
    off = {name: [] for name in truth}
    for seed in range(4):
        found = first_model([recorded(load, seed)])
        numbers, file = found.numbers, found.model.load_torque
        assert set(numbers) - {'inertia', 'viscous_friction', 'coulomb'} == set(truth)
        for name, (value, unit) in truth.items():
            written = (file.coefficients[int(name[1])] if name[1:].isdigit()
                       else getattr(file, name))
            assert (numbers[name].value, numbers[name].unit) == (pytest.approx(written), unit)
            assert f'{name:<22}{written:12.4g} ±' in found.summary()
            assert 0.0 < numbers[name].std < 0.2
            off[name].append((numbers[name].value - value) / numbers[name].std)
            assert numbers[name].determined == (value != 0.0)
    for name, draws in off.items():
        assert max(map(abs, draws)) < 3.5, (name, draws)


@pytest.mark.parametrize(('effect', 'seed'), [(None, 99), ('stribeck_friction', 12),
                                              ('cogging_torque', 13)])
def test_no_load_is_taken_for_what_the_model_lacks(effect, seed):
    """The best of a dozen forms is ahead of none by chance, or by an effect that is no load."""
    run = sampled(effect, 10, seed)
    found = first_model([Recording('bench', run['t'], run['phi'], TORQUE_CONSTANT * run['i'])])
    assert found.scores[0].form == 'none'


@pytest.mark.parametrize('friction', [
    lambda angle: 1.0 + 0.5 * np.sin(angle),
    lambda angle: 1.0 + 0.15 * np.maximum(angle, 0.0) ** 2,
    lambda angle: 1.0 + 0.8 * np.exp(-TIME / 4.0)], ids=['wave', 'end of stroke', 'warming'])
@pytest.mark.parametrize('offset', [0.0, 0.02])
def test_friction_that_differs_from_place_to_place_is_no_load(friction, offset):
    """What helps beside a load may be its friction alone, which needs no load."""
    effort = (2e-3 * ACCELERATION + 3e-3 * SPEED + 0.05 * np.sign(SPEED) * friction(ANGLE)
              + offset)
    noise = np.random.default_rng(0).normal(0.0, 2e-3, TIME.size)
    found = first_model([Recording.from_samples('run', TIME, ANGLE, effort + noise)])
    assert found.scores[0].form == ('offset' if offset else 'none')
    assert set(found.numbers) == {'inertia', 'viscous_friction', 'coulomb',
                                  *(('offset',) if offset else ())}
    assert found.model.load_torque.coefficients == (
        pytest.approx((offset,), abs=4e-3) if offset else (0.0,))


@pytest.mark.slow
@pytest.mark.parametrize('seed', [0, 4])
def test_friction_that_falls_as_a_drive_warms_up_is_no_load(seed):
    run = drive(Drive(warm=(1.2, 8.0)), seed, 40)
    found = first_model([Recording('stand4', run['t'], run['phi'], 0.06 * run['i'])])
    assert found.scores[0].form == 'none'
    assert any('changes with time' in text for text in found.not_told)


def test_a_load_that_few_blocks_touch_is_a_load():
    """Each block but two would be predicted as well without."""
    angle = np.where(TIME < 3.0, ANGLE, 0.2 * ANGLE)
    turn = (TIME > 2.9) & (TIME < 3.1)
    angle[turn] = np.interp(TIME[turn], TIME[~turn], angle[~turn])
    speed = np.gradient(angle, TIME)
    effort = (2e-3 * np.gradient(speed, TIME) + 3e-3 * speed + 0.05 * np.sign(speed)
              + 0.05 * np.maximum(angle - 1.0, 0.0))
    noise = np.random.default_rng(0).normal(0.0, 2e-3, TIME.size)
    found = first_model([Recording.from_samples('run', TIME, angle, effort + noise)])
    assert found.scores[0].form.startswith('contact')


def test_a_stretch_that_no_form_explains_does_not_decide():
    """A weight's sine behind a gear, and a second in which the gear's play clatters: a straight
    line, which is off everywhere, seemed to expect it."""
    angle, speed, acceleration = 7.0 * ANGLE, 7.0 * SPEED, 7.0 * ACCELERATION
    effort = (1e-4 * acceleration + 6e-4 * speed + 0.012 * np.sign(speed)
              + 0.1 * np.sin(angle / 20.0))
    clatter = np.where((TIME > 13.0) & (TIME < 14.0), 0.02 * np.sin(40.0 * TIME), 0.0)
    noise = np.random.default_rng(0).normal(0.0, 2e-3, TIME.size)
    found = first_model([Recording.from_samples('run', TIME, angle, effort + clatter + noise)])
    assert found.scores[0].form in [f'polynomial of degree {degree}' for degree in (3, 4, 5)]


def test_what_cannot_be_told_is_said():
    found = first_model([recorded(lambda angle: 0.0 * angle + 0.02)])
    assert any('differs between the directions' in text for text in found.not_told)


def test_too_little_motion_is_refused():
    with pytest.raises(InputError, match='too little motion'):
        first_model([Recording.from_samples('still', TIME, 0.0 * TIME, 0.0 * TIME)])


def test_an_effort_that_counts_the_other_way_is_refused():
    """Friction and inertia come out as none then, which says nothing of the axis."""
    run = recorded(lambda angle: 0.03 * angle)
    turned = Recording.from_samples('bench', TIME, ANGLE, -run.effort)
    with pytest.raises(InputError, match=r'bench: effort works against.*--scale effort=-1'):
        first_model([turned])


def test_a_load_that_drives_the_axis_is_no_wrong_sign():
    """A weight that is let down: the motor holds against it, and takes work in."""
    sinking = -0.4 * TIME + 0.2 * np.sin(3.0 * TIME)
    speed = np.gradient(sinking, TIME)
    effort = (2e-3 * np.gradient(speed, TIME) + 3e-3 * speed + 0.05 * np.sign(speed) + 0.5
              + np.random.default_rng(0).normal(0.0, 2e-3, TIME.size))
    found = first_model([Recording.from_samples('lift', TIME, sinking, effort)])
    assert found.numbers['coulomb'].value == pytest.approx(0.05, rel=0.2)
