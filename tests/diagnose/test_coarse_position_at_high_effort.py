# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What counts put into the torque averages out only where torque is in proportion to effort.

A motor that saturates needs ever more effort for a little more torque. Asked of a torque with the
noise of a coarse encoder in it, the effort comes out too high in the mean: a fit takes that for
less loss, and a prediction is off by it.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from engb_core.diagnose.hypothesis import variants_of
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.effects.base import EFFORT, SAMPLE_SIZE, STATE_SIZE
from engb_core.effects.catalogue import get_effect
from engb_core.model import EffectSetting, LoadTorque, Model
from engb_core.physics.compiled import PARAMETER_SIZE
from engb_core.physics.inverse_dynamics import effort_of_motion
from engb_core.physics.plant import physics_of
from engb_core.physics.sample_table import sample_table
from engb_core.prediction import predict_effort
from engb_core.recording import Recording
from engb_core.signals.gaussian import filtered, gaussian_kernel

STEP, LARGEST, LOSS = 1e-3, 1.0, 0.3
FILE = Model(load_torque=LoadTorque(coefficients=(0.0, 0.03, 0.0, 0.0)))
FILE = replace(FILE, motor=replace(FILE.motor, inertia=2e-2))
SATURATION = EffectSetting('torque_saturation', {
    'torque_loss': LOSS, 'shape': 3.0, 'onset': 0.2, 'largest_effort': LARGEST})
MACHINE = replace(FILE, effects=(SATURATION,))


def taken(counts: float) -> Recording:
    """Return slow strokes to a high load, with an encoder of so many counts per turn."""
    time = np.arange(0.0, 24.0, STEP)
    way = 2.0 * np.pi * 0.25 * time
    position = 12.0 * (1.0 - np.cos(way)) + 0.5 * np.sin(7.0 * way)
    velocity, acceleration = np.gradient(position, STEP), np.gradient(
        np.gradient(position, STEP), STEP)
    effort = effort_of_motion(sample_table(STEP, time, position, velocity, acceleration), STEP,
                              physics_of(MACHINE))
    count = 2.0 * np.pi / counts
    noise = np.random.default_rng(3).normal(0.0, 0.05, time.size)
    return Recording.from_samples('run', time, np.round(position / count) * count, effort + noise)


def lost(parameters: Mapping[str, float], effort: float) -> float:
    """Return the torque [N·m] that is lost at an effort [N·m]."""
    effect = get_effect('torque_saturation')
    sample, values = np.zeros(SAMPLE_SIZE), np.zeros(PARAMETER_SIZE)
    values[:len(effect.names)] = [parameters[name] for name in effect.names]
    sample[EFFORT] = effort
    return effort - effect.stages['actuation'](values, np.zeros(STATE_SIZE), sample)


@pytest.mark.parametrize('counts', [16000.0, 4000.0])
def test_the_loss_is_found_whatever_the_encoder(counts):
    recording = taken(counts)
    fitter = Fitter(problem_of([recording], FILE))
    variant, = variants_of(get_effect('torque_saturation'), fitter.problem.scene)
    fit = fitter.refine(fitter.fit(variant, rounds=8), 12)
    effort = 0.9 * float(recording.effort.max())
    assert lost(fit.hypothesis.named(fit.vector, 0), effort) == pytest.approx(
        lost(SATURATION.parameters, effort), rel=0.15)


def test_a_prediction_is_not_too_high_in_the_mean():
    recording = taken(4000.0)
    off = filtered(predict_effort(recording, MACHINE) - recording.effort,
                   gaussian_kernel(10.0, STEP))
    high = recording.effort > 0.7 * LARGEST
    assert high.sum() > 1000
    assert abs(float(np.mean(off[high]))) < 0.01 * float(np.mean(recording.effort[high]))
