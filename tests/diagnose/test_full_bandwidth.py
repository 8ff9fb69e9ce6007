# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Numbers from a sharper motion, and how sure they are."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.full_bandwidth import at_full_bandwidth, fitted_to_all
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.numbers.held_load_curve import numbers_without_load
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import problem_of, sharper
from engb_core.diagnose.uncertainty import estimates, vector_deviations
from engb_core.diagnose.unknown.openset import Explanation
from engb_core.effects.catalogue import get_effect
from engb_core.model import Friction, Model
from engb_core.physics.plant import physics_of
from engb_core.recording import Recording

from .simulated_brake import brake_with, lively, NOMINAL


def fitted(brake: Model, effect: str, model: Model = NOMINAL) -> tuple[Fitter, Fit]:
    """Return the finished fit of the effect's first variant to a recording of the brake."""
    fitter = Fitter(problem_of([lively(brake, seed=4)], model))
    variant = variants_of(get_effect(effect), fitter.problem.scene)[0]
    return fitter, fitter.finish(fitter.refine(fitter.fit(variant, keep=2)))


def test_a_short_distance_is_told_by_a_sharper_motion():
    true = 0.02
    fitter, fit = fitted(brake_with('presliding_friction', presliding_distance=true, shape=1.0),
                         'presliding_friction')
    told = at_full_bandwidth(fitter, Explanation(fit, None))

    def missed(fit: Fit) -> float:
        return abs(np.log(fit.hypothesis.named(fit.vector, 0)['presliding_distance'] / true))

    assert missed(told.explanation.fit) < 0.15
    assert missed(told.explanation.fit) < missed(fit)
    # Findings go on with what was compared before: only the numbers are others.
    assert told.explanation.fit.residual.size == fit.residual.size
    assert told.explanation.fit.jacobian is not None
    assert len(told.models) == 1
    assert told.models[0].effects[-1].parameters['presliding_distance'] == pytest.approx(
        true, rel=0.15)


def test_the_form_is_told_by_a_sharper_motion():
    """Elements that slip one after the other, chosen in the smoothed motion as Dahl's."""
    true = 0.025
    fitter, fit = fitted(brake_with('presliding_friction', presliding_distance=true, shape=1.3,
                                    elements=1.0), 'presliding_friction')
    assert fit.hypothesis.variants[0].constants == (0.0,)
    told = at_full_bandwidth(fitter, Explanation(fit, None)).explanation.fit
    assert told.hypothesis.variants[0].constants == (1.0,)
    found = told.hypothesis.named(told.vector, 0)['presliding_distance']
    assert found == pytest.approx(true, rel=0.25)


def test_what_is_multimodal_stays_as_it_is():
    fitter, fit = fitted(brake_with('backlash', gap=0.5, inertia_fraction=0.3,
                                    friction_fraction=0.6), 'backlash')
    explanation = Explanation(fit, None)
    told = at_full_bandwidth(fitter, explanation)
    assert told.explanation is explanation
    assert told.problem.runs is fitter.problem.runs


def test_a_sharper_problem_keeps_what_no_fit_may_see():
    fitter, _ = fitted(NOMINAL, 'torque_offset')
    problem = fitter.problem
    sharp = sharper(problem)
    assert sharp.runs[0].motion.step < problem.runs[0].motion.step
    for one in (problem, sharp):
        assert 0.1 < 1.0 - one.fitted.mean() < 0.3
    assert sharp.scene is problem.scene


def test_what_bounds_hold_is_no_doubt_of_what_the_data_tell():
    # Without friction that goes with load nothing tells that part's asymmetry.
    bare = replace(NOMINAL, friction=Friction(0.014, 0.0, 0.05))
    brake = brake_with('asymmetric_friction', asymmetry=0.15, growth=0.0)
    fitter, free = fitted(replace(brake, friction=bare.friction), 'asymmetric_friction', bare)
    # The load's curve would take up what does not depend on speed.
    fit = fitter.finish(fitter.refine(fitter.refit(free, numbers_without_load(fitter))))
    found = estimates(fit, fitter, 0)
    assert found['asymmetry'].std < 0.08
    assert found['asymmetry'].value == pytest.approx(0.15, abs=2.0 * found['asymmetry'].std)


def test_a_delay_that_is_held_takes_nothing_from_a_lag():
    fitter, fit = fitted(brake_with('actuation_lag', lag=0.004, first_order=1.0), 'actuation_lag')
    names = [number.name for number in fit.hypothesis.numbers]
    deviations = vector_deviations(fit, fitter)
    assert deviations[names.index('sampling_delay')] == 0.0
    found = estimates(fit, fitter, 0)['lag']
    assert found.value == pytest.approx(0.004, abs=2.0 * found.std)
    assert found.std < 0.0015


def test_what_acts_on_nothing_has_no_deviation():
    """Of drag that differs by direction nothing goes with load, nor grows beside speed."""
    recording = lively(brake_with('asymmetric_friction', asymmetry=0.3, of_drag=1.0), seed=4)
    fitter = Fitter(problem_of([recording], NOMINAL))
    drag = next(variant for variant in variants_of(
        get_effect('asymmetric_friction'), fitter.problem.scene)
        if variant.constants[0] == 1.0)   # `of_drag`
    told = estimates(fitter.finish(fitter.fit(drag)), fitter, 0)
    assert told['of_load_friction'].std is told['growth'].std is None
    assert told['asymmetry'].std is not None


def test_slow_samples_are_judged_in_a_lower_band_and_not_sharpened():
    recording = lively(brake_with('torque_offset', offset=0.004))
    slow = Recording.from_samples('slow', recording.time[::10], recording.position[::10],
                                  recording.effort[::10])
    assert problem_of([recording], NOMINAL).bandwidth == pytest.approx(20.0)
    fitter = Fitter(problem_of([slow], NOMINAL))
    assert fitter.problem.bandwidth == pytest.approx(10.0, rel=1e-3)
    explanation = Explanation(fitter.finish(fitter.base()), None)
    assert at_full_bandwidth(fitter, explanation).explanation is explanation


def test_what_is_judged_elsewhere_is_decided_here_and_fitted_to_all():
    """With recordings that are held out as well, a model is chosen by what was kept out of its
    fit, as without; then its numbers are fitted to that, too."""
    brake = brake_with('presliding_friction', presliding_distance=0.02, shape=1.0)
    recording, other = lively(brake, seed=4), lively(brake, seed=5)
    problem = problem_of([recording], NOMINAL, [other])
    kept = ~problem.runs[0].fitted
    assert 0.1 < kept.mean() < 0.3
    fitter = Fitter(problem)
    variant = variants_of(get_effect('presliding_friction'), problem.scene)[0]
    fit = fitter.finish(fitter.refine(fitter.fit(variant, keep=2)))
    told = at_full_bandwidth(fitter, Explanation(fit, None))
    whole = fitted_to_all(fitter, told, 0)

    def missed(model: Model) -> float:
        (run,) = sharper(problem).runs
        left = run.measured - run.predicted(physics_of(model))
        return float(np.sum((left / run.sigma) ** 2))

    assert whole != told.models[0]
    assert missed(whole) < missed(told.models[0])
