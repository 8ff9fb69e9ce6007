# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A standard deviation that a few outliers leave alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

__all__ = ['robust_deviation']


def robust_deviation(values: ArrayLike) -> float:
    """Return the standard deviation of Gaussian values (n,) about nought from the median of their
    sizes (Rousseeuw and Croux, Journal of the American Statistical Association 88 (1993) 1273)."""
    return 1.4826 * float(np.median(np.abs(values)))
