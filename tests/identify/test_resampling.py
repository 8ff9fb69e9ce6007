# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Equations (31) to (38): nearest neighbours, even and odd parts."""

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.identify.even_odd import decompose, even_odd
from engb_core.identify.resampling import (
    by_interpolation,
    by_mirrored_time,
    by_nearest_neighbour,
    nearest_neighbour,
    reference_grid,
)


def test_nearest_neighbour_is_the_minimum_of_the_distance():
    rng = np.random.default_rng(3)
    position, grid = rng.uniform(0, 5, 300), np.linspace(-0.2, 5.2, 120)
    brute = np.abs(grid[:, None] - position).min(axis=1)
    assert np.abs(grid - position[nearest_neighbour(grid, position)]) == pytest.approx(brute)


def test_grid_covers_what_both_strokes_cover():
    grid = reference_grid(np.array([0.0, 4.0]), np.array([5.0, 1.0]), 11, 'position')
    assert (grid[0], grid[-1], grid.size) == (1.0, 4.0, 11)
    slow_at_zero = np.linspace(0, 2, 200)**2
    grid = reference_grid(slow_at_zero, slow_at_zero[::-1], 50)
    assert (grid[0], grid[-1]) == (0.0, 4.0)
    assert grid[1] - grid[0] < 0.1 * (grid[-1] - grid[-2])
    with pytest.raises(InputError, match='no position in common'):
        reference_grid(np.array([0.0, 1.0]), np.array([3.0, 2.0]), 11)


def test_even_and_odd_part_add_up_and_mirror():
    values = np.random.default_rng(0).normal(size=50)
    even, odd = even_odd(values)
    assert even + odd == pytest.approx(values)
    assert even == pytest.approx(even[::-1])
    assert odd == pytest.approx(-odd[::-1])


def strokes(lag):
    """Clamp and release of a load θ² with friction 3, tracked `lag` late."""
    time = np.linspace(0, 1, 2000)
    clamp = 4 * time**1.1
    release = 4 * (1 - np.clip(time - lag, 0, 1))
    one = (clamp, -(clamp**2) - 3.0, np.gradient(clamp, time))
    two = (release, -(release**2) + 3.0, np.gradient(release, time))
    return one, two


@pytest.mark.parametrize('way', [by_nearest_neighbour, by_interpolation])
def test_load_is_even_and_friction_odd_though_tracking_is_poor(way):
    one, two = strokes(0.15)
    grid = np.linspace(0.7, 3.9, 80)
    parts = decompose(way(grid, one, two))
    assert -parts.even == pytest.approx(grid**2, abs=0.02)
    assert -parts.odd == pytest.approx(np.full(80, 3.0), abs=0.02)
    assert (parts.velocity > 0).all()


def test_without_resampling_poor_tracking_mixes_load_into_friction():
    one, two = strokes(0.15)
    # Both strokes one after the other, as they were driven; the reference turns between them.
    time = np.arange(one[0].size + two[0].size, dtype=float)
    samples = tuple(np.concatenate(pair) for pair in zip(one, two, strict=True))
    clamp = np.arange(one[0].size)
    parts = decompose(by_mirrored_time(80, time, clamp, samples, one[0].size - 0.5))
    assert np.abs(-parts.odd - 3.0).max() > 0.5
    paired = by_mirrored_time(80, time, clamp, samples, one[0].size - 0.5)
    first = samples[0][:one[0].size]
    assert paired.release_position[0] == samples[0][-1]
    assert paired.clamp_position[-1] == first[-1]
