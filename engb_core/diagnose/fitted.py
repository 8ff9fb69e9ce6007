# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a fit is, and how it looks without some of its effects."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.hypothesis import Hypothesis

__all__ = ['Fit', 'Screened', 'StartColumns', 'mean_square', 'without_effects']

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fit:
    """A fitted hypothesis.

    Attributes:
        hypothesis: what was fitted.
        vector: its numbers.
        predicted: (m,) filtered effort of all runs.
        cost: Σ (residual/σ)² over the fitted values plus the priors' part.
        residual: (m,) measured − predicted [N·m].
        jacobian: (m, size) derivatives, or None before `Fitter.finish`.
    """

    hypothesis: Hypothesis
    vector: Array
    predicted: Array
    residual: Array
    cost: float
    jacobian: Array | None = None


@dataclass(frozen=True)
class StartColumns:
    """How an effect at one start changes the filtered effort, per unit of its size, or, where it
    is not `scalable`, all that it changes.

    `columns` (m, 1), or (m, 2) where a phase is free: at phase 0 and a quarter turn on. Where the
    numbers hold no friction that the effect could change, they are what it does together with
    some (m, 1), and `begins_at` is the size of the effect then; else None.
    """

    setting: dict[str, float]
    columns: Array
    scalable: bool = True
    begins_at: float | None = None


@dataclass(frozen=True)
class Screened:
    """What a start of an effect promises by linear least squares.

    Attributes:
        cost: that a fit may come to.
        begun: cost at which it would begin: the same where the effect is scalable.
        sizes: (1,), or (2,) where a phase is free.
    """

    cost: float
    begun: float
    sizes: Array


def mean_square(fit: Fit) -> float:
    """Return the mean squared residual in plain torque [(N·m)²], all values weighing alike."""
    return float(np.mean(fit.residual ** 2))


def without_effects(fit: Fit, gone: set[int]) -> tuple[Hypothesis, Array]:
    """Return hypothesis and vector of a fit with some effects taken away, all else kept."""
    variants = tuple(variant for index, variant in enumerate(fit.hypothesis.variants)
                     if index not in gone)
    count = len(fit.hypothesis.numbers)
    kept = [count + entry for entry, (owner, _, _) in enumerate(fit.hypothesis.places)
            if owner not in gone]
    return (replace(fit.hypothesis, variants=variants),
            fit.vector[list(range(count)) + kept])
