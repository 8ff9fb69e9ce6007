# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How sure a number is that another formulation of the same physics would put elsewhere."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.constants import FORMULA_MISSES
from engb_core.diagnose.discrepancy import coordinate_cells
from engb_core.diagnose.fitted import without_effects
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.uncertainty import (
    estimates,
    reported_deviations,
    stands_out,
    vector_deviations,
)
from engb_core.effects.catalogue import get_effect

from .simulated_brake import brake_with, lively, NOMINAL


def fitted(effect: str, **parameters: float) -> tuple[Fitter, Fit]:
    """Return the finished fit of an effect to a recording of a brake that has it."""
    fitter = Fitter(problem_of([lively(brake_with(effect, **parameters), seed=4)], NOMINAL))
    variant = variants_of(get_effect(effect), fitter.problem.scene)[0]
    return fitter, fitter.finish(fitter.refine(fitter.fit(variant, keep=2)))


def moved_by_formulas(fitter: Fitter, fit: Fit) -> NDArray[np.float64]:
    """Return the standard deviation of each entry over formulations of the effect that are drawn:
    at each speed another part is added."""
    assert fit.jacobian is not None
    adds = fit.predicted - fitter.predict(*without_effects(fit, {0}))
    cells, weight = coordinate_cells(fitter, 'velocity'), fitter.weight
    parts = FORMULA_MISSES * np.random.default_rng(0).normal(size=(3000, cells.max() + 1))
    moved = (parts[:, cells] * adds * weight) @ np.linalg.pinv(fit.jacobian * weight[:, None]).T
    deviations: NDArray[np.float64] = moved.std(axis=0)
    return deviations


def test_formulations_that_differ_at_each_speed_move_the_numbers_by_what_is_told():
    fitter, fit = fitted('nonlinear_viscous_friction', quadratic_viscous_friction=3e-5)
    told = np.sqrt(reported_deviations(fit, fitter) ** 2 - vector_deviations(fit, fitter) ** 2)
    np.testing.assert_allclose(told, moved_by_formulas(fitter, fit), rtol=0.1)


def test_a_number_that_has_one_formula_is_as_sure_as_the_data_make_it():
    fitter, fit = fitted('torque_offset', offset=0.01)
    np.testing.assert_array_equal(reported_deviations(fit, fitter),
                                  vector_deviations(fit, fitter))


def test_a_gap_is_as_sure_as_a_prediction_stays_alike_not_as_its_jumps_are_sharp():
    fitter, fit = fitted('backlash', gap=1.0)
    place = len(fit.hypothesis.numbers)
    told = reported_deviations(fit, fitter)[place]
    assert vector_deviations(fit, fitter)[place] < 0.9 * told
    moved = fit.vector.copy()
    moved[place] += told
    adds, change = (fit.predicted - fitter.predict(*other) for other in (
        without_effects(fit, {0}), (fit.hypothesis, moved)))
    assert np.linalg.norm(change * fitter.weight) < \
        FORMULA_MISSES * np.linalg.norm(adds * fitter.weight)


def test_an_effect_whose_size_and_shape_make_up_for_each_other_is_there():
    """Beside a free load curve only how asymmetric friction grows with speed shows: half of it
    that grows twice as much is the same, but none is not."""
    fitter, fit = fitted('asymmetric_friction', asymmetry=0.35, growth=0.5, mean_speed=10.0)
    size = len(fit.hypothesis.numbers)
    assert fit.jacobian is not None
    alike = fit.jacobian.copy()
    alike[:, size + 2] = alike[:, size] * (1.0 + 1e-4 * np.sin(np.arange(alike.shape[0])))
    same = replace(fit, jacobian=alike)
    told = vector_deviations(same, fitter, by_noise_alone=True)[size]
    assert told > 0.5 * fit.vector[size]
    assert stands_out(same, fitter, 0)
    nothing = fit.vector.copy()
    nothing[size] = 1e-4
    assert not stands_out(replace(same, vector=nothing), fitter, 0)
    # It is known no less well than that it lies between its bounds.
    std = estimates(same, fitter, 0)['asymmetry'].std
    assert std is not None and std < 0.6
