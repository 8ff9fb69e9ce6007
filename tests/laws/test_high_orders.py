# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Waves of a drive behind a gear come too often along a joint's stroke to be tried one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.diagnose.search.starts import orders_left
from engb_core.laws.atoms import first_forms
from engb_core.laws.columns import scales_of
from engb_core.model import Friction, LoadTorque, Model, Motor
from engb_core.recording import Recording

JOINT = Model(motor=Motor(torque_constant=1.0, inertia=0.8, viscous_friction=2.0),
              load_torque=LoadTorque(form='sinusoid', amplitude=8.0, phase=0.3),
              friction=Friction(3.0, 0.0, 0.02))
ORDER, PART = 120.0, 0.4


@pytest.fixture(scope='module')
def recording() -> Recording:
    """A joint whose friction goes up and down with each turn of the motor behind its gear."""
    time = np.arange(0.0, 40.0, 0.004)
    rates = 2.0 * np.pi * np.array([[0.031], [0.083], [0.19]])
    sizes, phases = np.array([[1.1], [0.35], [0.08]]), np.array([[0.2], [1.4], [2.2]])
    angles = rates * time + phases
    position = np.sum(sizes * np.sin(angles), axis=0)
    velocity = np.sum(sizes * rates * np.cos(angles), axis=0)
    acceleration = -np.sum(sizes * rates ** 2 * np.sin(angles), axis=0)
    friction = 3.0 * (1.0 + PART * np.sin(ORDER * position + 0.7))
    effort = (0.8 * acceleration + 2.0 * velocity + 8.0 * np.sin(position + 0.3)
              + friction * np.clip(velocity / 0.02, -1.0, 1.0))
    noise = np.random.default_rng(4).normal(0.0, 0.1, time.size)
    return Recording.from_samples('joint', time, position, effort + noise, velocity)


def test_what_is_left_shows_the_order_of_a_wave_that_turns_with_the_direction(recording):
    fitter = Fitter(problem_of([recording], JOINT))
    assert orders_left(fitter, fitter.base(), 'direction')[0] == pytest.approx(ORDER, rel=1e-2)


def test_orders_that_the_residual_shows_are_tried_beyond_the_steps(recording):
    scales = scales_of(Fitter(problem_of([recording], JOINT)))

    def tried(orders: tuple[float, ...]) -> bool:
        return any('wave' in atom.kind and atom.slots[0].start == ORDER
                   for form in first_forms(replace(scales, orders=orders))
                   for atom in form.factors)

    assert tried((ORDER,))
    assert not tried(())


def test_a_wave_in_the_friction_is_a_law_and_no_ripple(recording):
    said = diagnose([recording], JOINT)
    assert not said.effects
    law = said.unexplained.law
    assert law.explained > 0.9
    assert any(entry.value == pytest.approx(ORDER, rel=1e-2) for entry in law.parameters.values())
    before, after, floor = (getattr(said.held_out[0], name)
                            for name in ('rms_before', 'rms_after', 'noise_floor'))
    assert after < 0.3 * before + floor
