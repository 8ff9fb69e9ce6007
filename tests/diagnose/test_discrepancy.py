# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A formula that is only nearly right moves the numbers by what their deviations say."""

import numpy as np

from engb_core.diagnose.discrepancy import discrepancy_covariance


def test_the_covariance_is_that_of_least_squares_under_a_discrepancy():
    random = np.random.default_rng(1)
    values, cells, size = 600, 12, 0.7
    cell = random.integers(0, cells, values)
    jacobian = random.normal(size=(values, 3)) + 0.3 * cell[:, None]
    sigma = random.uniform(0.5, 2.0, values)
    weight = np.where(random.uniform(size=values) < 0.8, 1.0 / (sigma + 0.3), 0.0)
    covariance = np.linalg.inv(jacobian.T @ (weight[:, None] ** 2 * jacobian))
    told = discrepancy_covariance(jacobian, covariance, weight, sigma, cell, size)
    # The same by drawing: each cell is off by one value in units of the noise.
    off = size * random.normal(size=(4000, cells))[:, cell] * sigma
    drawn = off * weight ** 2 @ jacobian @ covariance
    np.testing.assert_allclose(np.sqrt(np.diag(told)), drawn.std(axis=0), rtol=0.05)
    # One discrepancy moves several numbers at once.
    np.testing.assert_allclose(told, np.cov(drawn.T), atol=0.1 * np.diag(told).max())


def test_more_values_in_the_same_states_do_not_make_it_smaller():
    random = np.random.default_rng(2)
    cell = np.arange(200) % 8
    jacobian = random.normal(size=(8, 2))[cell]
    sigma = np.ones(200)

    def told(times: int) -> np.ndarray:
        many = np.tile(jacobian, (times, 1))
        return discrepancy_covariance(many, np.linalg.inv(many.T @ many), np.ones(len(many)),
                                      np.tile(sigma, times), np.tile(cell, times), 1.0)

    np.testing.assert_allclose(told(10), told(1), rtol=1e-9)
