# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What an effect promises by linear least squares when it is added to a fit."""

import pytest

from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.nominal import DELAY
from engb_core.diagnose.optimise import linear_start
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.effects.catalogue import get_effect
from engb_core.recording import Recording

from .simulated_brake import brake_with, lively, NOMINAL

OTHERS = ('load_hysteresis', 'torque_offset', 'torque_ripple', 'self_energizing')


@pytest.fixture(scope='module')
def late() -> Fitter:
    """A fitter of torque that is late by more than half a sample, at 500 Hz."""
    recording = lively(brake_with('actuation_lag', lag=0.0035))
    return Fitter(problem_of([Recording.from_samples('late', *(values[::2] for values in (
        recording.time, recording.position, recording.effort, recording.velocity)))], NOMINAL))


def promised(fitter: Fitter, effect: str) -> float:
    variant = variants_of(get_effect(effect), fitter.problem.scene)[0]
    return min(entry.cost for entry in fitter.screen(fitter.base(), fitter.starts(variant)))


def test_a_delay_at_its_bound_does_not_stand_for_a_lag(late, monkeypatch):
    base = late.base()
    place = [number.name for number in base.hypothesis.numbers].index(DELAY)
    assert base.vector[place] == pytest.approx(base.hypothesis.bounds[1][place])
    lag = promised(late, 'actuation_lag')
    for effect in OTHERS:
        assert lag < 0.6 * promised(late, effect)
    # Were it free, any effect would seem to explain most of what the lag does.
    monkeypatch.setattr(linear_start, 'HELD', 0.0)
    assert all(promised(late, effect) < 0.6 * base.cost for effect in OTHERS)


def test_an_effect_that_is_its_own_size_begins_where_all_of_it_fits_best():
    """Least squares would scale the torque of a presliding that is far too long by a negative
    part of it, which no presliding can be."""
    recording = lively(brake_with('presliding_friction', presliding_distance=0.006, shape=1.0))
    fitter = Fitter(problem_of([recording], NOMINAL))
    variant = variants_of(get_effect('presliding_friction'), fitter.problem.scene)[0]
    starts = fitter.starts(variant)
    screened = fitter.screen(fitter.base(), starts)
    nearest = min(range(len(starts)), key=lambda place: screened[place].begun)
    assert starts[nearest].setting['presliding_distance'] == min(
        start.setting['presliding_distance'] for start in starts)
    begun = [fitter.evaluate(fitter.hypothesis((variant,)), linear_start.start_vector(
        fitter.hypothesis((variant,)), fitter.base(), start.setting, None)).cost
        for start in starts]
    assert nearest == begun.index(min(begun))
    # It goes as far as all of it, and no other way.
    assert all(entry.sizes == 1.0 and entry.cost <= min(
        fitter.base().cost, entry.begun) * (1.0 + 1e-6) for entry in screened)
