# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Effort that is a command: the law behind it, its limits, and what the drive makes of it."""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
import pytest

from engb_core.model import Controller, EffectSetting, Friction, LoadTorque, Model, Motor
from engb_core.physics.command_law import command_law
from engb_core.physics.plant import physics_of
from engb_core.physics.simulation import simulate_closed_loop
from engb_core.prediction import predict_effort
from engb_core.recording import Recording, Reference
from engb_core.signals.gaussian import filtered, gaussian_kernel
from engb_core.signals.motion import motion_of

COUNT = 2.0 * np.pi / 4096.0
STEP = 0.01
# A pendulum of 1 kg at 0.15 m on a servo.
PENDULUM = Model(motor=Motor(0.57, 0.05, 1.3), friction=Friction(0.1, 0.0, 0.05),
                 load_torque=LoadTorque('sinusoid', amplitude=1.46))


def servo(*settings: EffectSetting, gain: float = 18.0, limit: float = 6.8,
          duration: float = 8.0, machine: Model = PENDULUM) -> Recording:
    """Return what a servo with these effects records: 100 Hz, counts, no torque."""
    time = np.arange(0.0, duration, STEP)
    wanted = np.sin(2.0 * time) + 0.5 * np.sign(np.sin(3.1 * time))
    model = replace(machine, effects=settings,
                    controller=Controller(gain, 0.0, 0.0, limit, 1000.0))
    empty = Recording('servo', time, np.zeros(time.size), np.zeros(time.size),
                      reference=Reference(time, wanted))
    position, _ = simulate_closed_loop(empty, model)
    position = np.round(position / COUNT) * COUNT
    return replace(empty, position=position,
                   effort=np.clip(gain * (wanted - position), -limit, limit))


def test_a_command_s_law_and_limits_are_read_off():
    law = command_law(servo())
    assert law is not None
    assert law.gain == pytest.approx(18.0, rel=1e-9)
    assert law.offset == pytest.approx(0.0, abs=1e-9)
    assert (law.lowest, law.highest) == (-6.8, 6.8)


def test_the_largest_effort_is_no_limit_where_nothing_is_cut_off():
    law = command_law(servo(gain=3.0, limit=50.0))
    assert law is not None
    assert (law.lowest, law.highest) == (-math.inf, math.inf)


def test_a_measured_effort_is_no_command():
    command = servo()
    noise = 0.2 * np.random.default_rng(4).standard_normal(command.time.size)
    assert command_law(replace(command, effort=command.effort + noise)) is None
    assert command_law(replace(command, reference=None)) is None


@pytest.mark.parametrize('setting', [
    EffectSetting('command_delay', {'delay': 0.04}),
    EffectSetting('command_rate_limit', {'speed': 3.0})])
def test_what_the_drive_makes_of_its_set_point_is_predicted(setting):
    """The effort that was recorded is predicted by a model with the effect, in the band of the
    motion, far better than by one without."""
    recording = servo(setting)
    motion = motion_of(recording)
    moving = np.abs(np.interp(recording.time, motion.time, motion.velocity)) > 0.3
    taps = gaussian_kernel(8.0, STEP)

    def missed(model: Model) -> float:
        error = filtered(predict_effort(recording, model) - recording.effort, taps)
        return float(np.sqrt(np.mean(error[moving] ** 2)))

    assert missed(replace(PENDULUM, effects=(setting,))) < 0.25 * missed(PENDULUM)


def test_a_set_point_that_is_followed_at_once_changes_nothing():
    motion = motion_of(servo())
    assert motion.commanded is not None
    beyond = motion.commanded.recorded_beyond_acted(physics_of(replace(PENDULUM, effects=(
        EffectSetting('command_delay', {'delay': 0.0}),
        EffectSetting('command_rate_limit', {'speed': math.inf})))))
    # Adding the steps up rounds.
    np.testing.assert_allclose(beyond, 0.0, atol=1e-12)


def test_late_set_points_change_the_loop_by_their_delay():
    """A simulated loop with a late set-point is the loop that was given a late reference."""
    prompt = servo(duration=4.0)
    model = replace(PENDULUM, controller=Controller(18.0, 0.0, 0.0, 6.8, 1000.0))
    late = replace(prompt, reference=Reference(
        prompt.reference.time + 0.05, prompt.reference.position))
    as_given, _ = simulate_closed_loop(late, model)
    delayed, _ = simulate_closed_loop(prompt, replace(model, effects=(
        EffectSetting('command_delay', {'delay': 0.05}),)))
    np.testing.assert_allclose(delayed, as_given, atol=0.02)
    assert np.abs(delayed - simulate_closed_loop(prompt, model)[0]).max() > 0.1
