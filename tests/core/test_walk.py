# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A walk that goes on from the last one comes to what a fresh one does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engb_core.effects.base import (
    ACCELERATION,
    DIRECTION,
    DISC_ANGLE,
    DISC_SPEED,
    Effect,
    INERTIA,
    LEVEL,
    PAD_TEMPERATURE,
    Parameter,
    POSITION,
    SAMPLE_SIZE,
    STATE_SIZE,
    TIME,
    TIME_STEP,
    VELOCITY,
)
from engb_core.effects.catalogue import catalogue, get_effect
from engb_core.effects.law import law_effect
from engb_core.laws.grammar import parameters_of, parse
from engb_core.model import Model
from engb_core.physics import walk as walking
from engb_core.physics.compiled import effect_function, EffectFunction, Numbers
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.nominal_torque import N_TERMS
from engb_core.physics.plant import Physics, physics_of, with_values
from engb_core.physics.walk import Walk

STEP = 1e-3
# A table without a name has no layout of its own.
EFFECTS = [effect for effect in catalogue().values()
           if effect.made_of is None and effect.stages and effect.id != 'unexplained_surface']
OF_MOTION = [effect for effect in EFFECTS if effect.of_motion]
PROPORTIONAL = [effect for effect in EFFECTS if effect.proportional is not None]


def motion() -> np.ndarray:
    """Return strokes with a reversal and a rest, a disc that slows and a pad that warms."""
    time = np.arange(0.0, 3.0, STEP)
    samples = np.zeros((time.size, SAMPLE_SIZE))
    samples[:, TIME], samples[:, TIME_STEP] = time, STEP
    samples[:, POSITION] = 12.0 * (1.0 - np.cos(np.minimum(time, 2.5) * 2.0)) + 0.5
    samples[:, VELOCITY] = np.gradient(samples[:, POSITION], STEP)
    samples[:, ACCELERATION] = np.gradient(samples[:, VELOCITY], STEP)
    samples[:, DISC_SPEED] = 60.0 - 15.0 * time
    samples[:, DISC_ANGLE] = np.cumsum(samples[:, DISC_SPEED]) * STEP
    samples[:, PAD_TEMPERATURE] = 20.0 + 40.0 * time
    return samples


def law(formula: str, acts_as: str) -> Effect:
    names = parameters_of(parse(formula))
    return law_effect(formula, acts_as, tuple(
        Parameter(name, '-', -1e3, 1e3, none=0.0, starts=(0.1,)) for name in names), {})


LAWS = [law('a * abs(load)', 'torque'), law('a * sin(b * position)', 'load_gain'),
        law('a * exp(-since_reversal / b)', 'friction_gain'), law('a * load', 'effort_gain'),
        law('a * sin(b * position)', 'inertia'), law('a * position', 'load_shift')]


def values(effect: Effect) -> list[float]:
    """Return values at which it acts."""
    found = [entry.starts[0] if entry.starts else 0.5 * (entry.low + min(entry.high, 10.0))
             for entry in effect.parameters]
    # Where constants have no defaults they are the two ends of the stroke.
    return [*found, *(effect.defaults.get(name, 20.0 * place)
                      for place, (name, _) in enumerate(effect.constants))]


def made(*effects: Effect) -> Physics:
    return physics_of(Model(), [(effect, values(effect)) for effect in effects])


def moved(physics: Physics, generator: np.random.Generator) -> Physics:
    """Return the physics with one of its numbers moved a little."""
    nominal, parameters = physics.nominal.copy(), physics.parameters.copy()
    if generator.random() < 0.3:
        nominal[generator.integers(3)] *= 1.01
    else:
        parameters[generator.integers(parameters.shape[0]), 0] *= 1.01
    return with_values(physics, nominal, parameters)


@pytest.mark.parametrize('effect', [*EFFECTS, *LAWS], ids=lambda effect: effect.equation[:30])
def test_whatever_moved_last_the_effort_is_that_of_a_fresh_walk(effect):
    """Beside an effect of each stage; in the order in which a fit might try numbers."""
    generator = np.random.default_rng(0)
    beside = [get_effect(name) for name in ('pad_creep', 'stribeck_friction', 'cogging_torque',
                                            'presliding_friction', 'torque_ripple')]
    physics = made(*(entry for entry in beside if entry.id != effect.id), effect)
    walk, samples = Walk(), motion()
    for _ in range(25):
        trial = moved(physics, generator)
        physics = trial if generator.random() < 0.5 else physics
        np.testing.assert_array_equal(effort_of_motion(samples, STEP, trial, walk=walk),
                                      effort_of_motion(motion(), STEP, trial))


def test_a_table_that_others_write_into_is_walked_anew():
    walk, samples, physics = Walk(), motion(), made(get_effect('stribeck_friction'))
    before = effort_of_motion(samples, STEP, physics, walk=walk)
    effort_of_motion(samples, STEP, made(get_effect('coulomb_friction_error'),
                                         get_effect('pad_creep')))
    walk.forget()
    np.testing.assert_array_equal(effort_of_motion(samples, STEP, physics, walk=walk), before)


def test_a_gain_of_the_motion_is_not_computed_again_where_the_load_moved(monkeypatch):
    physics = made(get_effect('pad_friction_fade'), get_effect('stribeck_friction'),
                   get_effect('presliding_friction'), get_effect('torque_ripple'))
    walk, samples = Walk(), motion()
    effort_of_motion(samples, STEP, physics, walk=walk)
    nominal = physics.nominal.copy()
    nominal[N_TERMS + 1:] *= 1.01
    trial = with_values(physics, nominal, physics.parameters)
    with monkeypatch.context() as patched:
        patched.setattr(EffectFunction, 'values', None)
        again = effort_of_motion(samples, STEP, trial, walk=walk)
    np.testing.assert_array_equal(again, effort_of_motion(motion(), STEP, trial))


@pytest.mark.parametrize('name', ['cogging_torque', 'torque_ripple', 'stribeck_friction'])
def test_what_comes_before_a_number_that_moved_is_not_computed_again(name, monkeypatch):
    """Nor any other effect."""
    physics = made(get_effect('pad_creep'), get_effect(name))
    walk, samples = Walk(), motion()
    effort_of_motion(samples, STEP, physics, walk=walk)
    monkeypatch.setattr(walking, '_loaded', None)
    monkeypatch.setattr(walking, '_needed', None)
    parameters = physics.parameters.copy()
    parameters[1, 0] *= 1.1
    trial = with_values(physics, physics.nominal, parameters)
    np.testing.assert_array_equal(effort_of_motion(samples, STEP, trial, walk=walk),
                                  _fresh(trial, monkeypatch))


def _fresh(physics: Physics, monkeypatch) -> np.ndarray:
    monkeypatch.undo()
    return effort_of_motion(motion(), STEP, physics)


@pytest.mark.parametrize('effect', OF_MOTION, ids=[effect.id for effect in OF_MOTION])
def test_what_is_said_to_look_at_the_motion_alone_does(effect):
    physics, samples = made(effect), motion()
    for stage in effect.stages:
        told = []
        for filling in (0.3, 0.7):
            other = np.full(samples.shape, filling)
            for place in (TIME_STEP, TIME, POSITION, VELOCITY, ACCELERATION, DISC_SPEED,
                          DISC_ANGLE, PAD_TEMPERATURE):
                other[:, place] = samples[:, place]
            if stage == 'direction':
                other[:, DIRECTION] = np.sign(samples[:, VELOCITY])
            value = effect.stages[stage].values(physics.parameters[0], np.zeros(STATE_SIZE),
                                                other)
            told.append(value / filling if stage in ('load', 'level', 'actuation') else value)
        np.testing.assert_allclose(*told, rtol=1e-12)


@pytest.mark.parametrize('effect', [*PROPORTIONAL, LAWS[3]],
                         ids=[*(effect.id for effect in PROPORTIONAL), 'law'])
def test_dividing_by_a_gain_gives_what_the_search_does(effect):
    physics = made(effect)
    assert physics.proportional
    searched = effort_of_motion(motion(), STEP, replace(physics, proportional=False))
    divided = effort_of_motion(motion(), STEP, physics)
    np.testing.assert_allclose(divided, searched, atol=1e-6 * np.abs(searched).max())


def test_a_gain_that_goes_with_the_heat_of_the_effort_is_searched_for():
    effect = get_effect('unexplained_gain_drift')
    assert not physics_of(Model(), [(effect, [0.1, 0.5, 60.0, 0.5, 1.0])]).proportional


@effect_function
def _heavier(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    sample[INERTIA] += 1e-5
    return parameters[0] * sample[LEVEL]


def test_an_effect_that_adds_to_the_inertia_before_the_torque_adds_it_once():
    """Nothing goes on from samples that it has added to."""
    heavier = replace(get_effect('coulomb_friction_error'), stages={'level': _heavier})
    physics = physics_of(Model(), [(heavier, [1.1])])
    parameters = physics.parameters.copy()
    parameters[0, 0] = 1.2
    other = with_values(physics, physics.nominal, parameters)
    walk, samples = Walk(), motion()
    effort_of_motion(samples, STEP, physics, walk=walk)
    np.testing.assert_array_equal(effort_of_motion(samples, STEP, other, walk=walk),
                                  effort_of_motion(motion(), STEP, other))


@pytest.mark.parametrize('effect', [effect for effect in EFFECTS if effect.memoryless],
                         ids=lambda effect: effect.id)
def test_what_is_memoryless_remembers_nothing(effect):
    values = [entry.starts[0] if entry.starts else entry.high for entry in effect.parameters]
    physics = physics_of(Model(), [(effect, [*values, *effect.defaults.values()])])
    state = physics.fresh_state()
    Walk().torques_of(physics, state, motion())
    assert not state.any()
    assert {function for function, _ in physics.apart} == {effect.stages['torque']}
