# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A mechanism that no effect of the library holds is found as a law; noise and onsets are none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.full_bandwidth import CorrectedModels
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.unknown.openset import Explanation
from engb_core.effects.catalogue import get_effect
from engb_core.laws import competition
from engb_core.laws.blocks import Blocks, HEARD, stretches_of_time
from engb_core.laws.competition import _beats, _without_idle_names, law_instead
from engb_core.laws.forms import Atom, Form, Slot
from engb_core.laws.grammar import parse
from engb_core.laws.judgement import depends_on, find_law, fits_elsewhere, Found
from engb_core.laws.law_search import _Searching, Screened
from engb_core.model import EffectSetting, Friction, LoadTorque, Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.physics.sample_table import sample_table
from engb_core.recording import Recording

MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4)),
              friction=Friction(0.012, 0.1, 0.3))
STEP = 1e-3
QUANTUM = 2.0 * np.pi / 65536


def recorded(*effects: EffectSetting, seed: int = 1, extra: np.ndarray | None = None,
             model: Model = MODEL) -> Recording:
    """Return a recording of 36 s of many speeds and ways, by a brake with these effects."""
    time = np.arange(0.0, 36.0, STEP)
    phase = np.cumsum(1.5 + 1.2 * np.sin(0.31 * time)) * STEP
    way = 6.0 + 4.0 * np.sin(0.173 * time)
    position = 12.0 + way * np.sin(phase) + 0.8 * np.sin(2.9 * phase)
    velocity = np.gradient(position, STEP)
    samples = sample_table(STEP, time, position, velocity, np.gradient(velocity, STEP))
    effort = effort_of_motion(samples, STEP, physics_of(replace(model, effects=effects)))
    noise = np.random.default_rng(seed).normal(0.0, 2e-3, time.size)
    return Recording('run', time, np.round(position / QUANTUM) * QUANTUM,
                     effort + noise + (0.0 if extra is None else extra))


def law(formula: str, acts_as: str, **values: float) -> EffectSetting:
    return EffectSetting('law', values, formula, acts_as, {'velocity': (-80.0, 80.0)})


def found_in(recording: Recording):
    fitter = Fitter(problem_of([recording], MODEL), 1)
    found = find_law(fitter, fitter.finish(fitter.refine(fitter.base())), lambda text: None)
    return found if isinstance(found, Found) else None


def test_inertia_over_the_angle():
    found = found_in(recorded(law('a * sin(0.83 * position + 1)', 'inertia', a=3.5e-5)))
    assert found is not None
    assert found.candidate.form.acts_as == 'inertia'
    assert set(depends_on(found.candidate)) == {'position', 'acceleration'}
    assert found.parameters['b'].value == pytest.approx(0.83, abs=0.03)
    assert found.parameters['a'].unit == 'kg·m²'
    assert not found.memory and found.explained > 0.9


def test_a_cable_at_one_end_has_memory():
    found = found_in(recorded(law('a * stop(position, 0.6) * step(b - position, 0.3)', 'torque',
                                  a=0.012, b=10.0)))
    assert found is not None
    assert found.memory
    assert 'position' in depends_on(found.candidate)


def test_no_law_in_noise():
    assert found_in(recorded(seed=2)) is None


def test_an_onset_is_no_law():
    time = np.arange(0.0, 36.0, STEP)
    assert found_in(recorded(extra=0.012 * (time > 17.3))) is None


def test_no_law_in_what_follows_no_motion():
    """A random walk of torque has structure, but none that the motion tells."""
    walk = np.cumsum(np.random.default_rng(3).normal(0.0, 3e-4, 36000))
    assert found_in(recorded(extra=walk - walk.mean())) is None


def test_a_diagnosis_tells_the_law_and_holds_it():
    """From the recording to the corrected model: the law is told, and predicts another motion."""
    hidden = law('a * peak(velocity / 6) * step(position - 13, 0.2)', 'torque', a=0.02)
    diagnosis = diagnose([recorded(hidden)], MODEL, threads=1)
    assert diagnosis.effects == ()
    assert diagnosis.unexplained is not None and diagnosis.unexplained.law is not None
    told = diagnosis.unexplained.law
    assert {'position', 'velocity'} <= set(diagnosis.unexplained.depends_on)
    assert not diagnosis.unexplained.memory
    parse(told.formula)
    setting = diagnosis.model.effects[-1]
    assert setting.effect == 'law' and setting.formula == told.pattern
    assert len(told.formula) < 100 and told.line in diagnosis.unexplained.statement

    time = np.arange(0.0, 12.0, STEP)
    position = 12.0 + 8.0 * np.sin(2.3 * time)
    samples = sample_table(STEP, time, position, 18.4 * np.cos(2.3 * time),
                           -42.32 * np.sin(2.3 * time))

    def effort(model: Model) -> np.ndarray:
        return effort_of_motion(samples.copy(), STEP, physics_of(model))

    true = effort(replace(MODEL, effects=(hidden,)))
    moving = np.abs(samples[:, 3]) > 1.0
    before, after = (np.std((effort(model) - true)[moving])
                     for model in (MODEL, diagnosis.model))
    assert after < 0.15 * before


def test_a_likely_name_stands_beside_a_law():
    """What the library knows keeps its name; the law is for what is left."""
    diagnosis = diagnose([recorded(
        EffectSetting('cogging_torque', {'order': 6.0, 'amplitude': 0.02, 'phase': 1.0}),
        law('a * peak(velocity / 6) * step(position - 13, 0.2)', 'torque', a=0.02))], MODEL,
        threads=1)
    names = [entry.effect for entry in diagnosis.effects if entry.probability >= 0.5]
    assert names == ['cogging_torque']
    assert diagnosis.verdict == 'partly_explained'
    assert diagnosis.unexplained is not None and diagnosis.unexplained.law is not None
    assert {'position', 'velocity'} <= set(diagnosis.unexplained.depends_on)
    assert 'corrects the form' not in diagnosis.unexplained.statement
    assert [setting.effect for setting in diagnosis.model.effects][-1] == 'law'
    assert 'cogging_torque' in [setting.effect for setting in diagnosis.model.effects]


def test_a_name_whose_form_does_not_fit_gets_its_correction_as_a_law():
    """Cogging that grows from one place of the stroke on keeps its name, and says by how much."""
    diagnosis = diagnose([recorded(
        EffectSetting('cogging_torque', {'order': 6.0, 'amplitude': 0.02, 'phase': 1.0}),
        law('a * positive(position - 14) * sin(6 * position + 1)', 'torque', a=0.008))], MODEL,
        threads=1)
    assert [entry.effect for entry in diagnosis.effects if entry.probability >= 0.5] \
        == ['cogging_torque']
    assert diagnosis.unexplained is not None and diagnosis.unexplained.law is not None
    assert 'corrects the form of' in diagnosis.unexplained.statement
    assert diagnosis.unexplained.law.explained > 0.9
    (effort,) = [entry for entry in diagnosis.held_out if entry.quantity == 'effort']
    assert effort.rms_after < 1.3 * effort.noise_floor
    assert [setting.effect for setting in diagnosis.model.effects][-2:] == [
        'cogging_torque', 'law']


@pytest.mark.parametrize(('name', 'hidden', 'falls'), [
    # Passes for friction that differs with the direction, until the law is there.
    ('asymmetric_friction', law('a * tanh(effort / b)', 'effort_gain', a=0.1, b=0.02), True),
    ('stribeck_friction', EffectSetting(
        'stribeck_friction', {'breakaway_ratio': 2.0, 'stribeck_velocity': 2.0}), False)])
def test_a_likely_name_falls_to_a_law_of_other_things_alone(name, hidden, falls):
    """A law that is a name's own physics in another form does not take its place."""
    fitter = Fitter(problem_of([recorded(hidden)], MODEL), 1)
    (variant, *_) = variants_of(get_effect(name), fitter.problem.scene)
    named = fitter.finish(fitter.refine(fitter.fit(variant)))
    found = find_law(fitter, fitter.finish(fitter.refine(fitter.base())), lambda text: None)
    beaten = isinstance(found, Found) and _beats(fitter, found, named, likely=True)
    assert beaten == falls


@pytest.mark.parametrize(('hidden', 'named', 'falls'), [
    (law('a * direction * abs(acceleration)', 'torque', a=8e-5), 'torque_saturation', True),
    (EffectSetting('stribeck_friction', {'breakaway_ratio': 2.0, 'stribeck_velocity': 2.0}),
     'stribeck_friction', False)])
def test_names_that_explain_all_are_held_against_a_law(hidden, named, falls, monkeypatch):
    """Names with numbers of their own can be bent to what one law says; a right one is not
    beaten."""
    fitter = Fitter(problem_of([recorded(hidden)], MODEL), 1)
    (variant, *_) = variants_of(get_effect(named), fitter.problem.scene)
    explanation = Explanation(fitter.finish(fitter.refine(fitter.fit(variant))), None)
    told = CorrectedModels(explanation, explanation.models(), fitter.problem, explanation.fit)
    said: list[str] = []
    won = law_instead(fitter, told, 0.7, said.append)
    assert (won is not None) == falls
    # Where names leave noise alone on blocks left out, no law is looked for.
    assert bool(said) == falls
    if won is not None:
        assert won.fallen == (named,)
        assert 'acceleration' in depends_on(won.found.candidate)
        # Nor does a name fall to one of several forms that the data do not tell apart.
        unsettled = replace(won.found, settled=False)
        monkeypatch.setattr(competition, 'find_law', lambda *_, **__: unsettled)
        assert law_instead(fitter, told, 0.7, lambda text: None) is None


def test_a_gain_that_differs_with_the_sign_is_no_load_curve():
    """Where the load pulls to both sides, a free load curve does most of what the gain does."""
    model = Model(load_torque=LoadTorque(form='sinusoid', amplitude=0.1, phase=0.3),
                  friction=Friction(0.004, 0.02, 0.3))
    recording = recorded(law('a * tanh(effort / b)', 'effort_gain', a=0.05, b=0.01), model=model)
    diagnosis = diagnose([recording], model, threads=1)
    assert [entry.effect for entry in diagnosis.effects if entry.probability >= 0.5] == []
    assert diagnosis.unexplained is not None and diagnosis.unexplained.law is not None
    assert diagnosis.unexplained.law.acts_as == 'effort_gain'
    assert 'effort' in diagnosis.unexplained.depends_on


@pytest.mark.parametrize(('name', 'hidden', 'kept'), [
    ('asymmetric_friction', (), ()),
    ('stribeck_friction', (EffectSetting(
        'stribeck_friction', {'breakaway_ratio': 2.0, 'stribeck_velocity': 2.0}),),
     ('stribeck_friction',))])
def test_a_name_that_adds_nothing_beside_the_law_falls(name, hidden, kept):
    """A gain that differs with the sign passes for asymmetric friction until the law is there."""
    gain = law('a * tanh(effort / b)', 'effort_gain', a=0.1, b=0.02)
    fitter = Fitter(problem_of([recorded(*hidden, gain)], MODEL), 1)
    (variant, *_) = variants_of(get_effect(name), fitter.problem.scene)
    named = fitter.refine(fitter.fit(variant))
    found = find_law(fitter, fitter.finish(named), lambda text: None)
    assert isinstance(found, Found)
    left = _without_idle_names(found)
    assert left.candidate.fit.hypothesis.ids == (*kept, 'law')
    # What the law explains is counted without the name that fell: it had hidden part of it.
    assert left.before > found.before if name not in kept else left.before == found.before
    assert left.explained > 0.9


def test_a_search_where_the_free_numbers_were_never_fitted_before():
    """A law that is a delay is looked for once more on another problem, whose fitter has not seen
    the numbers that names left free."""
    problem = problem_of([recorded()], MODEL)
    first, other = Fitter(problem, 1), Fitter(problem, 1)
    base = first.refit(first.base(), first.numbers[1:])
    base = other.finish(other.evaluate(base.hypothesis, base.vector))
    searching = _Searching(other, base, lambda text: None)
    assert searching._polished(Screened(
        Form('delay', (), 1e-3), searching._blocks.without())) is not None


def test_blocks_left_out_are_those_of_plain_least_squares():
    """Sums of products give what fitting anew without each block gives."""
    fitter = Fitter(problem_of([recorded()], MODEL), 1)
    base = fitter.finish(fitter.base())
    labels = stretches_of_time(fitter)
    column = np.random.default_rng(5).normal(size=(base.residual.size, 1)) * fitter.spread[:, None]
    score, = Blocks(fitter, base, labels).scores([column])
    weight = fitter.weight
    design = np.concatenate([base.jacobian, column], axis=1) * weight[:, None]
    target = base.residual * weight
    spread = np.append(base.hypothesis.prior[1], 1e9)
    noise = np.sum((fitter.sigma * weight) ** 2)
    for place, label in enumerate(np.unique(labels)):
        out = labels == label
        seen = ~out
        numbers = np.linalg.lstsq(
            np.concatenate([design[seen], np.diag(1.0 / spread)]),
            np.concatenate([target[seen], np.zeros(spread.size)]), rcond=None)[0]
        error = np.sum((target[out] - design[out] @ numbers) ** 2) / noise
        assert score.by_block[place] == pytest.approx(error, rel=1e-3)


def end_of_stroke(*effects: EffectSetting, seed: int = 1) -> Recording:
    """Return a recording of 15 s that comes to the end of the stroke in its last stretch alone."""
    time = np.arange(0.0, 15.0, STEP)
    phase = np.cumsum(2.5 + 2.0 * np.sin(0.9 * time)) * STEP
    far = 1.0 / (1.0 + np.exp(-(time - 13.2) / 0.15))
    position = 9.0 + 4.0 * np.sin(phase) + 0.8 * np.sin(2.9 * phase) + 14.0 * far
    velocity = np.gradient(position, STEP)
    samples = sample_table(STEP, time, position, velocity, np.gradient(velocity, STEP))
    effort = effort_of_motion(samples, STEP, physics_of(replace(MODEL, effects=effects)))
    noise = np.random.default_rng(seed).normal(0.0, 2e-3, time.size)
    return Recording('run', time, np.round(position / QUANTUM) * QUANTUM, effort + noise)


def test_numbers_that_one_block_alone_tells_do_not_outweigh_the_law():
    """Without the only stretch at the end of the stroke the load curve runs away there: what that
    misses says nothing of a law."""
    hidden = law('a * direction * abs(acceleration)', 'torque', a=4e-5)
    fitter = Fitter(problem_of([end_of_stroke(hidden)], MODEL), 1)
    base = fitter.finish(fitter.refine(fitter.base()))
    labels = stretches_of_time(fitter)
    alone = Blocks(fitter, base, labels, heard=HEARD).without().level
    assert Blocks(fitter, base, labels).without().level > 2.0 * alone
    found = find_law(fitter, base, lambda text: None)
    assert isinstance(found, Found) and not found.approximate
    assert set(depends_on(found.candidate)) == {'direction', 'acceleration'}
    assert found.after < 1.5


def test_what_a_block_alone_tells_of_a_law_does_not_count():
    """The numbers are heard, the law's own size is not: what acts in one block only is no law."""
    fitter = Fitter(problem_of([recorded()], MODEL), 1)
    base = fitter.finish(fitter.base())
    labels = stretches_of_time(fitter)
    once = np.where(labels == labels[0], np.sign(np.sin(np.arange(labels.size))), 0.0)
    shifted = replace(base, residual=base.residual + 9.0 * fitter.sigma * once)
    column = once[:, None] + 1e-3 * np.random.default_rng(2).normal(size=(labels.size, 1))
    blocks = Blocks(fitter, shifted, labels, heard=HEARD)
    score, = blocks.scores([column])
    assert score.level > 0.9 * blocks.without().level


def test_a_dead_band_is_a_law_of_the_effort():
    hidden = law('a * tanh(effort / b) / effort', 'effort_gain', a=-0.012, b=0.02)
    found = found_in(recorded(hidden))
    assert found is not None
    assert found.candidate.form.acts_as == 'effort_gain'
    assert depends_on(found.candidate) == ('effort',)
    assert found.parameters['a'].unit == 'N·m'
    assert found.parameters['a'].value == pytest.approx(-0.012, rel=0.1)


def test_a_law_beside_a_load_curve_of_another_form():
    """What a wrong form leaves lies along the stroke, and would bend any law to take it up."""
    bent = law('a * sin(0.31 * position + 0.4)', 'torque', a=0.02)
    hidden = law('a * direction * abs(acceleration)', 'torque', a=1.2e-4)
    diagnosis = diagnose([recorded(bent, hidden)], MODEL, threads=1)
    assert diagnosis.unexplained is not None and diagnosis.unexplained.law is not None
    assert {'direction', 'acceleration'} <= set(diagnosis.unexplained.depends_on)


def test_an_approximation_has_to_fit_other_motions():
    """A table-like product fitted to slow motion says nothing of fast motion."""
    hidden = law('a * velocity * exp(-distance / b)', 'torque', a=4e-3, b=60.0)
    fitter = Fitter(problem_of([recorded(hidden)], MODEL), 1)
    base = fitter.finish(fitter.refine(fitter.base()))
    searching = _Searching(fitter, base, lambda text: None)
    true, false = (searching._polished(Screened(form, searching._blocks.without()))
                   for form in (_form('velocity', 'exp(-distance / {0})', 50.0),
                                _form('abs(velocity)', 'exp(-time / {0})', 4.0)))
    assert true is not None and fits_elsewhere(fitter, true.fit)
    assert false is None or not fits_elsewhere(fitter, false.fit)


def _form(first: str, second: str, start: float) -> Form:
    return Form('torque', (Atom('x', first), Atom('y', second, (
        Slot('-', start, 0.02 * start, 50.0 * start, True),))), 1e-4)


def test_a_formula_too_long_for_the_machine_is_passed_over():
    fitter = Fitter(problem_of([recorded()], MODEL), 1)
    searching = _Searching(fitter, fitter.finish(fitter.base()), lambda text: None)
    film = Atom('film', ' * '.join(8 * ['step(abs(velocity) - 9, 2)']))
    searching._polish([Screened(Form('torque', (film,)), searching._blocks.without())])
    assert searching._leading() == []
