# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Where a law acts and what it is made of: contact that moves, a supply that lacks voltage, waves
beyond the stroke, sensors that the samples resolve in slow motion only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.effects.base import LOAD
from engb_core.laws.atoms import MOST_TURNS
from engb_core.laws.forms import Atom, Form, Slot
from engb_core.laws.judgement import depends_on, find_law, Found
from engb_core.laws.resolved import orders_of, resolved_parts
from engb_core.laws.statement import statement_of
from engb_core.model import Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.physics.sample_table import sample_table
from engb_core.recording import Recording, Signal
from tests.laws.test_find_law import found_in, law, MODEL, recorded
from tests.laws.test_law_effect import motion, needed, STEP, with_law

PLACE = Slot('rad', 2.0, 0.1, 10.0)
WAVE = Atom('wave', 'sin({0} * position + {1})', (Slot('1/rad', 3.0, 2.0, 4.0), PLACE), phase=True)
HINGE = Atom('hinge', 'positive(position - {0})', (PLACE,), (('rad', 1),))


def test_the_load_is_met_elsewhere_but_the_shaft_moves_as_measured():
    _, plain = needed(MODEL)
    effort, samples = needed(with_law('a * velocity', 'load_shift', a=0.01))
    angle = samples[:, 2] + 0.01 * samples[:, 3]
    assert np.allclose(samples[:, LOAD], 1e-3 * angle + 2e-4 * angle ** 2, atol=1e-12)
    assert np.array_equal(samples[:, 3], plain[:, 3])


def test_what_moves_the_load_knows_that_of_the_sample_before():
    """Not what an earlier prediction left in the table."""
    physics = physics_of(with_law('a * heat(abs(load * velocity), b)', 'load_shift', a=2.0, b=3.0))
    samples = motion()
    first = effort_of_motion(samples, STEP, physics)
    assert np.array_equal(first, effort_of_motion(samples, STEP, physics))


def test_contact_that_comes_earlier_the_warmer_the_pad():
    """The true law, also where it moves contact over much of the stroke; the motion itself, which
    an error of the sensor would change, is as measured."""
    model = Model(load_torque=replace(MODEL.load_torque, contact_angle=11.0,
                                      coefficients=(0.0, 3e-3, 3e-4)), friction=MODEL.friction)
    recording = recorded(model=model)
    time = recording.time
    warmth = 60.0 + 25.0 * np.sin(0.21 * time)
    # The load asks for no derivative of the position, and friction here for its sign alone.
    velocity = np.gradient(gaussian_filter1d(recording.position, 8.0), STEP)
    samples = sample_table(STEP, time, recording.position, velocity, np.zeros(time.size),
                           pad_temperature=warmth)
    hidden = law('a * (pad_temperature - 40)', 'load_shift', a=0.02)
    hot, cold = (effort_of_motion(samples.copy(), STEP, physics_of(replace(model, effects=entry)))
                 for entry in ((hidden,), ()))
    warm = replace(recording, effort=recording.effort + hot - cold,
                   signals={'pad_temperature': Signal(time, warmth)})
    fitter = Fitter(problem_of([warm], model), 1)
    found = find_law(fitter, fitter.finish(fitter.refine(fitter.base())), lambda text: None)
    assert isinstance(found, Found)
    assert found.candidate.form.acts_as == 'load_shift'
    assert found.parameters['a'].value == pytest.approx(0.02, rel=0.05)
    assert set(depends_on(found.candidate)) == {'pad_temperature', 'position'}


def test_a_supply_that_lacks_voltage():
    """Torque is lost where resistance and back-EMF together ask for more than there is."""
    found = found_in(recorded(law(
        'a * positive(abs(effort + b * velocity) - c) / abs(effort)', 'effort_gain', a=-0.35,
        b=2e-3, c=0.1)))
    assert found is not None
    assert found.candidate.form.acts_as == 'effort_gain'
    assert {'effort', 'velocity'} <= set(depends_on(found.candidate))
    assert any(atom.kind == 'voltage' for atom in found.candidate.form.factors)


def test_a_drive_that_gives_a_part_only_of_what_is_asked_beyond_a_limit():
    found = found_in(recorded(law(
        'a * positive(abs(effort) - b) / abs(effort)', 'effort_gain', a=-0.5, b=0.08)))
    assert found is not None
    assert [atom.kind for atom in found.candidate.form.factors] == ['effort limit']
    assert found.parameters['b'].value == pytest.approx(0.08, rel=0.1)
    assert 'no more than a limit' in statement_of(found)


@pytest.mark.parametrize(('factors', 'goes_on'), [
    ((WAVE,), True), ((HINGE,), False), ((WAVE, HINGE), False),
    ((replace(WAVE, kind='slow wave'),), False), ((Atom('load', 'load'),), False),
    ((WAVE, Atom('load', 'load')), True)])
def test_waves_alone_go_on_beyond_the_stroke(factors, goes_on):
    assert Form('torque', factors).goes_on == goes_on


def test_a_screw_goes_on_beyond_the_stroke():
    """A lead error repeats: the corrected model does not hold it where the recording ended."""
    found = found_in(recorded(law('a * load * sin(1.8 * position + 0.4)', 'torque', a=0.2)))
    assert found is not None
    fit = found.candidate.fit
    setting = fit.hypothesis.corrected(fit.vector).effects[-1]
    assert 'position' not in setting.within and 'velocity' in setting.within


def interpolated(fast: float, rate: float = 100.0) -> Recording:
    """Return 60 s at 100 Hz by a brake whose sensor errs eight times a revolution; where the shaft
    is faster than `fast` [rad/s], what that did to the controller is folded into the effort."""
    time = np.arange(0.0, 60.0, 1.0 / rate)
    phase = np.cumsum(0.9 + 0.75 * np.sin(0.29 * time)) / rate
    true = 24.0 + 18.0 * np.sin(phase) + 3.0 * np.sin(2.7 * phase)
    velocity = np.gradient(true, time)
    samples = sample_table(1.0 / rate, time, true, velocity, np.gradient(velocity, time))
    effort = effort_of_motion(samples, 1.0 / rate, physics_of(MODEL))
    generator = np.random.default_rng(5)
    folded = 0.03 * np.sin(2.0 * np.pi * np.cumsum(generator.uniform(-0.06, 0.06, time.size)))
    effort += np.where(np.abs(velocity) > fast, folded, 0.0)
    seen = true - 0.03 * np.sin(8.0 * true + 0.7)
    return Recording('run', time, seen, effort + generator.normal(0.0, 1e-3, time.size))


def test_a_sensor_is_judged_where_the_samples_resolve_it():
    fitter = Fitter(problem_of([interpolated(20.0)], MODEL), 1)
    base = fitter.finish(fitter.refine(fitter.base()))
    parts = resolved_parts(fitter, base)
    assert parts and all(part.fitter.fitted.sum() < fitter.fitted.sum() for part in parts)
    assert [part.order for part in parts] == sorted(part.order for part in parts)
    assert all(part.above < part.order for part in parts)
    found = find_law(fitter, base, lambda text: None)
    assert isinstance(found, Found)
    assert 8 in orders_of(found.candidate.form)
    assert found.parameters['a'].value == pytest.approx(0.03, rel=0.15)


def test_the_highest_orders_are_resolved_as_well():
    """Above the last octave that fits below the highest order lies a part of one."""
    fitter = Fitter(problem_of([interpolated(20.0, 400.0)], MODEL), 1)
    base = fitter.finish(fitter.refine(fitter.base()))
    last = resolved_parts(fitter, base)[-1]
    assert (last.above, last.order) == (32, MOST_TURNS)


def test_only_a_position_sensor_has_orders():
    turn = Atom('turn', 'sin(8 * position + {0})', (PLACE,), phase=True)
    once = Atom('turn', 'sin(position + {0})', (PLACE,), phase=True)
    assert orders_of(Form('position_shift', (turn,))) == [8]
    assert orders_of(Form('position_shift', (once,))) == [1]
    assert orders_of(Form('torque', (turn,))) == []
