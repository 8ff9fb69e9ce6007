# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A delay that is found beside a free load curve is judged without what comes before a stop."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from engb_core.diagnose.nominal import Knots
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.diagnose.problem import problem_of
from engb_core.laws import judgement
from tests.diagnose.simulated_brake import lively, NOMINAL


def test_the_load_curve_stays_free(monkeypatch):
    free = Fitter(problem_of([lively(NOMINAL)], NOMINAL), 1, load_shape=Knots())
    search = SimpleNamespace(fitter=free, base=free.finish(free.base()))
    # Which law was chosen matters by its delay alone.
    monkeypatch.setattr(judgement, '_delays', lambda fitter, law: np.array([0.02]))
    monkeypatch.setattr(judgement, 'search_laws', lambda fitter, base, tell: (fitter, base))
    fitter, base = judgement._without_stops(search, None, print)
    assert fitter.load_shape
    assert fitter.problem.before_stop > free.problem.before_stop
    assert fitter.base(base.hypothesis.numbers).hypothesis.numbers == base.hypothesis.numbers
