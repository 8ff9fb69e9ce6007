# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Does an effect explain the machine, or only smooth what counts put into its motion?

A shaft that gives and a current that is filtered let less of the position's noise through to the
effort that a motion seems to need. That alone leaves less of the mismatch, on recordings that no
fit has seen as well. How much less is found by the same bootstrap as the noise itself
(position_noise.py), with and without the effect.
"""

from __future__ import annotations

import numpy as np

from engb_core.diagnose.constants import FORMULA_ERROR
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.position_noise import position_noise
from engb_core.diagnose.resonance.wide_band import RESONANCE
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square

__all__ = ['only_smooth']

SMOOTH = (RESONANCE, 'effort_measurement_lag')


def only_smooth(fitter: Fitter, fit: Fit) -> set[int]:
    """Return which effects of a fit take away no more than the noise that they smooth, and than
    what no two fits are told apart by."""
    found = set()
    counts = _of_counts(fitter, [run.counts for run in fitter.problem.runs])
    for index, effect in enumerate(fit.hypothesis.ids):
        if effect not in SMOOTH:
            continue
        without = fitter.without(fit, index)
        gain = (reduced_chi_square(without, fitter) - reduced_chi_square(fit, fitter)
                - FORMULA_ERROR)
        # Nothing smooths more than all that counts put in, so that most need not be drawn anew.
        if gain <= counts and gain <= _counts_of(fitter, without) - _counts_of(fitter, fit):
            found.add(index)
    return found


def _counts_of(fitter: Fitter, fit: Fit) -> float:
    """Return what the position's noise adds to the reduced chi-square by the physics of a fit."""
    return _of_counts(fitter, [
        position_noise(run.recording, run.motion, run.comparison,
                       fit.hypothesis.physics(fit.vector, index), run.sampling_noise)
        for index, run in enumerate(fitter.problem.runs)])


def _of_counts(fitter: Fitter, counts: list[np.ndarray]) -> float:
    weight = fitter.spread ** -2.0
    return float(np.sum(weight * np.concatenate(counts) ** 2)
                 / np.sum(weight * fitter.sigma ** 2))
