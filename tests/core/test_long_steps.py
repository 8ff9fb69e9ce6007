# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What rings beyond a shaft, in long steps."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.effects.catalogue import get_effect
from engb_core.model import Friction, LoadTorque, Model
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.physics.sample_table import sample_table


def effort_of(acceleration, step, effect, values):
    """Return the effort of a shaft without load or friction that swings as `acceleration`."""
    time = step * np.arange(acceleration.size)
    model = replace(Model(), load_torque=LoadTorque())
    samples = sample_table(step, time, 0.0, 0.0, acceleration)
    return effort_of_motion(samples, step, physics_of(model, [(get_effect(effect), values)]))


@pytest.mark.parametrize('frequency', (20.0, 45.0))
def test_a_shaft_rings_alike_in_long_and_in_short_steps(frequency):
    names = get_effect('drivetrain_resonance').names
    given = {'inertia_fraction': 0.3, 'frequency': frequency, 'damping_ratio': 0.05,
             'friction_fraction': 0.0, 'loaded_friction_difference': 0.0, 'viscous_fraction': 0.0,
             **get_effect('drivetrain_resonance').defaults}
    found = []
    for step in (1e-3, 1e-4):
        time = step * np.arange(round(2.0 / step))
        swing = np.sin(2.0 * np.pi * 6.0 * time) * np.clip(time / 0.5, 0.0, 1.0)
        effort = effort_of(swing, step, 'drivetrain_resonance',
                           [given[name] for name in names])
        found.append(effort[::round(1e-3 / step)])
    apart = found[0] - found[1]
    assert np.sqrt(np.mean(apart ** 2)) < 0.004 * np.sqrt(np.mean(found[1] ** 2))


@pytest.mark.parametrize(('effect', 'values'), [
    ('presliding_friction', {'presliding_distance': 0.5, 'shape': 0.95}),
    ('presliding_friction', {'presliding_distance': 0.5, 'shape': 0.95, 'elements': 1.0}),
    ('backlash', {'gap': 0.5, 'inertia_fraction': 0.3, 'friction_fraction': 0.6,
                  'loaded_friction_fraction': 0.6, 'viscous_fraction': 0.4}),
    ('drivetrain_resonance', {'inertia_fraction': 0.4, 'frequency': 9.0, 'damping_ratio': 0.06,
                              'friction_fraction': 0.6, 'loaded_friction_difference': -0.2,
                              'viscous_fraction': 0.4})])
def test_a_recording_may_begin_in_motion(effect, values):
    """A shaft that moves when a recording begins has slid, and lies at the flank of its torque,
    since before: what an effect adds there is what it adds in a recording of all of the motion."""
    step, rate = 1e-3, 2.0 * np.pi * 0.25
    time = step * np.arange(16000)
    position, velocity, acceleration = (
        10.0 * wave for wave in (-np.cos(rate * time), rate * np.sin(rate * time),
                                 rate ** 2 * np.cos(rate * time)))
    chosen = get_effect(effect)
    given = {**chosen.defaults, **values}
    coulomb = 0.02
    model = replace(Model(), load_torque=LoadTorque(),
                    friction=Friction(coulomb=coulomb, saturation_velocity=0.5))
    physics = physics_of(model, [(chosen, [given[name] for name in chosen.names])])

    def added(first):
        moved = slice(first, None)
        samples = sample_table(step, time[moved] - time[first], position[moved], velocity[moved],
                               acceleration[moved])
        return (effort_of_motion(samples.copy(), step, physics)
                - effort_of_motion(samples, step, physics_of(model)))

    whole = added(0)
    for first in (5000, 7000, 9000, 11000):
        apart = added(first)[:300] - whole[first:first + 300]
        # A load at its flank knocks within a sample now and then.
        assert np.abs(np.convolve(apart, np.full(20, 0.05), 'valid')).max() < 0.05 * coulomb
