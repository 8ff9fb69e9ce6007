# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Sums of weighted products for least squares, by one processor.

Fits run side by side. A linear algebra library that spreads each small product over all
processors besides has its threads wait for each other: on a busy machine a hundred times as long
as the product takes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.physics.compiled import kernel

__all__ = ['normal_equations']

Array = NDArray[np.float64]


def normal_equations(design: Array, target: Array, weight: Array) -> tuple[Array, Array]:
    """Return DᵀW²D (k, k) and DᵀW²t (k,).

    Args:
        design: D (m, k).
        target: t (m,).
        weight: (m,) the diagonal of W; rows of weight 0 are left out.
    """
    gram = np.zeros((design.shape[1], design.shape[1]))
    right = np.zeros(design.shape[1])
    _add(np.ascontiguousarray(design, float), np.ascontiguousarray(target, float),
         np.ascontiguousarray(weight, float), gram, right)
    return gram, right


@kernel
def _add(design: Array, target: Array, weight: Array, gram: Array, right: Array) -> None:
    size = design.shape[1]
    for row in range(design.shape[0]):
        if weight[row] == 0.0:
            continue
        square = weight[row] * weight[row]
        for first in range(size):
            value = design[row, first] * square
            right[first] += value * target[row]
            for second in range(first + 1):
                gram[first, second] += value * design[row, second]
    for first in range(size):
        for second in range(first):
            gram[second, first] = gram[first, second]
