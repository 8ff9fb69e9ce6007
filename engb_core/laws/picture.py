# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a law takes away, drawn over the coordinate that tells most of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.diagnosis import LawPicture
from engb_core.diagnose.locate import coordinates
from engb_core.diagnose.optimise.fit import Fitter
from engb_core.laws.judgement import depends_on, Found

__all__ = ['column', 'picture_of']

Array = NDArray[np.float64]

BINS = 30


def column(fitter: Fitter, name: str) -> Array:
    """Return a coordinate (m,) at the values that a fit compares, by its name [SI]."""
    return np.concatenate([coordinates(run, fitter.problem.model)[name][0]
                           for run in fitter.problem.runs])


def picture_of(found: Found) -> LawPicture | None:
    """Return the remainder over the coordinate in which its bins tell most of the law."""
    fitter, law = found.fitter, found.contribution
    tables = [coordinates(run, fitter.problem.model) for run in fitter.problem.runs]
    names = [name for name in (*depends_on(found.candidate), 'position', 'velocity')
             if all(name in table for table in tables) and name != 'direction']
    best: tuple[float, LawPicture] | None = None
    applying = column(fitter, 'velocity') > 0.0
    left = found.candidate.fit.residual
    for name in dict.fromkeys(names):
        values = np.concatenate([table[name][0] for table in tables])
        edges = np.linspace(float(np.quantile(values, 0.002)), float(np.quantile(values, 0.998)),
                            BINS + 1)
        if not np.all(np.diff(edges) > 0.0):
            continue
        place = np.clip(np.digitize(values, edges) - 1, 0, BINS - 1)
        means = [[_means(place, rows, what) for rows in (applying, ~applying)]
                 for what in (left + law, law, left)]
        told = np.where(applying, means[1][0][place], means[1][1][place])
        missed = float(np.nanmean((law - told) ** 2))
        if best is None or missed < best[0]:
            best = missed, LawPicture(
                name, tables[0][name][1], 0.5 * (edges[1:] + edges[:-1]),
                (means[0][0], means[0][1]), (means[1][0], means[1][1]),
                (means[2][0], means[2][1]))
    return None if best is None else best[1]


def _means(place: NDArray[np.int64], rows: NDArray[np.bool_], values: Array) -> Array:
    count = np.bincount(place[rows], minlength=BINS)
    total = np.bincount(place[rows], values[rows], BINS)
    return np.where(count > 2, total / np.maximum(count, 1), np.nan)
