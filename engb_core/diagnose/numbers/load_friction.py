# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Friction that grows with load in a file that was refitted without it.

A refit of the file's numbers puts what grows with load into Coulomb friction, drag and load: all
of them have moved, and none is the wrong number (wrong_numbers.py). Whether the friction is there
is then asked of whole recordings: held at the file's value, everything else refitted, the model
must be worse on recordings that it was not fitted to. The gain that the file has may have been
moved as well, by a refit around something else: then nothing is said (moved_by_refit.py).
"""

from __future__ import annotations

from engb_core.diagnose.constants import LARGER_PART
from engb_core.diagnose.nominal import CURVATURE
from engb_core.diagnose.numbers.wrong_numbers import NumberFinding, refit_of_file
from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.diagnose.score.recording_folds import better_on_others, LEAST_RECORDINGS
from engb_core.diagnose.score.reduced_chi_square import reduced_chi_square

__all__ = ['missing_load_friction']

GAIN, EFFECT = 'load_gain', 'load_dependent_friction'


def missing_load_friction(fitter: Fitter, explained: Fit) -> NumberFinding | None:
    """Return the load-dependent friction that the file has too little of, None where other
    recordings do without; its gain is that of a straight line over the load, unless they insist on
    a curve."""
    numbers = explained.hypothesis.numbers
    if GAIN not in [number.name for number in numbers] \
            or len(fitter.problem.runs) < LEAST_RECORDINGS:
        return None
    straight = fitter.refine(fitter.refit(explained, tuple(
        number for number in numbers if number.name != CURVATURE)))
    held = fitter.refine(fitter.refit(explained, tuple(
        number for number in numbers if number.name not in (GAIN, CURVATURE))))
    fit = explained if better_on_others(fitter, straight, explained) else straight
    value = float(fit.vector[[number.name for number in fit.hypothesis.numbers].index(GAIN)])
    if value <= fitter.problem.model.friction.load_gain or not better_on_others(
            fitter, held, fit):
        return None
    by_itself = refit_of_file(fitter, fitter.finished(fit)).by_itself[GAIN]
    if by_itself < LARGER_PART:
        return None
    rise = reduced_chi_square(held, fitter) - reduced_chi_square(fit, fitter)
    return NumberFinding(EFFECT, fit, rise, moved=by_itself)
