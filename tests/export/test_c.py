# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The C of a model gives what its simulation here gives; both come from one text."""

from __future__ import annotations

import ctypes
from dataclasses import replace
import importlib.util
from pathlib import Path
import random
import subprocess

import numpy as np
import pytest

from engb_core.control.feedforward import Feedforward
from engb_core.control.trajectory import Setpoint
from engb_core.effect_check import MODEL
from engb_core.effects.base import Effect, Parameter
from engb_core.effects.catalogue import effect_of_file, registered
from engb_core.errors import InputError
from engb_core.export.c_model import c_model, feedforward_header
from engb_core.export.fmu import compiler
from engb_core.model import Cogging, EffectSetting, LoadTorque
from engb_core.physics.compiled import EffectFunction

from .machines import compiled_library, differs, machines, run_in_c, simulated

MACHINES = machines()
QUICK = ('rich', 'load_hysteresis', 'law_friction_gain')
# When effort and position are stamped is nobody's doing but the recorder's.
NOT_IN_IT = ('sampling_delay',)
# They act on the set-point or on what is recorded (test_loop.py), not under a given effort.
ROUND_IT = ('command_delay', 'command_rate_limit', 'effort_measurement_lag')


@pytest.mark.parametrize('name', [pytest.param(
    name, marks=() if name in QUICK else pytest.mark.slow) for name in MACHINES])
def test_c_gives_what_the_simulation_gives(name, tmp_path):
    model = MACHINES[name]
    made = c_model(model)
    here = simulated(model)
    there = run_in_c(compiled_library(tmp_path, made), made, model)
    # The processor's own last digits aside, both do the same operations in the same order.
    assert differs(here, there) < 1e-9
    if name not in ('nominal', *NOT_IN_IT, *ROUND_IT):
        assert differs(here, simulated(MODEL)) > 1e-5, 'the effect does nothing in this drive'
    assert bool(made.beside) == (name in NOT_IN_IT)


def test_a_number_of_the_exported_model_can_be_changed(tmp_path):
    made = c_model(MODEL)
    named = {entry.name: entry for entry in made.quantities}
    assert named['motor.inertia'].value == MODEL.motor.inertia
    # What stands there is used: a model with another number there is that other model.
    heavy = replace(MODEL, motor=replace(MODEL.motor, inertia=2e-4))
    changed = replace(made, source=made.source.replace(repr(MODEL.motor.inertia), '0.0002'))
    there = run_in_c(compiled_library(tmp_path, changed), changed, heavy)
    assert differs(simulated(heavy), there) < 1e-9


@pytest.mark.parametrize('load', [
    LoadTorque(coefficients=(0.01, 1e-3, -2e-4, 5e-6), contact_angle=2.0),
    LoadTorque(coefficients=(0.0, 1e-3)), LoadTorque('sinusoid', amplitude=0.4, phase=-0.3)],
    ids=['contact', 'everywhere', 'pendulum'])
def test_the_header_gives_the_feedforward_bit_by_bit(load, tmp_path):
    model = replace(MODEL, load_torque=load,
                    cogging=(Cogging(7.0, 1e-3, -0.3), Cogging(1.0, 5e-4)),
                    friction=replace(MODEL.friction, load_curvature=-0.4, reference_load=0.02))
    found = compiler()
    if found is None:
        pytest.skip('no C compiler (cc, gcc, clang)')
    (tmp_path / 'engb_feedforward.h').write_text(feedforward_header(model), encoding='utf-8')
    (tmp_path / 'use.c').write_text(
        '#include "engb_feedforward.h"\ndouble use(double a, double b, double c);\n'
        'double use(double a, double b, double c) { return engb_feedforward(a, b, c); }\n',
        encoding='utf-8')
    subprocess.run([found, '-std=c99', '-O2', '-Wall', '-Wextra', '-Werror', '-pedantic',
                    '-ffp-contract=off', '-shared', '-fPIC', '-o', 'use.so', 'use.c', '-lm'],
                   cwd=tmp_path, check=True)
    use = ctypes.CDLL(str(tmp_path / 'use.so')).use
    use.argtypes, use.restype = [ctypes.c_double] * 3, ctypes.c_double
    feedforward = Feedforward(model)
    draw = random.Random(1)
    for _ in range(2000):
        given = draw.uniform(-5.0, 40.0), draw.gauss(0.0, 5.0), draw.gauss(0.0, 500.0)
        assert use(*given) == feedforward.torque(Setpoint(*given))
    at_rest = 3.0, 0.0, 0.0
    assert use(*at_rest) == feedforward.torque(Setpoint(*at_rest))


def test_neither_heap_nor_recursion():
    for model in MACHINES.values():
        source = c_model(model).source
        for word in ('malloc', 'calloc', 'alloca', 'free('):
            assert word not in source


def test_an_effect_from_outside_becomes_c_too(tmp_path):
    """The one of docs/add-an-effect.md, from its page."""
    page = Path(__file__).resolve().parents[2] / 'docs' / 'add-an-effect.md'
    text = page.read_text(encoding='utf-8').split('```python\n')[1].split('```')[0]
    file = tmp_path / 'cable_drag.py'
    file.write_text(text, encoding='utf-8')
    effect = effect_of_file(file)
    with registered(effect):
        model = replace(MODEL, effects=(EffectSetting(effect.id, {
            'drag_slope': 2e-4, 'begin': 2.0}),))
        made = c_model(model)
        assert differs(simulated(model), run_in_c(compiled_library(tmp_path, made), made,
                                                  model)) < 1e-9
        assert differs(simulated(model), simulated(MODEL)) > 1e-4


def test_what_does_not_become_c_is_told_by_its_line(tmp_path):
    file = tmp_path / 'listed.py'
    file.write_text('def torque(parameters, state, sample):\n'
                    '    return sum([parameters[0], sample[2]])\n', encoding='utf-8')
    specification = importlib.util.spec_from_file_location('listed', file)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    effect = Effect('listed', 'Listed', (Parameter('size', 'N·m', 0.0, 1.0, none=0.0,
                                                   starts=(0.1,)),),
                    {'torque': EffectFunction(module.torque)}, 'T', 'none', lambda p: 'It is.')
    with registered(effect):
        model = replace(MODEL, effects=(EffectSetting('listed', {'size': 0.1}),))
        with pytest.raises(InputError, match=r'listed.torque, line 2: sum cannot be called in C'):
            c_model(model)


def test_python_s_rules_of_arithmetic_hold_in_c(tmp_path):
    """Remainders and divisions of whole numbers, loops that change their variable, swaps."""
    file = tmp_path / 'odd.py'
    file.write_text('''\
def torque(parameters, state, sample):
    total = 0.0
    short, long = 3, -7
    for step in range(5):
        last = step
        step += 10
        total += (long + step) % short + step / 4
        if step == 13:
            break
    short, long = long, short
    while long > 0:
        long -= 1
        if long == 1:
            continue
        total += last * (1 if -2 < short <= 3 or not short != -7 else 2)
    state[2:5] = total
    return total - short ** 2 - min(1, 2.5, long) + abs(short) + state[4] * -short
''', encoding='utf-8')
    specification = importlib.util.spec_from_file_location('odd', file)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    effect = Effect('odd', 'Odd', (Parameter('size', 'N·m', 0.0, 1.0, none=0.0, starts=(0.1,)),),
                    {'torque': EffectFunction(module.torque)}, 'T', 'none', lambda p: 'It is.')
    with registered(effect):
        model = replace(MODEL, effects=(EffectSetting('odd', {'size': 0.1}),))
        made = c_model(model)
        library = compiled_library(tmp_path, replace(made, source=made.source + '''
double use(double *state);
double use(double *state)
{
    const double parameters[ENGB_PARAMETER_SIZE] = {0.0};
    double sample[ENGB_SAMPLE_SIZE] = {0.0};
    return engb_odd_torque(parameters, state, sample);
}
'''))
    state, same = (ctypes.c_double * 80)(), np.zeros(80)
    library.use.restype, library.use.argtypes = ctypes.c_double, [ctypes.c_void_p]
    assert library.use(state) == module.torque(np.zeros(112), same, np.zeros(18))
    assert list(state) == same.tolist()
