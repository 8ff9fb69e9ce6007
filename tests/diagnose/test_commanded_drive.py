"""Drives whose effort is a command: what they make of their set-point is named, with numbers."""

from __future__ import annotations

from dataclasses import replace

import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.problem import problem_of
from engb_core.model import EffectSetting
from tests.core.test_command_law import COUNT, PENDULUM, servo


def at_two_gains(*settings: EffectSetting) -> list:
    return [replace(servo(*settings, gain=gain), name=f'gain {gain:g}') for gain in (9.0, 27.0)]


@pytest.mark.slow
def test_a_late_set_point_of_limited_speed_is_named_with_both_numbers():
    found = diagnose(at_two_gains(EffectSetting('command_delay', {'delay': 0.03}),
                                  EffectSetting('command_rate_limit', {'speed': 4.0})), PENDULUM)
    told = {entry.effect: entry for entry in found.effects if entry.probability >= 0.5}
    assert set(told) == {'command_delay', 'command_rate_limit'}
    assert told['command_delay'].parameters['delay'].value == pytest.approx(0.03, abs=0.004)
    assert told['command_rate_limit'].parameters['speed'].value == pytest.approx(4.0, rel=0.05)
    assert [fault.fault for fault in found.data_faults] == ['effort_is_command'] * 2


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
