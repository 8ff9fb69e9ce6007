# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A wave that hardly repeats along the stroke is one if its order is a whole number."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from engb_core.diagnose import waves
from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.waves import _beside_chance, left_at_order
from engb_core.effects.catalogue import get_effect
from engb_core.model import LoadTorque
from engb_core.recording import Recording

from .simulated_brake import lively, NOMINAL


@pytest.fixture(scope='module')
def clean() -> Recording:
    return lively(NOMINAL)


def with_wave(clean: Recording, order: float) -> Recording:
    """Return the recording with a wave that comes about three times along the stroke."""
    wave = 0.01 * (np.sin(order * clean.position + 0.7) + 0.2 * np.sin(2 * order * clean.position))
    return Recording.from_samples('run', clean.time, clean.position, clean.effort + wave,
                                  clean.velocity)


@pytest.mark.parametrize(('order', 'named'), [(1.0, True), (1.31, True), (0.83, False)], ids=[
    'of whole order', 'that bends oftener than it has parameters', 'of neither'])
def test_a_slow_wave_is_named(clean, order, named):
    turns = np.ptp(clean.position) / (2.0 * np.pi)
    assert turns * order < 5.0
    diagnosis = diagnose([with_wave(clean, order)], NOMINAL)
    said = {entry.effect: entry.probability for entry in diagnosis.effects}
    assert (said.get('cogging_torque', 0.0) > 2.0 / 3.0) == named


def test_a_fast_wave_among_slow_ones_is_no_number_too_large(monkeypatch):
    """Where the larger part comes seldom the first of several orders may come very often."""
    monkeypatch.setattr(waves, '_mostly_comes_often', lambda *_: False)
    effect = get_effect('cogging_torque')
    fit = SimpleNamespace(hypothesis=SimpleNamespace(
        variants=[SimpleNamespace(effect=effect)], named=lambda *_: {'order': 300.0}), vector=None)
    fitter = SimpleNamespace(problem=SimpleNamespace(
        scene=SimpleNamespace(position_range=(0.0, 30.0)),
        model=replace(NOMINAL, load_torque=LoadTorque('sinusoid', amplitude=0.1))))
    assert 0.9 < waves.wave_known(fitter, fit, 0) < 1.0


@pytest.mark.parametrize(('order', 'deviation', 'times'), [
    (6.01, 0.01, 25.0), (6.03, 0.01, 1.0), (0.7, 0.1, 1.0), (1.0, 0.5, 1.0)])
def test_a_whole_order_counts_for_as_much_as_it_is_rare_by_chance(order, deviation, times):
    assert _beside_chance(order, deviation) == pytest.approx(times)


@pytest.mark.parametrize(('of_friction', 'left'), [(False, (0.0, 0.02)), (True, (0.3, 1.0))])
def test_a_wave_that_turns_with_the_direction_is_left_by_one_that_does_not(
        clean, of_friction, left):
    by = np.sign(clean.velocity) if of_friction else 1.0
    recording = Recording.from_samples(
        'run', clean.time, clean.position,
        clean.effort + 0.01 * by * np.sin(3.0 * clean.position + 0.7), clean.velocity)
    fitter = Fitter(problem_of([recording], NOMINAL))
    variant, *_ = variants_of(get_effect('cogging_torque'), fitter.problem.scene)
    starts = fitter.starts(variant, [{'order': 3.0}])
    fit = fitter.finish(fitter.refine(fitter.fit(variant, starts=starts)))
    assert left[0] <= left_at_order(fitter, fit, 0) <= left[1]
