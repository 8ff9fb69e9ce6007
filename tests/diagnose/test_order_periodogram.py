# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A motor's cogging that passes far above the usual band, of a shaft that never stands."""

from functools import lru_cache

import numpy as np
import pytest

from engb_core.diagnose.engine import diagnose
from engb_core.diagnose.problem import problem_of
from engb_core.model import Model
from engb_core.recording import Recording
from engb_core.signals.filtering import judgeable
from engb_core.signals.gaussian import filtered, gaussian_kernel
from engb_core.signals.motion import motion_of
from engb_core.signals.order_periodogram import order_periodogram, OrderPeriodogram

INERTIA, VISCOUS, COULOMB = 5e-6, 8e-6, 1.6e-3
ORDER, AMPLITUDE, NOISE = 72, 2.5e-3, 2e-4
COUNT = 2.0 * np.pi / 20000
PARTS = 10      # steps of integration in a sample of 1 ms
MODEL = Model.from_mapping({
    'format': 'engb-model/1',
    'motor': {'torque_constant': 0.025, 'inertia': INERTIA, 'viscous_friction': VISCOUS},
    'load_torque': {'form': 'polynomial', 'coefficients': [0.0, 0.0, 0.0, 0.0]},
    'friction': {'coulomb': COULOMB, 'load_gain': 0.0, 'saturation_velocity': 0.5}})


@lru_cache
def turning(amplitude: float, usual: float = 6.3, seed: int = 1) -> Recording:
    """Return 12 s of a motor whose speed is controlled by an integral and a proportional gain."""
    random = np.random.default_rng(seed)
    step, position, velocity, wanted, effort = 1e-3 / PARTS, 0.0, 0.0, 0.0, 0.0
    rows = []
    for sample in range(12_000):
        # The reference is modulated, as a hand on a knob would.
        reference = usual * (1.0 + 0.25 * np.sin(0.5 * np.pi * sample * 1e-3))
        error = reference - velocity
        wanted += 2e-3 * error * 1e-3 * 10.0
        effort = 4e-4 * error + wanted
        rows.append((position, effort))
        for _ in range(PARTS):
            torque = (effort - VISCOUS * velocity - COULOMB * np.clip(velocity / 0.5, -1.0, 1.0)
                      - amplitude * np.sin(ORDER * position))
            velocity += torque / INERTIA * step
            position += velocity * step
    position, effort = np.array(rows).T
    return Recording(name='turning', time=1e-3 * np.arange(effort.size),
                     position=np.round(position / COUNT) * COUNT,
                     effort=effort + NOISE * random.normal(size=effort.size))


def _periodogram(recording: Recording) -> OrderPeriodogram:
    motion = motion_of(recording, 200.0)
    above = motion.effort - filtered(motion.effort, gaussian_kernel(25.0, motion.step))
    return order_periodogram(motion, judgeable(motion, 0.1), 25.0, above)


def test_noise_has_no_line_and_its_own_level():
    found = _periodogram(turning(0.0))
    assert found.strongest_line(0.01) is None
    assert found.noise() == pytest.approx(NOISE, rel=0.25)


def test_a_wave_of_the_shaft_is_a_line():
    assert _periodogram(turning(AMPLITUDE)).strongest_line(0.01) == pytest.approx(ORDER, abs=0.1)


def test_a_shaft_that_stands_has_none():
    time = np.arange(0.0, 4.0, 1e-3)
    still = Recording(name='still', time=time, position=np.zeros(time.size),
                      effort=np.random.default_rng(1).normal(size=time.size))
    found = _periodogram(still)
    assert found.noise() is None and found.strongest_line(0.01) is None


def test_the_comparison_holds_what_turns_with_the_shaft():
    plain, cogged = (problem_of([turning(size)], MODEL) for size in (0.0, AMPLITUDE))
    assert plain.bandwidth == 20.0
    usual = float(np.median(np.abs(cogged.runs[0].motion.velocity)))
    assert cogged.bandwidth == pytest.approx(ORDER * usual / (2.0 * np.pi), rel=0.1)
    assert cogged.runs[0].motion.bandwidth > 2.0 * cogged.bandwidth


def test_waves_of_the_shaft_are_not_taken_for_noise():
    run = problem_of([turning(AMPLITUDE)], MODEL).runs[0]
    assert np.median(run.noise) < 2.0 * NOISE * run.comparison.noise_gain_whole


@pytest.mark.slow
def test_cogging_above_the_band_is_named():
    diagnosis = diagnose([turning(AMPLITUDE)], MODEL)
    named = {finding.effect: finding for finding in diagnosis.effects}
    assert list(named) == ['cogging_torque']
    order = named['cogging_torque'].parameters['order']
    assert order.value == pytest.approx(ORDER, abs=0.1)
    assert named['cogging_torque'].parameters['amplitude'].value == pytest.approx(AMPLITUDE,
                                                                                  rel=0.15)
    held = [entry for entry in diagnosis.held_out if entry.quantity == 'effort']
    assert all(entry.rms_after < 0.5 * entry.rms_before for entry in held)


def test_counts_of_a_constant_speed_are_no_wave_of_the_shaft():
    """Their roundings repeat as regularly as any wave."""
    step, count = 5e-4, 2.0 * np.pi / 8192
    random = np.random.default_rng(2)
    time = np.arange(0.0, 20.0, step)
    wanted = np.repeat(random.uniform(-120.0, 120.0, 20), time.size // 20)
    velocity = np.convolve(np.pad(wanted, 400, mode='edge'), np.hanning(801) / 400.0, 'valid')
    position = np.cumsum(velocity) * step
    effort = (INERTIA * np.gradient(velocity, step) + VISCOUS * velocity
              + COULOMB * np.clip(velocity / 0.5, -1.0, 1.0)
              + 8e-5 * random.standard_normal(time.size))
    recording = Recording(name='spindle', time=time, effort=effort,
                          position=count * np.round(position / count))
    assert problem_of([recording], MODEL).bandwidth == 20.0
