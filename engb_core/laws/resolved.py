# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a position sensor repeats along the shaft is judged where samples are near enough to it.

A fast shaft passes more periods of a disc off centre or of an interpolation than samples of it are
taken. What these do to the controller, and so to torque and motion, is then folded to frequencies
at which it never was, and no motion tells it. On slower stretches it can be told as anything
else.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from engb_core.diagnose.optimise.fit import Fit, Fitter
from engb_core.laws.atoms import MOST_TURNS
from engb_core.laws.forms import Form

__all__ = ['Resolved', 'orders_of', 'resolved_parts']

Array = NDArray[np.float64]

# Samples of each period, so that twice its order is told as well: what interpolates between two
# signals errs once and twice in their period.
SAMPLES = 4
# Part of the values that must remain.
LEAST_PART = 0.3


@dataclass(frozen=True)
class Resolved:
    """A part of the recordings in which orders above `above` and up to `order` [periods per radian
    of the shaft] are resolved: what fits it, and the base fitted to it."""

    above: int
    order: int
    fitter: Fitter
    base: Fit


def resolved_parts(fitter: Fitter, base: Fit) -> list[Resolved]:
    """Return the parts in which octaves of orders are resolved that the whole does not resolve,
    the finest last.

    Args:
        fitter: of the problem.
        base: fitted by it; its effects stay, fitted anew to each part.
    """
    speed, sampling = _speeds(fitter), fitter.problem.scene.sampling
    found: list[Resolved] = []
    above, order, before = 0, 1, fitter.fitted
    while above < MOST_TURNS:
        near = speed * order * sampling < 2.0 * np.pi / SAMPLES
        seen = fitter.fitted & near
        if seen.sum() < LEAST_PART * fitter.fitted.sum():
            break
        if not np.array_equal(seen, before):
            part = fitter.on_rows(seen)
            part.judged = fitter.judged & near
            found.append(Resolved(above, order, part, part.finish(part.refine(base))))
        above, order, before = order, min(2 * order, MOST_TURNS), seen
    return found


def orders_of(form: Form) -> list[int]:
    """Return the whole orders of the waves along the shaft in a form of a position sensor."""
    if form.acts_as != 'position_shift':
        return []
    return [1 if atom.text.startswith('sin(position') else int(atom.text[4:].split(' ')[0])
            for atom in form.factors if atom.kind == 'turn']


def _speeds(fitter: Fitter) -> Array:
    """Return the fastest speed that had a part in each value, (m,)."""
    return np.concatenate([
        maximum_filter1d(np.abs(run.motion.velocity), run.comparison.taps.size)[
            run.comparison.grid] for run in fitter.problem.runs])
