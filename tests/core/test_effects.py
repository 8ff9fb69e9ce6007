# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Every effect of the catalogue: one definition that simulation and inverse dynamics share.

A new file in engb_core/effects is covered by being there.
"""

from __future__ import annotations

from dataclasses import replace
import os
from pathlib import Path
import re
import subprocess
import sys

import numpy as np
import pytest
from scipy.optimize import least_squares

from engb_core.effect_check import compared, effort_needed, FLOOR, TOLERANCE
from engb_core.effects.base import (
    ACCELERATION,
    COULOMB,
    DIRECTION,
    Effect,
    EFFORT,
    INERTIA,
    LEVEL,
    LOAD,
    POSITION,
    SAMPLE_SIZE,
    STAGES,
    STATE_SIZE,
    TIME,
    TIME_STEP,
    VELOCITY,
)
from engb_core.effects.catalogue import catalogue, get_effect
from engb_core.errors import InputError
from engb_core.model import EffectSetting, Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of

from .loops import drawn, looped, model_with, nothing, numbers

ROOT = Path(__file__).resolve().parents[2]
CONTRACT = ROOT / 'docs' / 'contract.md'
# A law is what its formula says: tests/laws.
EFFECTS = [effect for effect in catalogue().values() if effect.made_of is None]
EACH = pytest.mark.parametrize('effect', EFFECTS, ids=[effect.id for effect in EFFECTS])

# An impact in the gap happens within a sample; which part of it belongs to this one and which to
# the next no inverse can say.
TOLERANCES = {'backlash': 0.25}
# So with the dry friction beyond a shaft, taken at the end of steps of another length.
FLOORS = {'backlash': 1e-4, 'drivetrain_resonance': 7e-5}


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values ** 2)))


def test_without_effects_simulation_and_inverse_agree():
    samples, effort = looped(model_with(None))
    assert rms(compared(effort_needed(samples, model_with(None)) - effort, samples)) < FLOOR
    assert rms(effort) > 0.03


@EACH
def test_one_definition(effect):
    """The motion simulated with an effect needs, with that effect, the effort it was given."""
    if not effect.stages:
        pytest.skip('acts in inverse dynamics only')
    seen = 0
    for seed in range(6):
        model = model_with(effect, drawn(effect, seed))
        samples, effort = looped(model)
        assert np.isfinite(samples).all(), 'the simulation ran away'
        with_it = rms(compared(effort_needed(samples, model) - effort, samples))
        size = rms(compared(effort_needed(samples, model_with(None)) - effort, samples))
        assert with_it < TOLERANCES.get(effect.id, TOLERANCE) * size + FLOORS.get(
            effect.id, FLOOR), (
            f'{effect.id} {model.effects[0].parameters}: differs by {with_it:.2e} N·m, the '
            f'effect is {size:.2e} N·m')
        seen += size > 2.0 * FLOOR
        if seen == 3:
            break
    assert seen >= 2, 'at its starts the effect does next to nothing'


@EACH
def test_nothing_at_none(effect):
    values = nothing(effect, 0)
    model = model_with(effect, values)
    samples, effort = looped(replace(model, effects=()))
    np.testing.assert_allclose(effort_needed(samples, model),
                               effort_needed(samples, model_with(None)), rtol=0, atol=1e-9)
    again, same = looped(model)
    # A friction direction of its own is stepped explicitly, the model's implicitly.
    close = 1e-4 if 'direction' in effect.stages else 1e-9
    np.testing.assert_allclose(again[:, POSITION], samples[:, POSITION], rtol=0, atol=close)
    np.testing.assert_allclose(same, effort, rtol=0, atol=close)


def test_sampling_delay_moves_the_effort_in_time():
    samples, effort = looped(model_with(None))
    shifted = effort_needed(samples, model_with(get_effect('sampling_delay'), {'delay': 0.003}))
    np.testing.assert_allclose(shifted[:-3], effort_needed(samples, model_with(None))[3:],
                               atol=1e-12)


@pytest.mark.parametrize('delay', [0.0004, 0.003, 0.0101])
def test_a_pure_delay_is_one_in_simulation_too(delay):
    """Step in, step out `delay` later, not a first-order lag's creep."""
    physics = physics_of(model_with(get_effect('actuation_lag'),
                                    {'lag': delay, 'first_order': 0.0}), inverse=False)
    (function, owner), = physics.stages['actuation']
    state = physics.fresh_state()
    samples, _ = looped(model_with(None), 0.05)
    step = 1e-4
    given = []
    for index in range(400):
        sample = samples[0].copy()
        sample[:2] = step, index * step
        sample[EFFORT] = 0.0 if index < 100 else 1.0
        given.append(function(physics.parameters[owner], state[owner], sample))
    given = np.array(given)
    when = (100 + np.sum(given[100:] < 0.5)) * step
    assert when == pytest.approx(0.01 + delay, abs=2.0 * step)
    assert np.sum((given > 0.02) & (given < 0.98)) <= 4
    assert given[0] == 0.0
    assert given[-1] == pytest.approx(1.0)


@EACH
def test_words(effect: Effect):
    for seed in range(4):
        text = effect.statement(drawn(effect, seed))
        assert text.endswith('.')
        assert text[0].isupper()
        assert len(text) < 300
        assert '\n' not in text
        assert 'nan' not in text.lower()
        if effect.id != 'unexplained_surface':
            assert re.search(r'\d', text), text
        assert '{' not in text
    assert len(effect.equation) > 5
    assert len(effect.reference) > 3
    assert effect.title[0].isupper()
    module = sys.modules[f'engb_core.effects.{effect.id}']
    assert module.__doc__
    assert module.__doc__.strip().endswith('.')
    assert module.EFFECT is effect


@EACH
def test_numbers_of_the_definition(effect: Effect):
    names = [parameter.name for parameter in effect.parameters]
    assert len(set(effect.names)) == len(effect.names)
    assert set(effect.stages) <= set(STAGES)
    assert set(effect.contains) <= set(catalogue())
    for index, parameter in enumerate(effect.parameters):
        assert parameter.low < parameter.high, parameter.name
        assert parameter.unit, parameter.name
        for start in parameter.starts:
            assert parameter.low <= start <= parameter.high, parameter.name
        if parameter.logarithmic:
            assert parameter.low > 0.0, parameter.name
        if index == 0 and parameter.none is not None and not parameter.logarithmic:
            assert parameter.low <= parameter.none <= parameter.high
            assert effect.unnamed or parameter.none not in parameter.starts
    assert names == list(effect.names)[:len(names)]


@EACH
def test_at_its_bounds_it_stays_finite(effect: Effect):
    """A fit walks along the bounds: no division by nothing, no overflow."""
    samples, _ = looped(model_with(None), 1.0)
    for parameter in effect.parameters[:8]:
        for value in (parameter.low, parameter.high):
            values = drawn(effect, 0) | {parameter.name: value}
            if abs(value) > 1e5:
                continue
            found = effort_needed(samples, model_with(effect, values))
            assert np.isfinite(found).all(), (parameter.name, value)


def table_of_the_contract() -> dict[str, dict[str, str]]:
    """Return id → {parameter: unit} of the contract's table 4."""
    section = CONTRACT.read_text(encoding='utf-8').split('## 4.')[1].split('## 5.')[0]
    found = {}
    for line in section.splitlines():
        row = re.fullmatch(r'\| `(\w+)` (\|.*)', line)
        if row:
            found[row[1]] = dict(re.findall(r'`(\w+)`(?:\s*\[([^\]]+)\])?', row[2]))
    return found


CONTRACTUAL = table_of_the_contract()


def test_the_contract_is_read():
    assert len(CONTRACTUAL) == 28
    assert CONTRACTUAL['stribeck_friction'] == {'breakaway_ratio': '-',
                                                'stribeck_velocity': 'rad/s'}


@pytest.mark.parametrize('name', CONTRACTUAL)
def test_names_and_units_are_the_contract_s(name):
    units = {parameter.name: parameter.unit for parameter in get_effect(name).parameters}
    for parameter, unit in CONTRACTUAL[name].items():
        assert parameter in units
        if unit:
            assert units[parameter] == {'cycles per motor revolution': '1/rev'}.get(unit, unit)


@pytest.mark.parametrize('name', CONTRACTUAL)
def test_a_model_file_with_the_contract_s_parameters_alone_runs(name):
    """Model files come from elsewhere: they hold what the contract names, and no more."""
    values = drawn(get_effect(name), 0)
    model = Model(effects=(EffectSetting(name, {parameter: values[parameter]
                                                for parameter in CONTRACTUAL[name]}),))
    physics_of(model)
    physics_of(model, inverse=False)


def test_unknown_effects_and_parameters_are_named():
    with pytest.raises(InputError, match=r"unknown effect 'magic'; known: actuation_lag, "):
        get_effect('magic')
    with pytest.raises(InputError, match='pad_creep has no parameter .speed.; it has relaxed'):
        physics_of(Model(effects=(EffectSetting('pad_creep', {'speed': 1.0}),)))
    with pytest.raises(InputError, match='asymmetric_friction needs the parameter asymmetry'):
        physics_of(Model(effects=(EffectSetting('asymmetric_friction', {}),)))
    with pytest.raises(InputError, match='pad_creep.relaxed_fraction must be one number'):
        physics_of(Model(effects=(EffectSetting('pad_creep', {'relaxed_fraction': [1.0]}),)))


@pytest.mark.parametrize(('name', 'parameter', 'value'), [
    ('load_hysteresis', 'memory_distance', 0.0), ('pad_creep', 'time_constant', 0.0),
    ('torque_saturation', 'onset', 1.0), ('drivetrain_resonance', 'inertia_fraction', 1.5),
    ('stribeck_friction', 'stribeck_velocity', 0.0), ('friction_drift', 'settling', 0.0),
    ('drivetrain_resonance', 'frequency', 0.0), ('inertia_error', 'inertia', -1e308)])
def test_numbers_that_cannot_be_are_named(name, parameter, value):
    effect = get_effect(name)
    with pytest.raises(InputError, match=re.escape(f'{parameter} = {value:g}')):
        physics_of(model_with(effect, drawn(effect, 0) | {parameter: value}))


def test_effects_add_up():
    """Two effects of different stages change the effort as each does alone."""
    samples, _ = looped(model_with(None), 2.0)
    cogging = EffectSetting('cogging_torque', {'amplitude': 0.003, 'order': 4.0})
    drag = EffectSetting('nonlinear_viscous_friction', {'quadratic_viscous_friction': 1e-6})
    base = model_with(None)

    def change(*settings):
        model = Model(base.motor, base.load_torque, base.friction, effects=settings)
        return effort_needed(samples, model) - effort_needed(samples, base)

    np.testing.assert_allclose(change(cogging, drag), change(cogging) + change(drag), atol=1e-12)


def test_without_numba_the_same_numbers(tmp_path):
    """Plain Python runs the same functions; nothing may depend on the compiler."""
    script = ('import sys; sys.modules["numba"] = None\n'
              'from engb_core.physics.compiled import COMPILED; assert not COMPILED\n'
              'import numpy; from tests.core.loops import numbers\n'
              'numpy.savez(sys.argv[1], **numbers())')
    done = subprocess.run([sys.executable, '-c', script, str(tmp_path / 'plain.npz')], cwd=ROOT,
                          env=os.environ | {'PYTHONPATH': str(ROOT)}, capture_output=True,
                          text=True, timeout=200)
    assert done.returncode == 0, done.stderr
    assert 'Traceback' not in done.stderr
    compiled = numbers()
    with np.load(tmp_path / 'plain.npz') as plain:
        assert set(plain.files) == set(compiled)
        for name in plain.files:
            np.testing.assert_allclose(plain[name], compiled[name], rtol=1e-7, atol=1e-10,
                                       err_msg=name)


def test_friction_beyond_a_gap_stays_friction_where_it_has_drifted_down():
    """Below its constant part nothing is left that load adds."""
    sample = np.zeros(SAMPLE_SIZE)
    sample[[TIME_STEP, INERTIA, COULOMB, LEVEL]] = 1e-3, 7e-5, 0.02, 0.012
    sample[[VELOCITY, DIRECTION, LOAD]] = 5.0, 1.0, 0.01
    torque = get_effect('backlash').stages['torque']

    def passed(loaded: float) -> list[float]:
        state = np.zeros(STATE_SIZE)
        values = np.array([0.5, 0.3, 0.2, loaded, 0.0, 80.0, 1.0, 0.0, 0.0])
        return [float(torque(values, state, _at(sample, moment)))
                for moment in (0.0, 1e-3, 2e-3, 3e-3)]

    assert passed(1.0) == passed(0.0)
    sample[LEVEL] = 0.03
    assert passed(1.0) != passed(0.0)


def _at(sample: np.ndarray, moment: float) -> np.ndarray:
    moved = sample.copy()
    moved[TIME] = moment
    # The motor reverses.
    moved[VELOCITY] -= 3e3 * moment
    return moved


@pytest.mark.parametrize('exponent', [2.0, 5.0])
def test_a_motor_that_hardly_gives_more_is_within_the_formula_of_saturation(exponent):
    """The usual soft limit i/(1 + (i/i_s)^p)^(1/p), where 72 % is lost."""
    effort = np.linspace(0.0, 1.0, 200)
    given = effort / (1.0 + (0.28 ** -exponent - 1.0) * effort ** exponent) ** (1.0 / exponent)
    effect = get_effect('torque_saturation')
    samples = np.zeros((effort.size, SAMPLE_SIZE))

    def missed(parameters: np.ndarray) -> np.ndarray:
        physics = physics_of(Model(), [(effect, [*parameters, 1.0])])
        samples[:, EFFORT] = effort
        effect.stages['actuation'].loop(physics.parameters[0], np.zeros(STATE_SIZE), samples,
                                        EFFORT)
        return samples[:, EFFORT] - given

    bounds = np.array([(entry.low, entry.high) for entry in effect.parameters]).T
    best = min((least_squares(missed, (0.55, shape, onset), bounds=bounds)
                for shape, onset in ((2.0, 0.1), (1.2, 0.4))), key=lambda found: found.cost)
    assert rms(best.fun) < 0.05 * rms(effort - given)


@pytest.mark.parametrize('parameters', [(0.23, 5.7, 0.0), (0.9, 8.0, 0.8), (0.9, 1.0, 0.8),
                                        (0.6, 1.0, 0.8), (0.1, 1.5, 0.3)])
def test_a_saturated_motor_gives_more_for_more(parameters):
    """Whatever a fit tries: else no effort could be told from the torque that is needed."""
    effect = get_effect('torque_saturation')
    physics = physics_of(Model(), [(effect, [*parameters, 0.3])])
    torque = np.linspace(-0.3, 0.3, 301)
    samples = np.zeros((301, SAMPLE_SIZE))
    samples[:, ACCELERATION] = torque / Model().motor.inertia
    effort = effort_of_motion(samples, 1e-3, physics)
    assert (np.diff(effort) > 0.0).all()
    samples[:, EFFORT] = effort
    effect.stages['actuation'].loop(physics.parameters[0], np.zeros(STATE_SIZE), samples, EFFORT)
    np.testing.assert_allclose(samples[:, EFFORT], torque, atol=3e-6)


def test_a_load_that_lies_at_its_flank_adds_nothing():
    """Once the impact is over, a rigid gap passes on what moves the load, to the last digit."""
    step, count = 4e-3, 4000
    time = step * np.arange(count)
    samples = np.zeros((count, SAMPLE_SIZE))
    samples[:, TIME], samples[:, TIME_STEP] = time, step
    samples[:, VELOCITY] = 8.0 * np.sin(2.0 * np.pi * 0.25 * time)
    samples[1:, ACCELERATION] = np.diff(samples[:, VELOCITY]) / step
    samples[:, DIRECTION] = np.clip(samples[:, VELOCITY] / 0.05, -1.0, 1.0)
    samples[:, INERTIA], samples[:, COULOMB], samples[:, LEVEL] = 7e-5, 0.01, 0.012
    samples[:, LOAD] = 0.03 + 0.02 * np.cos(2.0 * np.pi * 0.25 * time)
    torque = get_effect('backlash').stages['torque'].values(
        np.array([0.1, 0.3, 0.2, 0.3, 0.0, 80.0, 1.0, 0.0, 0.0]), np.zeros(STATE_SIZE), samples)
    # The load is always held back: it lies at one flank.
    assert np.abs(torque[50:]).max() < 1e-12
