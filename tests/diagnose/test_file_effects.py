# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Effects that the model file holds already act in every hypothesis and stay in the answer."""

from dataclasses import replace

import numpy as np

from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.model import EffectSetting, Friction, Model
from engb_core.prediction import predict_effort
from engb_core.recording import Recording


def test_a_model_with_its_effect_in_the_file_fits():
    time = np.arange(0.0, 12.0, 1e-3)
    position = 10.0 * (1.0 - np.cos(1.7 * time)) + 2.0 * (1.0 - np.cos(5.3 * time))
    model = replace(
        Model(), friction=Friction(coulomb=0.012),
        effects=(EffectSetting('asymmetric_friction', {'asymmetry': 0.4}),))
    silent = Recording.from_samples('run', time, position, np.zeros(time.size))
    noise = np.random.default_rng(8).normal(0.0, 2e-3, time.size)
    recording = Recording.from_samples('run', time, position,
                                       predict_effort(silent, model) + noise)

    def missed(model: Model) -> float:
        fitter = Fitter(problem_of([recording], model))
        nominal = fitter.nominal()
        assert [entry.effect for entry in nominal.hypothesis.corrected(nominal.vector).effects
                if entry.effect != 'sampling_delay'] == [
                    entry.effect for entry in model.effects]
        return float(np.sqrt(np.mean(nominal.residual ** 2)))

    assert missed(model) < 0.2 * missed(replace(model, effects=()))
