# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a formula that is only nearly right does to the numbers: discrepancy of the model.

No formula is the truth, and what it misses comes again whenever the machine is in the same state:
it does not average out over time as noise does, and more of it than noise cannot hide, but as much
as a clean recording may hold can. The prediction is taken to be off by a torque that is the same
within a cell of the state and independent from cell to cell (Kennedy and O'Hagan, Bayesian
calibration of computer models, Journal of the Royal Statistical Society B 63 (2001) 425, with an
indicator kernel); the covariance of the numbers is that of their least squares under it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from engb_core.diagnose.fit import Fitter

__all__ = ['discrepancy_covariance', 'state_cells']

Array = NDArray[np.float64]

# Cells of the state: parts of the stroke and of the speed that hold equally many values, for each
# direction, speeding up and slowing down. A formula's error is smooth on that scale.
POSITIONS, SPEEDS = 5, 3


def state_cells(fitter: Fitter) -> NDArray[np.int64]:
    """Return the cell of the state (position, velocity, sign of acceleration) of each value,
    (m,)."""
    def column(name: str) -> Array:
        return np.concatenate([getattr(run.motion, name)[run.comparison.grid]
                               for run in fitter.problem.runs])

    velocity = column('velocity')
    place = _part(column('position'), POSITIONS) * SPEEDS + _part(np.abs(velocity), SPEEDS)
    return (2 * place + (velocity > 0.0)) * 2 + (column('acceleration') > 0.0)


def _part(values: Array, count: int) -> NDArray[np.int64]:
    """Return in which of `count` parts of equal size each value lies, (m,)."""
    edges = np.quantile(values, np.arange(1, count) / count)
    return np.searchsorted(edges, values)


def discrepancy_covariance(jacobian: Array, covariance: Array, weight: Array, sigma: Array,
                           cells: NDArray[np.int64], size: float) -> Array:
    """Return the covariance (k, k) that the discrepancy gives to fitted numbers.

    Args:
        jacobian: (m, k) derivatives of the prediction.
        covariance: (k, k) inverse of JᵀW²J, with what else is known of the numbers.
        weight: (m,) of each value in the fit; 0 where it had none.
        sigma: (m,) noise of each value [N·m].
        cells: (m,) of the state.
        size: root mean square of the discrepancy, in units of the noise.
    """
    pull = weight ** 2 * sigma * size
    gradients = np.zeros((int(cells.max(initial=0)) + 1, jacobian.shape[1]))
    np.add.at(gradients, cells, jacobian * pull[:, None])
    moved = gradients @ covariance
    return moved.T @ moved
