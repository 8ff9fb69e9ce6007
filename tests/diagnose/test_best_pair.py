# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Two effects that are found together only."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
import pytest

from engb_core.diagnose import selection
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.score.reduced_chi_square import excess
from engb_core.diagnose.search import every_effect as searching
from engb_core.diagnose.search.every_effect import Search, search
from engb_core.diagnose.selection import select
from engb_core.effects.catalogue import catalogue
from engb_core.model import EffectSetting

from .simulated_brake import equal_strokes, NOMINAL, recorded, strokes_and_waves

STROKES = equal_strokes(8.0)
BOTH = {'torque_ripple', 'asymmetric_friction'}


@pytest.fixture(scope='module')
def found() -> Search:
    """Return all fits to a brake with two effects."""
    brake = replace(NOMINAL, effects=(
        EffectSetting('torque_ripple', {'relative_amplitude': 0.08, 'order': 6.0, 'phase': 0.4,
                                         'second_sine': 0.0, 'second_cosine': 0.0}),
        EffectSetting('asymmetric_friction', {'asymmetry': 0.25})))
    return search(Fitter(problem_of([recorded(
        brake, lambda time, _: STROKES.at(time), STROKES.duration, noise=0.002)], NOMINAL)))


def led_astray(found: Search) -> Search:
    """Return the search with no single effect that explains anything, as multistart may leave it
    where the cost has many minima."""
    def nothing(fit: Fit) -> Fit:
        return replace(fit, residual=found.base.residual, cost=found.base.cost)

    fits = {key: nothing(fit) if len(key) == 1 else fit for key, fit in found.fits.items()}
    variants = {key: nothing(fit) if len(key) == 1 else fit
                for key, fit in found.variants.items()}
    return Search(found.fitter, found.base, fits, variants)


def test_a_pair_is_found_though_neither_is_worth_anything_alone(found):
    assert set(select(found).chosen.hypothesis.ids) == BOTH
    spoilt = led_astray(found)
    best = min(excess(fit, found.fitter) for fit in spoilt.of_size(1))
    assert best == pytest.approx(excess(found.base, found.fitter))
    assert set(select(spoilt).chosen.hypothesis.ids) == BOTH


def with_pairs(found: Search, left: Callable[[Fit], NDArray[np.float64]]) -> Search:
    """Return the search with no single effect that explains anything, and pairs that leave what
    `left` says."""
    spoilt = led_astray(found)
    return Search(found.fitter, found.base,
                  {key: replace(fit, residual=left(fit)) for key, fit in spoilt.fits.items()},
                  {key: replace(fit, residual=left(fit)) for key, fit in spoilt.variants.items()})


def test_a_pair_that_explains_only_what_it_was_fitted_to_is_none(found):
    """Two effects can be bent to each other: they are asked on what no fit has seen."""
    pairs = with_pairs(found, lambda fit: np.where(
        found.fitter.fitted, fit.residual, found.base.residual))
    assert set(select(pairs).chosen.hypothesis.ids) != BOTH


def test_a_pair_that_explains_a_half_is_none(found):
    """It is likelier wrong than right, and kept other causes from being asked: on a real machine
    two lags that nearly cancel each other hid the scale of the torque."""
    pairs = with_pairs(found, lambda fit: np.sqrt(0.5) * found.base.residual)
    single = pairs.of_size(1)[0]
    before = excess(found.base, found.fitter)
    assert selection._of_best_pair(pairs, single, before) is single
    assert selection._of_best_pair(led_astray(found), single, before) is not single


def test_known_effects_that_are_nearest_to_what_one_leaves_come_first(found):
    single = found.fits['cogging_torque',]
    further = selection._further(found, single)
    assert further[0][0] == 'torque_ripple' and further[0][1] > 0.5
    assert [part for _, part in further] == sorted((part for _, part in further), reverse=True)
    assert not {'cogging_torque'} & {effect for effect, _ in further}
    # What leaves noise leaves nothing to name, and without a name all are nearest.
    assert selection._further(found, select(found).chosen) == ()
    assert selection._further(found, found.base) == ()


def test_no_search_knows_less_than_the_last(found, monkeypatch):
    """Two effects that were found together stay a hypothesis where another search, of nearly the
    same recordings, comes upon neither pair nor place."""
    pair = found.of_size(2)[0]
    companions = searching._companions
    monkeypatch.setattr(searching, '_companions', lambda *given: companions(*given)[-1:])
    monkeypatch.setattr(searching, '_led_astray', lambda *_: [])
    fitter = found.fitter
    assert pair.hypothesis.ids not in [fit.hypothesis.ids for fit in search(fitter).of_size(2)]
    again = search(fitter, found=pair).of_size(2)[0]
    assert again.hypothesis.ids == pair.hypothesis.ids
    assert again.cost < 1.01 * pair.cost


@pytest.mark.slow
def test_a_brake_with_five_effects_gets_five_names():
    """There is no greatest number of names: each is worth it or is not."""
    brake = replace(NOMINAL, effects=(
        EffectSetting('torque_ripple', {'relative_amplitude': 0.05, 'order': 6.0, 'phase': 0.4}),
        EffectSetting('cogging_torque', {'amplitude': 0.004, 'order': 11.0, 'phase': 0.4}),
        EffectSetting('asymmetric_friction', {'asymmetry': 0.2}),
        EffectSetting('load_hysteresis', {
            'hysteresis_ratio': 0.06, 'memory_distance': 1.5, 'load_exponent': 1.0}),
        EffectSetting('nonlinear_viscous_friction', {
            'quadratic_viscous_friction': 1e-5, 'transition_speed': 2.0})))
    strokes = strokes_and_waves(3)
    problem = problem_of([recorded(brake, lambda time, _: strokes.at(time), strokes.duration,
                                   noise=0.001)], NOMINAL)
    # These are looked for, and one that is not there.
    wanted = {entry.effect for entry in brake.effects}
    others = {entry.id for entry in catalogue().values()} - wanted - {'torque_offset'}
    chosen = select(search(Fitter(replace(problem, settled=tuple(others))))).chosen
    assert set(chosen.hypothesis.ids) == wanted


def test_others_are_fitted_in_the_place_of_each_of_several():
    """How sure each is follows from what else may be in its place."""
    brake = replace(NOMINAL, effects=(
        EffectSetting('load_hysteresis', {'hysteresis_ratio': 0.1}),
        EffectSetting('cogging_torque', {'amplitude': 0.012, 'order': 8.0, 'phase': 0.3}),
        EffectSetting('presliding_friction', {'presliding_distance': 0.3})))
    strokes = strokes_and_waves(1)
    result = search(Fitter(problem_of([recorded(
        brake, lambda time, _: strokes.at(time), 12.0, noise=0.002)], NOMINAL)))
    chosen = set(select(result).chosen.hypothesis.ids)
    assert chosen == {entry.effect for entry in brake.effects}
    for effect in chosen:
        assert any(chosen - {effect} < set(ids) and effect not in ids and len(ids) == len(chosen)
                   for ids in result.fits), effect


@pytest.fixture(scope='module')
def three() -> Search:
    """Return all fits to a brake with three effects of which two act behind a reversal."""
    way = strokes_and_waves(3)
    brake = replace(NOMINAL, effects=(
        EffectSetting('cogging_torque', {'amplitude': 0.004, 'order': 7.0, 'phase': 0.4}),
        EffectSetting('load_hysteresis', {'hysteresis_ratio': 0.05, 'memory_distance': 0.8}),
        EffectSetting('presliding_friction', {'presliding_distance': 0.01, 'shape': 1.0})))
    return search(Fitter(problem_of([recorded(
        brake, lambda time, _: way.at(time), way.duration, noise=0.001)], NOMINAL)))


def test_two_are_found_of_which_the_first_does_harm_alone(three, monkeypatch):
    """What does for both in another place is worse in plain torque, until the other one is there
    as well."""
    all_of_it = {'cogging_torque', 'load_hysteresis', 'presliding_friction'}
    cogging = three.fits['cogging_torque',]

    def mean_square(fit: Fit) -> float:
        pair = len(fit.hypothesis.ids) == 2 and set(fit.hypothesis.ids) < all_of_it
        return 1.1 * plain(cogging) if pair else plain(fit)

    plain = selection.mean_square
    monkeypatch.setattr(selection, 'mean_square', mean_square)
    assert not selection._harmless(
        three.fits['cogging_torque', 'load_hysteresis'], cogging, three.fitter)
    assert set(select(three).chosen.hypothesis.ids) == all_of_it
