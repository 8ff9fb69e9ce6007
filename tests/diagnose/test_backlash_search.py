# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A gap is found wherever the friction lies."""

import numpy as np
import pytest

from engb_core.diagnose.hypothesis import Variant
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.effects.catalogue import get_effect
from engb_core.identify.first_model import first_model
from engb_core.recording import Recording
from tests.tables.other_benches import Drive, recorded


@pytest.mark.slow
def test_a_gap_beyond_all_of_the_friction():
    run = recorded(Drive(gap=0.25, load=0.1, ratio=20.0, reach=30.0), 3, 20)
    recording = Recording.from_samples('gear', run['t'], run['phi'], 0.06 * run['i'])
    fitter = Fitter(problem_of([recording], first_model([recording]).model))
    fit = fitter.fit(Variant(get_effect('backlash'), ()))
    unseen = ~fitter.fitted

    def left(residual):
        return float(np.sqrt(np.mean(residual[unseen] ** 2)))

    assert left(fit.residual) < 0.6 * left(fitter.nominal().residual)
    assert fit.hypothesis.named(fit.vector, 0)['gap'] == pytest.approx(0.25, rel=0.1)
