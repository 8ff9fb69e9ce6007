# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Recordings without torque: what the position loop asked for stands for it, and that is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.model import Controller, Model
from engb_core.physics.command_law import command_law
from engb_core.recording import Recording, Reference
from engb_core.signals.absent_effort import with_effort
from tests.core.test_command_law import PENDULUM, servo


def without_effort(recording: Recording) -> Recording:
    return replace(recording, effort=np.full(recording.time.size, np.nan))


def with_controller(controller: Controller) -> Model:
    return replace(PENDULUM, controller=controller)


def test_a_recording_with_effort_stays_as_it_is():
    recording = servo()
    found, = with_effort([recording], PENDULUM)
    assert found is recording


def test_with_a_controller_it_is_what_that_asks_for_within_its_limit():
    recording = servo()
    found, = with_effort([without_effort(recording)],
                         with_controller(Controller(18.0, 0.0, 0.0, 6.8, 1000.0)))
    np.testing.assert_allclose(found.effort, recording.effort, atol=1e-12)
    assert 'no effort was recorded' in found.notes[-1]
    assert 'torque ripple' in found.notes[-1]


def test_a_derivative_and_a_feedforward_are_part_of_it():
    recording = servo()
    reference = recording.reference
    assert reference is not None
    feed = Reference(reference.time, reference.position, effort=np.full(reference.time.size, 0.3))
    bare = replace(without_effort(recording), reference=feed)
    found, = with_effort([bare], with_controller(Controller(18.0, 0.0, 0.5)))
    error = reference.position - recording.position
    np.testing.assert_allclose(
        found.effort, 18.0 * error + 0.5 * np.gradient(error, recording.time) + 0.3)


def test_without_a_controller_the_gain_is_the_one_that_moves_the_model():
    found, = with_effort([without_effort(servo(gain=9.0, limit=1e3))], PENDULUM)
    law = command_law(found)
    assert law is not None
    # The set-point jumps: with the motion smoothed as far as counts demand, a part is lost.
    assert law.gain == pytest.approx(9.0, rel=0.15)
    assert 'proportional loop of' in found.notes[-1]


@pytest.mark.parametrize(('change', 'model', 'told'), [
    ({'reference': None}, PENDULUM, 'no reference position'),
    ({}, with_controller(Controller(18.0, 2.0)), 'controller.integral'),
    ({'reference': Reference(np.arange(0.0, 8.0, 0.01),
                             np.random.default_rng(2).standard_normal(800))}, PENDULUM,
     'controller.proportional')])
def test_what_cannot_be_had_is_refused_in_one_line(change, model, told):
    with pytest.raises(InputError, match=told) as caught:
        with_effort([replace(without_effort(servo()), **change)], model)
    assert '\n' not in str(caught.value)
    assert 'servo' in str(caught.value)
