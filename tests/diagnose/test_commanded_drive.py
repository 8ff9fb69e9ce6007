# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Drives whose effort is a command: what they make of their set-point is named, with numbers."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.score.recording_folds import better_on_others, costs_left_out
from engb_core.model import Controller, EffectSetting, Model
from tests.core.test_command_law import COUNT, PENDULUM, servo


def at_two_gains(*settings: EffectSetting) -> list:
    return [replace(servo(*settings, gain=gain), name=f'gain {gain:g}') for gain in (9.0, 27.0)]


@pytest.mark.slow
def test_a_late_set_point_of_limited_speed_is_named_with_both_numbers():
    found = diagnose(at_two_gains(EffectSetting('command_delay', {'delay': 0.03}),
                                  EffectSetting('command_rate_limit', {'speed': 4.0})), PENDULUM)
    told = {entry.effect: entry for entry in found.effects if entry.probability >= 0.5}
    assert set(told) == {'command_delay', 'command_rate_limit'}
    # Every such drive does both: that it took two makes neither of them less likely.
    assert min(finding.probability for finding in found.effects) > 0.85
    assert told['command_delay'].parameters['delay'].value == pytest.approx(0.03, abs=0.004)
    assert told['command_rate_limit'].parameters['speed'].value == pytest.approx(4.0, rel=0.05)
    assert [fault.fault for fault in found.data_faults] == ['effort_is_command'] * 2


@pytest.mark.slow
def test_it_is_named_without_any_torque_in_the_recording():
    late = EffectSetting('command_delay', {'delay': 0.03})
    recording = servo(late)
    model = replace(PENDULUM, controller=Controller(18.0, 0.0, 0.0, 6.8, 1000.0))
    found = diagnose([replace(recording, effort=np.full(recording.time.size, np.nan))], model)
    told = {entry.effect: entry for entry in found.effects if entry.probability >= 0.5}
    assert set(told) == {'command_delay'}
    assert told['command_delay'].parameters['delay'].value == pytest.approx(0.03, abs=0.004)
    assert any('no effort was recorded' in note for note in found.evidence.notes)


@pytest.mark.slow
def test_a_drive_that_follows_at_once_is_named_nothing():
    found = diagnose(at_two_gains(), PENDULUM)
    assert [entry.effect for entry in found.effects if entry.probability >= 0.5] == []


def test_the_noise_of_a_command_is_what_counts_make_of_it():
    problem = problem_of(at_two_gains(), PENDULUM)
    for run, gain in zip(problem.runs, (9.0, 27.0), strict=True):
        assert run.noise.min() >= gain * COUNT / 12.0 ** 0.5 * run.comparison.noise_gain_whole
    assert problem.scene.commanded


def test_effects_on_the_set_point_are_not_looked_for_beside_a_measured_effort():
    from engb_core.effects.catalogue import get_effect
    recordings = [replace(entry, reference=None) for entry in at_two_gains()]
    scene = problem_of(recordings, PENDULUM).scene
    assert not scene.commanded
    for name in ('command_delay', 'command_rate_limit'):
        assert not get_effect(name).applies(scene)


def with_load_friction(count: int) -> list:
    """Return so many recordings of a pendulum with 0.35 times the load as friction."""
    machine = replace(PENDULUM, friction=replace(PENDULUM.friction, load_gain=0.35))
    return [replace(servo(gain=entry, machine=machine), name=f'gain {entry:g}')
            for entry in (6.0, 9.0, 13.0, 18.0, 27.0)[:count]]


def refitted(recordings: list) -> Model:
    """Return the pendulum with its numbers refitted around the load friction that it lacks."""
    fitter = Fitter(problem_of(recordings, PENDULUM, recordings[:1]))
    fit = fitter.refine(fitter.refit(fitter.base(), tuple(
        number for number in fitter.numbers if number.name in ('viscous_friction', 'coulomb'))))
    return fit.hypothesis.corrected(fit.vector)


REFITTED = refitted(with_load_friction(5))


@pytest.mark.slow
def test_load_friction_that_a_refitted_file_lacks_is_named_from_whole_recordings():
    found = diagnose(with_load_friction(5), REFITTED)
    told = {entry.effect: entry for entry in found.effects if entry.probability >= 0.5}
    assert set(told) == {'load_dependent_friction'}
    assert told['load_dependent_friction'].parameters['load_gain'].value == pytest.approx(
        0.35, abs=0.05)


def test_what_is_left_out_is_what_a_fit_to_the_others_leaves():
    recordings = with_load_friction(5)
    fitter = Fitter(problem_of(recordings, REFITTED, recordings[:1]))
    costs = costs_left_out(fitter, fitter.base())
    for place in (1, 4):
        others = Fitter(problem_of([*recordings[:place], *recordings[place + 1:]], REFITTED,
                                   recordings[:1]))
        others.spread = np.delete(fitter.spread, np.s_[begin(fitter, place):begin(
            fitter, place + 1)])
        fit = others.refine(others.base(), 20)
        left = fitter.evaluate(fitter.hypothesis(), fit.vector)
        rows = slice(begin(fitter, place), begin(fitter, place + 1))
        assert costs[place] == pytest.approx(
            float(np.sum((left.residual[rows] * fitter.weight[rows]) ** 2)), rel=0.1)


def test_what_one_recording_alone_tells_stays_as_it_is_for_the_others():
    fitter = Fitter(problem_of(with_load_friction(5), REFITTED))
    base = fitter.finish(fitter.base())
    # Two numbers that only the first recording tells apart: the others say their sum.
    jacobian = base.jacobian.copy()
    rows = np.arange(jacobian.shape[0]) >= begin(fitter, 1)
    jacobian[rows, 1] = jacobian[rows, 0]
    # And one that the others say nothing of; of it rounding leaves less than nothing.
    jacobian[rows, 2] = 0.0
    jacobian[:, 2] *= 1e6
    hypothesis = SimpleNamespace(
        bounds=base.hypothesis.bounds,
        prior=(base.hypothesis.prior[0], np.full(base.hypothesis.size, np.inf)))
    costs = costs_left_out(fitter, replace(base, jacobian=jacobian, hypothesis=hypothesis))
    assert np.isfinite(costs).all()
    assert costs[0] < 2.0 * costs_left_out(fitter, base)[0]


def begin(fitter: Fitter, run: int) -> int:
    return sum(entry.measured.size for entry in fitter.problem.runs[:run])


def test_one_fit_is_no_better_than_itself_and_three_recordings_say_nothing():
    for count in (3, 5):
        fitter = Fitter(problem_of(with_load_friction(count), REFITTED))
        base = fitter.base()
        held = fitter.refit(base, tuple(number for number in base.hypothesis.numbers
                                        if number.name not in ('load_gain', 'load_curvature')))
        assert not better_on_others(fitter, base, base)
        assert better_on_others(fitter, held, base) == (count > 3)


def test_drag_of_a_commanded_drive_may_be_its_back_emf():
    machine = replace(PENDULUM, motor=replace(PENDULUM.motor, viscous_friction=1.9))
    found = diagnose([replace(servo(gain=gain, machine=machine), name=f'gain {gain:g}')
                      for gain in (9.0, 27.0)], PENDULUM)
    first = found.effects[0]
    assert first.effect == 'viscous_friction_error'
    assert dict(first.alternatives)['back_emf'] == pytest.approx(first.probability)
