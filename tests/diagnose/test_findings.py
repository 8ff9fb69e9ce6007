# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The order of what is claimed, and how sure a wave is."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.diagnosis import EffectFinding, ParameterEstimate
from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.findings import in_order, with_parts
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.waves import repeats
from engb_core.effects.catalogue import get_effect
from engb_core.recording import Recording

from .simulated_brake import lively, NOMINAL


def finding(effect: str, probability: float, share: float) -> EffectFinding:
    return EffectFinding(effect, probability, {}, share, (), '')


def test_what_is_sure_comes_first():
    found = in_order([finding('doubtful', 0.2, 0.6), finding('lesser', 0.9, 0.1),
                      finding('greater', 0.9, 0.3)])
    assert [entry.effect for entry in found] == ['greater', 'lesser', 'doubtful']
    assert found[2].share == 0.05


def test_what_explains_nearly_all_is_no_detail_of_what_is_a_little_surer():
    found = in_order([finding('likely', 0.61, 0.97), finding('sure', 0.69, 0.02)])
    assert [(entry.effect, entry.share) for entry in found] == [('likely', 0.97), ('sure', 0.02)]


def test_missing_physics_comes_before_numbers_that_moved_to_make_up_for_it():
    found = in_order([finding('inertia_error', 0.98, 0.7), finding('actuation_lag', 0.9, 0.2)])
    assert [(entry.effect, entry.share) for entry in found] == [
        ('actuation_lag', 0.2), ('inertia_error', 0.1)]


def test_a_form_of_the_load_curve_is_no_number_that_a_refit_moved():
    """It keeps its share beside physics, and takes none from a number."""
    shape = finding('load_curve_shape', 0.74, 0.3)
    found = in_order([finding('torque_ripple', 0.68, 0.04), shape])
    assert [(entry.effect, entry.share) for entry in found] == [
        ('load_curve_shape', 0.3), ('torque_ripple', 0.04)]
    found = in_order([shape, finding('coulomb_friction_error', 0.9, 0.6)])
    assert [(entry.effect, entry.share) for entry in found] == [
        ('coulomb_friction_error', 0.6), ('load_curve_shape', 0.3)]


def test_of_a_change_that_is_not_told_no_part_is_named():
    """A fade whose own load ratio the recordings leave open holds no self-energizing."""
    def faded(std: float | None) -> list[EffectFinding]:
        parameters = {'ratio_change': ParameterEstimate(-0.2, 0.01, '-'),
                      'load_ratio': ParameterEstimate(1.4, std, '-')}
        return with_parts([replace(finding('pad_friction_fade', 0.9, 1.0),
                                   parameters=parameters)])

    assert {entry.effect for entry in faded(0.01)} == {'self_energizing', 'pad_friction_fade'}
    assert [entry.effect for entry in faded(None)] == ['pad_friction_fade']


def test_where_nothing_is_sure_shares_stay():
    found = in_order([finding('lesser', 0.3, 0.2), finding('greater', 0.4, 0.7)])
    assert [(entry.effect, entry.share) for entry in found] == [('greater', 0.7), ('lesser', 0.2)]
    found = in_order([finding('inertia_error', 0.4, 0.7), finding('actuation_lag', 0.3, 0.2)])
    assert [(entry.effect, entry.share) for entry in found] == [
        ('inertia_error', 0.7), ('actuation_lag', 0.2)]


@pytest.mark.parametrize(('slots', 'sure'), [(2.0, False), (9.0, True)])
def test_a_wave_is_one_that_repeats(slots, sure):
    """Twice along the stroke, and what does not repeat beside it: that may be all of it."""
    recording = lively(NOMINAL)
    phase = 2.0 * np.pi * recording.position / 20.0
    effort = recording.effort + 0.012 * np.sin(slots * phase) + 0.02 * np.exp(
        -((recording.position - 13.0) / 0.7) ** 2)
    found = diagnose([Recording.from_samples('dented', recording.time, recording.position, effort,
                                             recording.velocity)], NOMINAL)
    waves = [entry for entry in found.effects
             if entry.effect in ('cogging_torque', 'torque_ripple')]
    assert any(entry.probability > 0.5 for entry in waves) == sure


def test_a_dent_is_no_wave():
    """Any form that stands in one place is a sum of a few slow waves."""
    recording = lively(NOMINAL)
    effort = recording.effort + 0.03 * np.exp(-(recording.position - 8.5) ** 2) \
        - 0.03 * np.exp(-(recording.position - 11.5) ** 2)
    found = diagnose([Recording.from_samples('dented', recording.time, recording.position, effort,
                                             recording.velocity)], NOMINAL)
    assert found.effects
    assert all(entry.probability <= 0.5 for entry in found.effects
               if entry.effect in ('cogging_torque', 'torque_ripple'))


def test_a_position_error_comes_once_a_turn():
    """It has no order of its own, which ended the diagnosis of a case from another hand."""
    fitter = Fitter(problem_of([lively(NOMINAL)], NOMINAL))
    assert not repeats(fitter, get_effect('unexplained_eccentricity'), {'error': 0.1})
    assert repeats(fitter, get_effect('cogging_torque'), {'order': 9.0})


@pytest.mark.parametrize(('ratio', 'std', 'named'), [
    (1.044, 0.014, True),    # 1.134 before anything fades
    (0.914, 0.014, False),   # 1.004: it fades from none on
    (1.044, 0.080, False)])  # 1.134, by a deviation and a half
def test_what_is_there_before_a_pad_fades_is_self_energizing(ratio, std, named):
    fade = EffectFinding('pad_friction_fade', 0.9, {
        'ratio_change': ParameterEstimate(-0.18, 0.024, '-'),
        'load_ratio': ParameterEstimate(ratio, std, '-')}, 0.8, (), 'It fades.')
    told = with_parts([fade])
    assert [entry.effect for entry in told] == (
        ['self_energizing', 'pad_friction_fade'] if named else ['pad_friction_fade'])
    assert sum(entry.share for entry in told) == pytest.approx(0.8)
    if named:
        assert told[0].parameters['load_ratio'].value == pytest.approx(1.134)
        assert told[0].probability == fade.probability
        already = replace(told[0], share=0.1)
        assert with_parts([fade, already]) == [fade, already]
