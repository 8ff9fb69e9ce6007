# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Naive sparse regression: every column at once on smoothed derivatives, small ones dropped.

By pysindy's STLSQ where pysindy is installed (`pip install pysindy`), else the same method here.
"""
from __future__ import annotations

from importlib import metadata

import numpy as np

from .columns import Answer, candidates
from .nominal import moving, Nominal, torque_of
from .signals import Signals

__all__ = ['sequential_thresholding', 'sparse', 'thresholding_by']

_THRESHOLD = 0.3   # of the residual's rms: smaller contributions are dropped


def thresholding_by() -> str:
    """Which code does the sparse regression here."""
    try:
        from pysindy import STLSQ  # noqa: F401
    except ImportError:
        return 'own sequential thresholding (pysindy is not installed: pip install pysindy)'
    return f'pysindy {metadata.version("pysindy")} (STLSQ)'


def sequential_thresholding(matrix: np.ndarray, target: np.ndarray, threshold: float,
                            ridge: float = 1e-3) -> np.ndarray:
    """Ridge regression; coefficients below `threshold` are dropped, the rest fitted again.

    The method of Brunton, Proctor & Kutz (2016), as pysindy's STLSQ.
    """
    try:
        from pysindy import STLSQ
    except ImportError:
        pass
    else:
        return np.ravel(STLSQ(threshold=threshold, alpha=ridge * target.size, max_iter=20).fit(
            matrix, target[:, None]).coef_)
    kept = np.ones(matrix.shape[1], bool)
    numbers = np.zeros(kept.size)
    for _ in range(20):
        part = matrix[:, kept]
        numbers[:] = 0.0
        numbers[kept] = np.linalg.solve(part.T @ part + ridge * target.size
                                        * np.eye(part.shape[1]), part.T @ target)
        still = np.abs(numbers) >= threshold
        if (still == kept).all() or not still.any():
            return numbers * still
        kept = still
    return numbers


def sparse(model: Nominal, run: Signals) -> Answer:
    """The largest contributions to the residual, by size."""
    found = candidates(model, run, 8)
    labels = [name for name, columns in found.items() for _ in columns]
    move = np.flatnonzero(moving(run.velocity))[::2]
    matrix = np.stack([column[move] for columns in found.values() for column in columns], axis=1)
    target = (run.effort - torque_of(model, run))[move]
    size = np.sqrt(np.mean(matrix ** 2, axis=0)) + 1e-15
    threshold = _THRESHOLD * float(np.sqrt(np.mean(target ** 2)))
    numbers = sequential_thresholding(matrix / size, target, threshold)
    weight: dict[str, float] = {}
    for label, number in zip(labels, numbers, strict=True):
        if number != 0.0:
            effect = label.partition(':')[0]
            weight[effect] = float(np.hypot(weight.get(effect, 0.0), number))
    ranked = sorted(weight, key=lambda effect: -weight[effect])

    def added(other: Signals) -> np.ndarray:
        columns = [c for group in candidates(model, other, 8).values() for c in group]
        if len(columns) != numbers.size:
            return np.zeros_like(other.time)
        return np.stack(columns, axis=1) @ (numbers / size)

    return Answer([(effect, 1.0) for effect in ranked], added)
