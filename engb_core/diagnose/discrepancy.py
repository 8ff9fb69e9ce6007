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

from engb_core.diagnose.locate import coordinates
from engb_core.diagnose.optimise.fit import Fitter

__all__ = ['PARTS', 'coordinate_cells', 'discrepancy_covariance', 'state_cells']

Array = NDArray[np.float64]

# Cells of the state: parts of the stroke and of the speed that hold equally many values, for each
# direction, speeding up and slowing down. A formula's error is smooth on that scale.
POSITIONS, SPEEDS = 5, 3
# Parts of a coordinate, on which the form of one effect may be another each time.
PARTS = 5


def state_cells(fitter: Fitter) -> NDArray[np.int64]:
    """Return the cell of the state (position, velocity, sign of acceleration) of each value,
    (m,)."""
    def column(name: str) -> Array:
        return np.concatenate([getattr(run.motion, name)[run.comparison.grid]
                               for run in fitter.problem.runs])

    velocity = column('velocity')
    place = _part(column('position'), POSITIONS) * SPEEDS + _part(np.abs(velocity), SPEEDS)
    return (2 * place + (velocity > 0.0)) * 2 + (column('acceleration') > 0.0)


def coordinate_cells(fitter: Fitter, name: str) -> NDArray[np.int64]:
    """Return in which part of a coordinate, such as the speed or the load, each value lies, (m,);
    of time, where the coordinate does not stand in every recording."""
    tables = [coordinates(run, fitter.problem.model) for run in fitter.problem.runs]
    if not all(name in table for table in tables):
        name = 'time'
    return _part(np.concatenate([table[name][0] for table in tables]), PARTS)


def _part(values: Array, count: int) -> NDArray[np.int64]:
    """Return in which of `count` parts of equal size each value lies, (m,)."""
    edges = np.quantile(values, np.arange(1, count) / count)
    return np.searchsorted(edges, values)


def discrepancy_covariance(jacobian: Array, covariance: Array, weight: Array, scale: Array,
                           cells: NDArray[np.int64], size: float) -> Array:
    """Return the covariance (k, k) that the discrepancy gives to fitted numbers.

    Args:
        jacobian: (m, k) derivatives of the prediction.
        covariance: (k, k) inverse of JᵀW²J, with what else is known of the numbers.
        weight: (m,) of each value in the fit; 0 where it had none.
        scale: (m,) what the discrepancy is a part of at each value [N·m]: noise, or a torque.
        cells: (m,) of the state.
        size: root mean square of the discrepancy, as a part of `scale`.
    """
    pull = weight ** 2 * scale * size
    gradients = np.zeros((int(cells.max(initial=0)) + 1, jacobian.shape[1]))
    np.add.at(gradients, cells, jacobian * pull[:, None])
    moved = gradients @ covariance
    return moved.T @ moved
