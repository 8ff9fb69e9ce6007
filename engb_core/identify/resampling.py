# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Ties clamp and release samples to one grid of positions (step 3, equations 31 to 36)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engb_core.errors import InputError

__all__ = ['Resampled', 'by_interpolation', 'by_mirrored_time', 'by_nearest_neighbour',
           'nearest_neighbour', 'reference_grid']

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Resampled:
    """Clamp and release data at the same grid of positions, all (M,) and in order of position.

    Attributes:
        position: θ_R [rad], rising.
        clamp_position, release_position: θ_RM, θ_RN [rad], where the data really come from.
        clamp, release: d̂ [N·m].
        clamp_velocity, release_velocity: [rad/s].
    """

    position: Array
    clamp_position: Array
    release_position: Array
    clamp: Array
    release: Array
    clamp_velocity: Array
    release_velocity: Array

    @property
    def position_mismatch(self) -> Array:
        """θ_RM − θ_RN (M,) [rad]: how far apart the two data of a pair were taken."""
        return self.clamp_position - self.release_position


def reference_grid(clamp: Array, release: Array, points: int, spacing: str = 'time') -> Array:
    """Return θ_R (≤ points,) [rad], rising, over what both strokes cover (equations 32, 33).

    Args:
        clamp, release: θ_M, θ_N (N,) [rad].
        points: M.
        spacing: 'time' follows the strokes' own samples, dense where they are slow, as in the
            paper's Figure 7: at constant acceleration all speeds are then served alike.
            'position' is even in position.

    Raises:
        InputError: the strokes have no position in common.
    """
    low = max(clamp.min(), release.min())
    high = min(clamp.max(), release.max())
    if not high > low:
        raise InputError('clamp and release stroke have no position in common; record a release '
                         'over the range that was clamped')
    if spacing == 'position':
        return np.linspace(low, high, points)
    both = np.concatenate([clamp, release])
    inside = both[(both >= low) & (both <= high)]
    return np.unique(np.quantile(inside, np.linspace(0.0, 1.0, points)))


def nearest_neighbour(grid: Array, position: Array) -> NDArray[np.int64]:
    """Return for each grid position the number k′ of the sample nearest to it (34)–(36).

    Args:
        grid: θ_R (M,) [rad].
        position: (N,) [rad] in any order; of equally near samples the one found first in order
            of position counts.
    """
    order = np.argsort(position, kind='stable')
    ordered = position[order]
    right = np.clip(np.searchsorted(ordered, grid), 1, ordered.size - 1)
    left = right - 1
    nearer = np.where(grid - ordered[left] <= ordered[right] - grid, left, right)
    return order[nearer]


def by_nearest_neighbour(grid: Array, clamp: tuple[Array, Array, Array],
                         release: tuple[Array, Array, Array]) -> Resampled:
    """Resample as the paper does; `clamp` and `release` are position, d̂, velocity (N,) each."""
    one = nearest_neighbour(grid, clamp[0])
    two = nearest_neighbour(grid, release[0])
    return Resampled(grid, clamp[0][one], release[0][two], clamp[1][one], release[1][two],
                     clamp[2][one], release[2][two])


def by_interpolation(grid: Array, clamp: tuple[Array, Array, Array],
                     release: tuple[Array, Array, Array]) -> Resampled:
    """Resample by averaging a grid step's samples and interpolating between the averages.

    A nearest neighbour throws most samples away, with their share of the noise's average; this
    uses them all. Arguments as in `by_nearest_neighbour`.
    """
    def at_grid(stroke: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        cell = np.searchsorted(0.5 * (grid[1:] + grid[:-1]), stroke[0])
        count = np.bincount(cell, minlength=grid.size)
        filled = count > 0
        mean = [np.bincount(cell, column, grid.size)[filled] / count[filled] for column in stroke]
        order = np.argsort(mean[0], kind='stable')
        centre = mean[0][order]
        return (np.interp(grid, centre, mean[1][order]), np.interp(grid, centre, mean[2][order]))

    one, two = at_grid(clamp), at_grid(release)
    return Resampled(grid, grid, grid, one[0], two[0], one[1], two[1])


def by_mirrored_time(points: int, time: Array, clamp: NDArray[np.int64],
                     samples: tuple[Array, Array, Array], centre: float) -> Resampled:
    """Pair each clamp sample with the one at the mirrored time of the reference (Fig. 7).

    This is what one would do if tracking were perfect, and what step 3 repairs: the pair's two
    positions differ by `position_mismatch`.

    Args:
        points: so many of the clamp samples.
        time: (n,) [s] of all samples, rising.
        clamp: the clamp stroke's samples.
        samples: position, d̂ and velocity (n,) of all samples.
        centre: time about which the reference mirrors [s].
    """
    one = clamp[np.unique(np.linspace(0, clamp.size - 1, points).round().astype(int))]
    mirrored = 2.0 * centre - time[one]
    one, mirrored = one[mirrored <= time[-1]], mirrored[mirrored <= time[-1]]
    two = nearest_neighbour(mirrored, time)
    return Resampled(samples[0][one], samples[0][one], samples[0][two], samples[1][one],
                     samples[1][two], samples[2][one], samples[2][two])
