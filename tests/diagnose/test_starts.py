# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Where effects may start: by what their parameters are, whatever these are called."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.search.starts import settings_from_residual
from engb_core.diagnose.timing import lateness
from engb_core.diagnose.waves import is_line
from engb_core.effects.base import Effect, Parameter
from engb_core.effects.catalogue import get_effect
from engb_core.model import EffectSetting

from .simulated_brake import brake_with, lively, NOMINAL


@pytest.fixture(scope='module')
def fitter() -> Fitter:
    return Fitter(problem_of([lively(brake_with('cogging_torque', amplitude=0.02, order=7.0))],
                             NOMINAL))


def renamed(effect: Effect, **names: str) -> Effect:
    """Return an effect whose parameters have other names, as somebody's own may have."""
    return replace(effect, parameters=tuple(
        replace(entry, name=names.get(entry.name, entry.name)) for entry in effect.parameters))


def test_a_parameter_that_happens_to_be_called_like_another_starts_where_its_file_says(fitter):
    """docs/add-an-effect.md has a `begin` in rad: it had been started at seconds."""
    parameters = (Parameter('drag_slope', 'N·m·s/rad²', -1e-3, 1e-3, none=0.0, starts=(2e-4,)),
                  Parameter('begin', 'rad', 0.0, 100.0, starts=(2.0, 8.0)))
    drag = replace(get_effect('torque_offset'), id='cable_drag', parameters=parameters)
    assert settings_from_residual(fitter, fitter.base(), drag) is None


def test_an_order_is_looked_for_whatever_it_is_called(fitter):
    wave = renamed(get_effect('cogging_torque'), order='teeth', phase='angle')
    found = settings_from_residual(fitter, fitter.base(), wave)
    assert found and {'teeth'} == set(found[0])
    assert min(abs(setting['teeth'] - 7.0) for setting in found) < 0.1
    assert is_line(fitter, wave, {'teeth': 7.0})


def test_a_place_is_looked_for_with_its_width(fitter):
    spot = renamed(get_effect('unexplained_spot'), centre='where', width='reach')
    found = settings_from_residual(fitter, fitter.base(), spot)
    assert found and {'where', 'reach'} == set(found[0])


def test_lateness_is_that_of_the_drive_and_not_of_the_samples():
    late = replace(NOMINAL, effects=(
        EffectSetting('actuation_lag', {'lag': 0.012, 'first_order': 0.4}),
        EffectSetting('sampling_delay', {'delay': 0.0005}),
        EffectSetting('effort_measurement_lag', {'lag': 0.01})))
    assert lateness(late) == pytest.approx(0.012)
    assert lateness(NOMINAL) == 0.0 and np.isfinite(lateness(NOMINAL))


def test_an_episode_is_looked_for_in_every_recording():
    quiet, other = (replace(lively(NOMINAL), name=name) for name in ('quiet', 'other'))
    effort = other.effort + 0.05 * ((other.time > 4.0) & (other.time < 5.0))
    fitter = Fitter(problem_of([quiet, replace(other, effort=effort)], NOMINAL))
    found = settings_from_residual(fitter, fitter.nominal(), get_effect('unexplained_episode'))
    assert min(abs(entry['begin'] - 4.0) for entry in found) < 0.1
